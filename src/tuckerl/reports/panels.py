"""Two panels of curves: each variant's own above, and below what it has gained on the base."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from tuckerl.reports.styles import EndLabel, LineStyle, label_ends, line_styles, plot_line
from tuckerl.reports.text import counted, whole
from tuckerl.studies.statistics import Band
from tuckerl.studies.study import Scenario
from tuckerl.studies.summary import Curve
from tuckerl.types import IntArray

_CONTROLS, _MAIN = 2.0, 3.0  # orders of drawing
_WIDTH, _LETTER = 6.9, 0.068  # inches
_LETTERS = 18  # of labels that a figure of this width has room for; it is widened for longer ones
_LONGEST_LABEL = 60
_LONGEST_BASE = 24  # beside the lower axis


class Panels(NamedTuple):
    """Two panels of curves: each variant's own, and below by how much it is better than the base, the first one."""

    scenario: Scenario
    episode: IntArray  # (P,) that the points stand for
    curves: tuple[Curve, ...]
    larger_is_better: bool
    total: str  # the words of the axes
    gain: str  # with "{base}" for the base's name
    counts_steps: bool  # from 0 on, in whole numbers
    is_cumulated: bool = False  # over episodes

    @property
    def styles(self) -> dict[str, LineStyle]:
        """Each variant's look."""
        return line_styles(self.scenario)

    @property
    def totals(self) -> dict[str, Band]:
        """The lines of the upper panel, by variant."""
        return {curve.variant: curve.band for curve in self.curves}

    def gain_on(self, base: str) -> str:
        """Return the words of the lower axis for differences from a base."""
        return self.gain.replace("{base}", base)

    def in_favour(self, difference: Band) -> Band:
        """Return a difference counted so that more is better."""
        mean, low, high = difference
        return difference if self.larger_is_better else Band(-mean, -high, -low)

    @property
    def gains(self) -> dict[str, Band]:
        """The lines of the lower panel: of the base zero throughout, of all others by how much they are better."""
        base, *others = self.curves
        lines = {base.variant: Band(*np.zeros((3, base.band.mean.size)))}
        for curve in others:
            lines[curve.variant] = self.in_favour(curve.against_base)
        return lines


def draw_panels(panels: Panels) -> Figure:
    """Draw both panels, with 95 % bands."""
    width = _WIDTH + _LETTER * max(0, max(len(_label(curve.variant)) for curve in panels.curves) - _LETTERS)
    figure = Figure(figsize=(width, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, sharex=True)
    styles, base = panels.styles, panels.curves[0].variant
    gains = {name: band for name, band in panels.gains.items() if name != base}
    for axes, lines in ((upper, panels.totals), (lower, gains)):
        for place, (name, band) in enumerate(lines.items()):
            _draw_line(axes, panels.episode, band, styles[name], place)
        axes.set_xlim(0, int(panels.episode[-1]))
        axes.margins(y=0.04)
        if panels.counts_steps:
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: whole(value)))
    if panels.counts_steps:
        upper.set_ylim(bottom=0)
    look = styles[base]
    lower.axhline(0, color=look.colour, linewidth=look.width, zorder=_CONTROLS)
    upper.set_ylabel(panels.total)
    lower.set_ylabel(panels.gain_on(_label(base, _LONGEST_BASE)), parse_math=False)
    lower.set_xlabel("episodes")
    lower.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axes, lines in ((upper, panels.totals), (lower, panels.gains)):
        label_ends(
            axes, [EndLabel(_label(name), float(band.mean[-1]), styles[name].colour) for name, band in lines.items()]
        )
    return figure


def _label(name: str, longest: int = _LONGEST_LABEL) -> str:
    """Return a variant's name as it stands in a figure: what is in the middle of a very long one is left out."""
    half = longest // 2
    return name if len(name) <= longest else f"{name[:half]} \N{HORIZONTAL ELLIPSIS} {name[-half:]}"


def _draw_line(axes: Axes, episodes: IntArray, band: Band, look: LineStyle, place: int) -> None:
    """Draw one variant's band and mean; `place` counts the lines before it."""
    every = max(band.mean.size // 8, 1)
    order = _MAIN if look.marker else _CONTROLS
    shade = 0.18 if look.marker else 0.09  # nine bands on one another: the controls' are paler
    axes.fill_between(episodes, band.low, band.high, color=look.colour, alpha=shade, linewidth=0, zorder=order - 0.5)
    marks = ((place * every // 3) % every, every)  # markers of close lines do not cover each other
    plot_line(axes, episodes, band.mean, look, markersize=5, markevery=marks, zorder=order)


def left_out(curves: tuple[Curve, ...]) -> str:
    """Return how many runs are left out, if any."""
    lost = sum(curve.n_diverged for curve in curves)
    return f" Left out because they diverged: {counted(lost, 'run')} of single variants." if lost else ""
