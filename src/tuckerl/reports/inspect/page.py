"""Drawing the inside, and a page of it that needs nothing but itself."""

import re
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from tuckerl._version import __version__
from tuckerl.errors import OutputError
from tuckerl.files import write_whole
from tuckerl.reports.inspect.content import Inspection, check_inspection

if TYPE_CHECKING:
    from tuckerl.reports.picture import Shown


def inspection_figures(inside: Inspection) -> "list[Shown]":
    """Draw every figure that there is something to see in, the same bytes each time.

    Raises
    ------
    ProblemError
        If the parts of `inside` do not belong together.
    """
    # Imported here: matplotlib takes longer than all of --help.
    from tuckerl.reports.inspect.views import VIEWS
    from tuckerl.reports.picture import Shown, render

    check_inspection(inside)
    return [
        Shown(
            view.name,
            view.title,
            view.caption(inside),
            view.alt(inside),
            render(lambda view=view: view.draw(inside)),  # type: ignore[misc]  # its type is view's
        )
        for view in VIEWS
        if view.shows(inside)
    ]


def write_inspection(inside: Inspection, folder: Path) -> Path:
    """Write ``figures/*.svg`` and ``*.png`` and ``inside.html``, and return the page's path.

    Parameters
    ----------
    inside : Inspection
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    ProblemError
        If the parts of `inside` do not belong together.
    """
    shown = inspection_figures(inside)
    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {figures}: {error.strerror}; choose another folder") from error
    for one in shown:
        write_whole(figures / f"{one.name}.svg", one.drawn.svg)
        write_whole(figures / f"{one.name}.png", one.drawn.png)
    page = folder / "inside.html"
    write_whole(page, render_page(inside, shown).encode())
    return page


def render_page(inside: Inspection, shown: "list[Shown]") -> str:
    """Return the page, with its figures inside it."""
    from jinja2 import Environment, StrictUndefined

    from tuckerl.reports.markup import inlined
    from tuckerl.reports.text import counted

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    template = environment.from_string(
        files("tuckerl.reports.inspect").joinpath("template.html").read_text(encoding="utf-8")
    )
    facts = [
        counted(inside.n_agents, "agent"),
        counted(inside.n_states, "state"),
        counted(inside.n_actions, "action"),
        *([counted(len(inside.steps), "episode")] if len(inside.steps) else []),
        *([counted(inside.history.episode.size, "window")] if inside.history.episode.size else []),
    ]
    figures = [
        {
            "name": one.name,
            "title": one.title,
            "caption": one.caption,
            "svg": inlined(_without_image_ids(one.drawn.svg.decode()), one.name, one.alt),
        }
        for one in shown
    ]
    return template.render(
        title=inside.title, facts=facts, figures=figures, missing=_missing(inside), version=__version__
    )


def _without_image_ids(svg: str) -> str:
    # matplotlib names images by their content, so two like colour bars have one id; nothing refers to them.
    return re.sub(r' id="image[0-9a-f]+"', "", svg)


def _missing(inside: Inspection) -> list[str]:
    """Return what is not shown because there is none of it."""
    from tuckerl.reports.inspect.agents import tables_differ

    words = []
    if not len(inside.steps):
        words.append("There is no learning curve: no episode is on record.")
    if not inside.history.episode.size:
        words.append("There are no action weights and no choices by window: no window is on record.")
    if inside.loadings is None:
        words.append("There are no loadings: no decomposition of the tables is at hand.")
    if inside.n_agents > 1 and not tables_differ(inside):
        words.append(f"All {inside.n_agents} agents have the same table, so their differences are not drawn.")
    return words
