"""Figure 9: for how long the pole was balanced."""

from typing import Any

from matplotlib.figure import Figure

from tuckerl.reports.curves import CurveWords, curves_alt, curves_caption, draw_curves
from tuckerl.reports.interactive import plotly_curves
from tuckerl.reports.picture import Picture
from tuckerl.studies.summary import Summary

_WORDS = CurveWords("cumulative number of balanced steps", "balanced steps more than {base}", sign=1)


def draw_fig9(summary: Summary) -> Figure:
    """Draw the cumulative balanced steps of every variant and how many more they are than the base's."""
    return draw_curves(summary, _WORDS)


def _interactive(summary: Summary) -> dict[str, Any]:
    return plotly_curves(summary, _WORDS)


def _caption(summary: Summary) -> str:
    return curves_caption(
        summary, "balanced steps, averaged over a variant's agents and cumulated over episodes (more is better)"
    )


FIG9 = Picture(
    "fig9",
    "cart-pole",
    "Figure 9. Cumulative number of balanced steps",
    draw_fig9,
    _caption,
    curves_alt,
    _interactive,
)
