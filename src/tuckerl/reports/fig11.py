"""Figure 11: the cumulative cost of all mazes."""

from typing import Any

from matplotlib.figure import Figure

from tuckerl.reports.curves import CurveWords, draw_curves
from tuckerl.reports.interactive import plotly_curves
from tuckerl.reports.picture import Picture
from tuckerl.reports.wording import counted
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
    mazes, runs = counted(summary.scenario.n_instances, "maze"), counted(summary.scenario.n_runs, "run")
    base = summary.curves[0].variant
    return (
        f"Above: steps, averaged over a variant's agents, summed over {mazes} and cumulated over episodes; mean of"
        f" {runs}. Below: the same as a difference from {base}, taken run by run, so that more is better. Shaded: "
        "pointwise 95 % interval of the mean over runs (Student's t). The colour says how many agents there are; "
        "controls are dashed (constant weights) and dotted (permuted weights)."
    )


def _alt(summary: Summary) -> str:
    ends = ", ".join(f"{curve.variant} {curve.band.mean[-1]:,.0f}" for curve in summary.curves)
    return f"Two panels of curves by episode. Steps cumulated at the end: {ends}."


FIG11 = Picture(
    "fig11",
    "dyna-maze",
    "Figure 11. Cumulative cost of finding the way out",
    draw_fig11,
    _caption,
    _alt,
    _interactive,
)
