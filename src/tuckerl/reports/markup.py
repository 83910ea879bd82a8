"""What all pages have in common: templates that need nothing but themselves, figures inspection them, versions."""

import json
import math
import platform
import re
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tuckerl._version import __version__
from tuckerl.files import make_folder, write_whole
from tuckerl.intervals import CONFIDENCE, N_RESAMPLES
from tuckerl.reports import text
from tuckerl.reports.figure import RenderedFigure


def rendered(template: str, **values: Any) -> str:
    """Return a page: a template of this folder with the values in it, all text escaped.

    Templates word numbers by the functions of ``text.py``, as filters.
    """
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
    environment.filters["inlined"] = inlined
    environment.globals |= {"nan": math.nan, "confidence": round(100 * CONFIDENCE), "resamples": N_RESAMPLES}
    return environment.get_template(template).render(values)


def write_page(
    folder: Path, name: str, page: str, figures: Iterable[RenderedFigure], numbers: tuple[str, Any] | None = None
) -> Path:
    """Write ``figures/*.svg`` and ``*.png``, the numbers as JSON and the page; return the page's path.

    Parameters
    ----------
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.
    name, page : str
        The page's file and its content.
    figures : iterable of RenderedFigure
    numbers : (name, content), optional
        A file beside the page.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
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


def versions(*libraries: str) -> list[tuple[str, str]]:
    """Return the versions of what made a page: this package, Python and the libraries."""
    python = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    return [("tuckerl", __version__), ("Python", python), *((name, version(name)) for name in libraries)]
