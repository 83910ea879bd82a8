"""The figures of an inspection, and a page of them that needs nothing but itself."""

from pathlib import Path
from typing import Any

import numpy as np

from tuckerl._version import __version__
from tuckerl.reports.figure import RenderedFigure, draw_figures
from tuckerl.reports.inspect.agents import tables_differ
from tuckerl.reports.inspect.content import Inspection, check_inspection
from tuckerl.reports.inspect.figures import FIGURES
from tuckerl.reports.inspect.greedy import NO_PREFERENCE
from tuckerl.reports.page import write_page
from tuckerl.reports.text import counted

_MOST_ROWS, _MOST_COLUMNS = 40, 8  # of the table on paper


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
        first=_first_states(inspection),
        version=__version__,
    )


def _first_states(inspection: Inspection) -> dict[str, Any]:
    """Return a table of the first states in which agent 0 prefers something, for paper; none where a grid shows all."""
    best, q = inspection.best[0], np.where(inspection.allowed[0], inspection.q[0], np.nan)
    states = np.flatnonzero(best != NO_PREFERENCE)
    names = inspection.action_names[:_MOST_COLUMNS]
    rows = [
        (f"state {state}", inspection.action_names[best[state]], [q[state, best[state]], *q[state, : len(names)]])
        for state in states[:_MOST_ROWS]
    ]
    head = ["state", "greedy action", "value", *(f"Q(s, {name})" for name in names)]
    return {"head": head, "n": states.size, "rows": [] if inspection.layout else rows}


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
