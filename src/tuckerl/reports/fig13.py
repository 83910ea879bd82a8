"""Figure 13: the cumulative cost of bringing the object home."""

from typing import Any

from matplotlib.figure import Figure

from tuckerl.reports.curves import CurveWords, curves_alt, curves_caption, draw_curves
from tuckerl.reports.interactive import plotly_curves
from tuckerl.reports.picture import Picture
from tuckerl.studies.summary import Summary

_WORDS = CurveWords("cumulative cost (steps to deliver)", "steps saved against {base}", sign=-1)


def draw_fig13(summary: Summary) -> Figure:
    """Draw the cumulative steps of every variant and the steps saved against the base."""
    return draw_curves(summary, _WORDS)


def _interactive(summary: Summary) -> dict[str, Any]:
    return plotly_curves(summary, _WORDS)


def _caption(summary: Summary) -> str:
    return curves_caption(
        summary, "steps until the object is home, averaged over a variant's teams and cumulated over episodes"
    )


FIG13 = Picture(
    "fig13",
    "robot-rescue",
    "Figure 13. Cumulative cost of the rescue",
    draw_fig13,
    _caption,
    curves_alt,
    _interactive,
)
