"""Write formulas as MathML when the site is built, so that pages need no script and no network to show them.

A formula that cannot be converted stops the build. The font that has the large operators and the brackets which grow is
``_static/fonts/stix-two-math.woff2``: STIX Two Math (SIL Open Font License), without what formulas do not use.
"""

from typing import Any

from docutils import nodes
from math_core import LatexToMathML
from sphinx.application import Sphinx

_CONVERTER = LatexToMathML(annotation=False)


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_CONVERTER.convert_with_local_state(node.astext(), displaystyle=False))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    formulas = _apart(node.astext())
    writer.body.append('<div class="formulas">')
    for formula in formulas:
        made = _CONVERTER.convert_with_local_state(formula, displaystyle=True)
        writer.body.append(f'<div class="formula" tabindex="0">{made}</div>')
    writer.body.append("</div>")
    raise nodes.SkipNode


def _apart(latex: str) -> list[str]:
    r"""Return the formulas that ``\qquad`` holds apart on paper: on a screen each may have a line of its own."""
    return [part.strip().removesuffix(",") for part in latex.split(r"\qquad")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
