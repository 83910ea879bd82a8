"""The one frame of all pages: a template that needs nothing but itself, its figures, their data and its own scripts."""

import base64
import hashlib
import json
import math
import platform
import re
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tuckerl._version import __version__
from tuckerl.files import make_folder, write_whole
from tuckerl.intervals import CONFIDENCE, N_RESAMPLES
from tuckerl.reports import text
from tuckerl.reports.figure import RenderedFigure
from tuckerl.reports.variant_text import described, settings
from tuckerl.studies.comparison_result import VERDICTS
from tuckerl.studies.variants import algorithm_of

_LIBRARIES = ("numpy", "scipy", "numba", "polars", "matplotlib", "gymnasium", "pettingzoo", "optuna")
_SCRIPTS = Path(__file__).parent / "scripts"


class Script(NamedTuple):
    """A script in the page, and the hash by which the browser knows it."""

    source: Markup
    hash: str


def write_page(
    folder: Path,
    template: str,
    figures: Sequence[RenderedFigure],
    /,
    *,
    name: str = "report.html",
    numbers: tuple[str, Any] | None = None,
    **values: Any,
) -> Path:
    """Write ``figures/*.svg`` and ``*.png``, the numbers as JSON and the page; return the page's path.

    Parameters
    ----------
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.
    template : str
        A file of this folder that extends ``base.html``: of its block `main`, headings with an id make the list of
        contents. All values in it are escaped. It words numbers by the functions of ``text.py``, as filters.
    figures : sequence of RenderedFigure
        Those of the page: their files are written, and the scripts that draw them are put in the page.
    name : str
        The page's file.
    numbers : (name, content), optional
        A file beside the page.
    **values
        What stands in the template.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    page = _environment().get_template(template).render(values, scripts=scripts_of(figures))
    place = folder / "figures"
    make_folder(place, "choose another folder")
    for figure in figures:
        write_whole(place / f"{figure.name}.svg", figure.svg)
        write_whole(place / f"{figure.name}.png", figure.png)
    if numbers is not None:
        content = json.dumps(numbers[1], indent=2, allow_nan=False, ensure_ascii=False)
        write_whole(folder / numbers[0], f"{content}\n".encode())
    write_whole(folder / name, page.encode())
    return folder / name


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("tuckerl.reports", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    for name, word in vars(text).items():
        if getattr(word, "__module__", "") == text.__name__ and not name.startswith("_"):
            environment.filters[name] = word
    environment.filters |= {"inlined": inlined, "headings": headings, "embedded": embedded, "as_link": as_link}
    environment.globals |= {
        "nan": math.nan,
        "confidence": round(100 * CONFIDENCE),
        "resamples": N_RESAMPLES,
        "versions": versions(),
        "verdicts": VERDICTS,
        "algorithm_of": algorithm_of,
        "described": described,
        "settings": settings,
    }
    return environment


def scripts_of(figures: Iterable[RenderedFigure]) -> list[Script]:
    """Return the scripts of a page: what every page has, and those that draw its figures."""
    kinds = {figure.live.kind for figure in figures if figure.live}
    return [_script(name) for name in ("page", *(["plot"] if kinds else []), *sorted(kinds))]


def _script(name: str) -> Script:
    source = (_SCRIPTS / f"{name}.js").read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
    return Script(Markup(source), f"sha256-{digest}")  # noqa: S704  # a file of this package


def headings(content: str) -> list[tuple[str, Markup]]:
    """Return the ids and the words of a page's second headings."""
    found = re.findall(r'<h2 id="([^"]+)">(.*?)</h2>', content, re.DOTALL)
    return [(name, Markup(re.sub(r"<[^>]*>", "", words))) for name, words in found]  # noqa: S704  # as they are above


def embedded(content: Any, name: str) -> Markup:
    """Return data for the page's scripts as an element: nothing in it is markup, or ever run."""
    data = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    escaped = data.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    element = Markup('<script type="application/json" id="{}">').format(name)
    return element + Markup(escaped) + Markup("</script>")  # noqa: S704  # escaped above, as JSON has it


def as_link(content: str, kind: str) -> str:
    """Return a text as an address that holds all of it, which a link downloads without asking anybody."""
    return f"data:{kind};base64,{base64.b64encode(content.encode()).decode()}"


def inlined(figure: RenderedFigure) -> Markup:
    """Return a figure's SVG as an element of the page: named for screen readers, its ids its own."""
    svg = figure.svg.decode()
    box = re.search(r'viewBox="([^"]+)"', svg)
    body = svg[svg.index('<g id="figure_1">') : svg.rindex("</svg>")]
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    # Images are named by their content, so that two like colour bars have one id; nothing refers to them.
    body = re.sub(r' id="image[0-9a-f]+"', "", body)
    body = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{figure.name}-", body)
    opening = Markup('<svg viewBox="{}" role="img" aria-label="{}">').format(box[1] if box else "", figure.alt)
    return opening + Markup(body) + Markup("</svg>")  # noqa: S704  # matplotlib's own output, its text turned to shapes


def versions() -> list[tuple[str, str]]:
    """Return the versions of what made a page: this package, Python and the libraries that are installed."""
    python = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    found = [("tuckerl", __version__), ("Python", python)]
    for name in _LIBRARIES:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:  # an extra
            continue
    return found
