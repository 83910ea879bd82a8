"""Cumulative curves of all variants, and what each has gained on the base: the form of Figures 9, 11 and 13."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from tuckerl.reports.styles import EndLabel, LineStyle, label_ends, line_styles
from tuckerl.reports.text import counted, whole
from tuckerl.studies.statistics import Band
from tuckerl.studies.summary import Summary
from tuckerl.types import IntArray

_CONTROLS, _MAIN = 2.0, 3.0  # orders of drawing


class CurveWords(NamedTuple):
    """What the axes of a scenario's curves say."""

    total: str  # of the cumulative measure
    gain: str  # of the difference from the base, counted so that more is better; {base} stands for its name
    sign: int  # 1 if more of the measure is better, else -1


class Line(NamedTuple):
    """One variant's line in one panel."""

    variant: str
    band: Band


def gains(summary: Summary, words: CurveWords) -> list[Line]:
    """Return by how much each variant is better than the base, which is itself left out."""
    return [
        Line(curve.variant, curve.against_base if words.sign > 0 else _negative(curve.against_base))
        for curve in summary.curves[1:]
    ]


def flat(summary: Summary) -> Line:
    """Return the base's own line among the gains: zero throughout."""
    curve = summary.curves[0]
    nothing = np.zeros(curve.band.mean.size)
    return Line(curve.variant, Band(nothing, nothing, nothing))


def totals(summary: Summary) -> list[Line]:
    """Return each variant's cumulative measure."""
    return [Line(curve.variant, curve.band) for curve in summary.curves]


def draw_curves(summary: Summary, words: CurveWords) -> Figure:
    """Draw the cumulative measure above and the gain on the base below, with 95 % bands."""
    figure = Figure(figsize=(6.9, 6.0))
    upper, lower = figure.subplots(
        2, sharex=True, gridspec_kw={"left": 0.115, "right": 0.78, "top": 0.985, "bottom": 0.07, "hspace": 0.09}
    )
    styles = line_styles(summary.scenario)
    n_episodes = summary.curves[0].band.mean.size
    base = summary.curves[0].variant
    for axes, lines in ((upper, totals(summary)), (lower, gains(summary, words))):
        for place, line in enumerate(lines):
            draw_line(axes, np.arange(1, n_episodes + 1), line.band, styles[line.variant], place)
        axes.set_xlim(0, n_episodes)
        axes.yaxis.set_major_formatter(FuncFormatter(_thousands))
        axes.margins(y=0.04)
    upper.set_ylim(bottom=0)
    upper.set_ylabel(words.total)
    lower.axhline(0, color=styles[base].colour, linewidth=styles[base].width, zorder=_CONTROLS)
    lower.set_ylabel(words.gain.format(base=base), parse_math=False)
    lower.set_xlabel("episodes")
    lower.xaxis.set_major_locator(MaxNLocator(integer=True))
    label_ends(upper, [_end(line, styles) for line in totals(summary)])
    label_ends(lower, [_end(line, styles) for line in [flat(summary), *gains(summary, words)]])
    return figure


def curves_caption(summary: Summary, summed: str) -> str:
    """Return what the two panels show; `summed` says what is summed before it is cumulated over episodes."""
    runs, base = counted(summary.scenario.n_runs, "run"), summary.curves[0].variant
    lost = sum(curve.n_diverged for curve in summary.curves)
    out = f" Left out because they diverged: {counted(lost, 'run')} of single variants." if lost else ""
    return (
        f"Above: {summed}; mean of {runs}. Below: the same as a difference from {base}, taken run by run, so that more "
        "is better. Shaded: pointwise 95 % interval of the mean over runs (Student's t). The colour says how many "
        f"agents there are; controls are dashed (constant weights) and dotted (permuted weights).{out}"
    )


def curves_alt(summary: Summary) -> str:
    """Return the numbers at the curves' ends."""
    ends = ", ".join(f"{curve.variant} {whole(float(curve.band.mean[-1]))}" for curve in summary.curves)
    return f"Two panels of curves by episode. Steps cumulated at the end: {ends}."


def draw_line(axes: Axes, episodes: IntArray, band: Band, look: LineStyle, place: int) -> None:
    """Draw one variant's band and mean; `place` counts the lines before it."""
    every = max(band.mean.size // 8, 1)
    order = _MAIN if look.marker else _CONTROLS
    shade = 0.18 if look.marker else 0.09  # nine bands on one another: the controls' are paler
    axes.fill_between(episodes, band.low, band.high, color=look.colour, alpha=shade, linewidth=0, zorder=order - 0.5)
    axes.plot(
        episodes,
        band.mean,
        color=look.colour,
        linestyle=look.dash,
        linewidth=look.width,
        marker=look.marker,
        markersize=5,
        markeredgecolor="white",
        markeredgewidth=0.6,
        markevery=((place * every // 3) % every, every),  # markers of close lines do not cover each other
        zorder=order,
    )


def _end(line: Line, styles: dict[str, LineStyle]) -> EndLabel:
    return EndLabel(line.variant, float(line.band.mean[-1]), styles[line.variant].colour)


def _negative(band: Band) -> Band:
    return Band(-band.mean, -band.high, -band.low)


def _thousands(value: float, _: int | None) -> str:
    return f"{value:,.0f}".replace("-", "\N{MINUS SIGN}")
