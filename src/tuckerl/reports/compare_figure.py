"""The figure of a comparison: how each variant's episodes went, and by how much they were better than the base's."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports import text as wording
from tuckerl.reports.compare_text import QUANTITIES
from tuckerl.reports.curves import Line, draw_line
from tuckerl.reports.picture import Shown, render
from tuckerl.reports.styles import EndLabel, LineStyle, label_ends, line_styles
from tuckerl.studies.compared import ComparisonResult
from tuckerl.studies.statistics import MEASURES, Band
from tuckerl.studies.summary import Curve

NAME = "compare"


def show_compared(compared: ComparisonResult) -> Shown:
    """Draw a comparison."""
    return Shown(
        NAME,
        f"{_quantity(compared).capitalize()} by episode",
        _caption(compared),
        _alt(compared),
        render(lambda: draw_compared(compared)),
    )


def draw_compared(compared: ComparisonResult) -> Figure:
    """Draw each variant's learning curve above and its paired difference from the base below, with 95 % bands."""
    figure = Figure(figsize=(6.9, 6.0))
    upper, lower = figure.subplots(
        2, sharex=True, gridspec_kw={"left": 0.115, "right": 0.78, "top": 0.985, "bottom": 0.07, "hspace": 0.09}
    )
    styles = line_styles(compared.contest.scenario)
    base, *others = compared.curves
    courses = [Line(curve.variant, curve.band) for curve in compared.curves]
    gains = [Line(curve.variant, _in_favour(compared, curve)) for curve in others]
    for axes, lines in ((upper, courses), (lower, gains)):
        for place, line in enumerate(lines):
            draw_line(axes, compared.episode, line.band, styles[line.variant], place)
        axes.margins(y=0.04)
    lower.axhline(0, color=styles[base.variant].colour, linewidth=styles[base.variant].width, zorder=2)
    upper.set_xlim(0, int(compared.episode[-1]))
    upper.set_ylabel(f"{_quantity(compared)} of an episode")
    lower.set_ylabel(f"better than {base.variant} by ({_quantity(compared)})", parse_math=False)
    lower.set_xlabel("episodes")
    lower.xaxis.set_major_locator(MaxNLocator(integer=True))
    flat = Line(base.variant, Band(*(np.zeros(compared.episode.size),) * 3))
    label_ends(upper, [_end(line, styles) for line in courses])
    label_ends(lower, [_end(line, styles) for line in [flat, *gains]])
    return figure


def _in_favour(compared: ComparisonResult, curve: Curve) -> Band:
    band = curve.against_base
    if MEASURES[compared.contest.request.measure].larger_is_better:
        return band
    return Band(-band.mean, -band.high, -band.low)


def _end(line: Line, styles: dict[str, LineStyle]) -> EndLabel:
    return EndLabel(line.variant, float(line.band.mean[-1]), styles[line.variant].colour)


def _quantity(compared: ComparisonResult) -> str:
    return QUANTITIES[compared.contest.request.measure]


def _caption(compared: ComparisonResult) -> str:
    request, base = compared.contest.request, compared.curves[0].variant
    per_point = int(compared.episode[0])
    rest = " (the last, of what is left)" if request.n_episodes % per_point else ""
    points = f" Each point is the mean of {per_point} episodes{rest}." if per_point > 1 else ""
    lost = sum(curve.n_diverged for curve in compared.curves)
    out = f" Left out because they diverged: {wording.counted(lost, 'run')} of single variants." if lost else ""
    band = (
        "Shaded: pointwise 95 % interval of the mean over runs (Student's t)."
        if request.n_runs > 1
        else "One run has no interval."
    )
    control = " The control, with constant weights, is dashed." if compared.contest.comparison.control else ""
    return (
        f"Above: {_quantity(compared)} of an episode while learning goes on, averaged over a variant's agents; mean of "
        f"{wording.counted(request.n_runs, 'run')}.{points} Below: the same as a difference from {base}, taken run by "
        f"run, so that more is better. {band}{control}{out}"
    )


def _alt(compared: ComparisonResult) -> str:
    ends = ", ".join(f"{curve.variant} {wording.measured(float(curve.band.mean[-1]))}" for curve in compared.curves)
    return f"Two panels of curves by episode. {_quantity(compared).capitalize()} at the end: {ends}."
