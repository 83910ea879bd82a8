"""The figures of an inspection, and a page of them that needs nothing but itself."""

from pathlib import Path

from tuckerl._version import __version__
from tuckerl.reports.figure import RenderedFigure, draw_figures
from tuckerl.reports.inspect.agents import tables_differ
from tuckerl.reports.inspect.content import Inspection, check_inspection
from tuckerl.reports.inspect.figures import FIGURES
from tuckerl.reports.page import write_page
from tuckerl.reports.text import counted


def inspection_figures(inspection: Inspection) -> list[RenderedFigure]:
    """Draw every figure that there is something to see in, the same bytes each time.

    Raises
    ------
    ProblemError
        If the parts of `inspection` do not belong together.
    """
    check_inspection(inspection)
    return draw_figures(FIGURES, inspection)


def write_inspection(inspection: Inspection, folder: Path) -> Path:
    """Write ``figures/*.svg`` and ``*.png`` and ``inspect.html``, and return the page's path.

    Parameters
    ----------
    inspection : Inspection
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    ProblemError
        If the parts of `inspection` do not belong together.
    """
    figures = inspection_figures(inspection)
    sizes = {
        "agent": inspection.n_agents,
        "state": inspection.n_states,
        "action": inspection.n_actions,
        "episode": len(inspection.steps),
        "window": inspection.n_windows,
    }
    return write_page(
        folder,
        "inspect.html",
        figures,
        name="inspect.html",
        title=inspection.title,
        facts=[counted(size, noun) for noun, size in sizes.items() if size],
        figures=figures,
        missing=_missing(inspection),
        version=__version__,
    )


def _missing(inspection: Inspection) -> list[str]:
    """Return what is not shown because there is none of it."""
    words = []
    if not len(inspection.steps):
        words.append("There is no learning curve: no episode is on record.")
    if not inspection.n_windows:
        words.append("There are no action weights and no choices by window: no window is on record.")
    if inspection.loadings is None:
        words.append("There are no loadings: no decomposition of the tables is at hand.")
    if inspection.n_agents > 1 and not tables_differ(inspection):
        words.append(f"All {inspection.n_agents} agents have the same table, so their differences are not drawn.")
    return words
