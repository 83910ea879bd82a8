"""Figure 11: the cumulative cost of all mazes."""

from typing import Any

from matplotlib.figure import Figure

from tuckerl.reports.curves import CurveWords, curves_alt, curves_caption, draw_curves
from tuckerl.reports.interactive import plotly_curves
from tuckerl.reports.picture import Picture
from tuckerl.reports.text import counted
from tuckerl.studies.summary import Summary


def draw_fig11(summary: Summary) -> Figure:
    """Draw the cumulative steps of every variant and the steps saved against the base."""
    return draw_curves(summary, _words(summary))


def _interactive(summary: Summary) -> dict[str, Any]:
    return plotly_curves(summary, _words(summary))


def _words(summary: Summary) -> CurveWords:
    mazes = counted(summary.scenario.n_instances, "maze")
    return CurveWords(f"cumulative cost (steps in {mazes})", "steps saved against {base}", sign=-1)


def _caption(summary: Summary) -> str:
    mazes = counted(summary.scenario.n_instances, "maze")
    return curves_caption(
        summary, f"steps, averaged over a variant's agents, summed over {mazes} and cumulated over episodes"
    )


FIG11 = Picture(
    "fig11",
    "dyna-maze",
    "Figure 11. Cumulative cost of finding the way out",
    draw_fig11,
    _caption,
    curves_alt,
    _interactive,
)
