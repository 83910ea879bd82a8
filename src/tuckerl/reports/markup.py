"""What all pages have in common: templates that need nothing but themselves, figures inside them, versions."""

import platform
import re
from importlib.metadata import version
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tuckerl._version import __version__
from tuckerl.reports.picture import Shown


def rendered(template: str, **values: Any) -> str:
    """Return a page: a template of this folder with the values in it, all text escaped."""
    environment = Environment(
        loader=PackageLoader("tuckerl.reports", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(values)


def inlined(svg: str, name: str, alt: str) -> Markup:
    """Return matplotlib's SVG as an element of the page: named for screen readers, its ids its own."""
    box = re.search(r'viewBox="([^"]+)"', svg)
    body = svg[svg.index('<g id="figure_1">') : svg.rindex("</svg>")]
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    body = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", body)
    opening = Markup('<svg viewBox="{}" role="img" aria-label="{}">').format(box[1] if box else "", alt)
    return opening + Markup(body) + Markup("</svg>")  # noqa: S704  # matplotlib's own output, its text turned to shapes


def on_page(one: Shown) -> dict[str, Any]:
    """Return a figure as templates show it."""
    return {
        "name": one.name,
        "title": one.title,
        "caption": one.caption,
        "svg": inlined(one.drawn.svg.decode(), one.name, one.alt),
        "plotly": one.plotly,
    }


def versions(*libraries: str) -> list[tuple[str, str]]:
    """Return what a page was made with: this package, Python and the libraries."""
    python = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    return [("tuckerl", __version__), ("Python", python), *((name, version(name)) for name in libraries)]
