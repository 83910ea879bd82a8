"""The curves of a scenario's variants, cumulated as in Figures 9, 11 and 13, and those of a comparison by episode."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from tuckerl.reports.figure import Columns, FigureSpec, Live
from tuckerl.reports.lines import MOST_NUMBERS, curve_columns, live_curves
from tuckerl.reports.panels import Panels, draw_panels, left_out
from tuckerl.reports.text import counted, measured, whole
from tuckerl.studies.comparison_result import ComparisonResult
from tuckerl.studies.figure_text import CurveText, FigureText
from tuckerl.studies.statistics import Measure
from tuckerl.studies.study import Scenario
from tuckerl.studies.study_result import ProblemResult
from tuckerl.studies.summary import Curve, Summary
from tuckerl.types import IntArray


def _text(summary: Summary) -> CurveText:
    """Return the words of a scenario's curves: its own, or else by what is measured."""
    scenario, measure = summary.scenario, summary.measure
    column, several = measure.column, scenario.n_instances > 1
    default = CurveText(
        f"curves-{scenario.name}",
        f"{scenario.title}: learning curves",
        total=f"cumulative {column}",
        gain=f"{column} {'more' if measure.larger_is_better else 'less'} than {{base}}",
        summed=f"{column}, averaged over a variant's agents{', summed over {instances}' if several else ''} and "
        "cumulated over episodes",
    )
    text = scenario.text_of(default)
    base, instances = scenario.variants[0].name, counted(scenario.n_instances, scenario.instance)
    total, summed = (one.format(base=base, instances=instances) for one in (text.total, text.summed))
    return CurveText(text.name, text.title, total, text.gain.replace("{instances}", instances), summed)


def panels_of(summary: Summary) -> Panels:
    """Return the panels of a scenario, cumulated over episodes."""
    measure, text = summary.measure, _text(summary)
    episode = np.arange(1, summary.curves[0].band.mean.size + 1)
    counts_steps = measure.column == "steps"
    how = (measure.larger_is_better, text.total, text.gain, counts_steps)
    return Panels(summary.scenario, episode, summary.curves, *how, is_cumulated=True)


def _draw(summary: Summary) -> Figure:
    return draw_panels(panels_of(summary))


def _caption(summary: Summary) -> str:
    runs, base = counted(summary.scenario.n_runs, "run"), summary.curves[0].variant
    return (
        f"Above: {_text(summary).summed}; mean of {runs}. Below: the same as a difference from {base}, taken run by "
        "run, so that more is better. Shaded: pointwise 95 % interval of the mean over runs (Student's t). A colour "
        "stands for a number of agents and what they copy; controls are dashed (constant weights) and dotted "
        "(permuted weights)."
        f"{left_out(summary.curves)}"
    )


def _alt(summary: Summary) -> str:
    column = summary.measure.column
    words = whole if column == "steps" else measured
    ends = ", ".join(f"{curve.variant} {words(float(curve.band.mean[-1]))}" for curve in summary.curves)
    return f"Two panels of curves by episode. {column.capitalize()} cumulated at the end: {ends}."


def _live(summary: Summary) -> Live:
    return live_curves(panels_of(summary), _text(summary).title)


def _columns(summary: Summary) -> Columns:
    return curve_columns(panels_of(summary))


CURVES = FigureSpec(Summary, _text, _draw, _caption, _alt, columns=_columns, live=_live)


class _ByEpisode(NamedTuple):
    """What is measured in an episode while learning goes on, of all variants on a problem or of some."""

    scenario: Scenario
    measure: Measure
    episode: IntArray
    curves: tuple[Curve, ...]

    @property
    def panels(self) -> Panels:
        """Each variant's learning curve above and its paired difference from the base below."""
        column = self.measure.column
        shown = {curve.variant for curve in self.curves}
        variants = tuple(variant for variant in self.scenario.variants if variant.name in shown)
        return Panels(
            replace(self.scenario, variants=variants),
            self.episode,
            self.curves,
            self.measure.larger_is_better,
            f"{column} of an episode",
            f"better than {{base}} by ({column})",
            counts_steps=False,
        )

    @property
    def caption(self) -> str:
        """What it shows."""
        n_episodes, base, per_point = self.scenario.n_episodes, self.curves[0].variant, int(self.episode[0])
        rest = " (the last, of what is left)" if n_episodes % per_point else ""
        points = f" Each point is the mean of {per_point} episodes{rest}." if per_point > 1 else ""
        n_runs = max(curve.n_runs + curve.n_diverged for curve in self.curves)
        band = (
            "Shaded: pointwise 95 % interval of the mean over runs (Student's t)."
            if n_runs > 1
            else "One run has no interval."
        )
        controls = {one.control for one in self.scenario.comparisons} & {curve.variant for curve in self.curves}
        dashed = "control, with constant weights, is" if len(controls) == 1 else "controls, with constant weights, are"
        control = f" The {dashed} dashed." if controls else ""
        n_variants = len(self.scenario.variants)
        some = f" Of {n_variants:,} variants, {base} and the best." if len(self.curves) < n_variants else ""
        is_shared = any(one.n_episodes is not None for one in self.scenario.variants)
        shared = " The axis counts the episodes of all agents together." if is_shared else ""
        return (
            f"Above: {self.measure.column} of an episode while learning goes on, averaged over a variant's agents; "
            f"mean of {counted(n_runs, 'run')}.{points} Below: the same as a difference from {base}, taken run by run, "
            f"so that more is better. {band}{control}{some}{shared}{left_out(self.curves)}"
        )

    @property
    def alt(self) -> str:
        """What it shows, for those who cannot see it."""
        ends = ", ".join(f"{curve.variant} {measured(float(curve.band.mean[-1]))}" for curve in self.curves)
        return f"Two panels of curves by episode. {self.measure.column.capitalize()} at the end: {ends}."


def _of_comparison(result: ComparisonResult) -> _ByEpisode:
    return _ByEpisode(result.study.scenario, result.measure, result.episode, result.curves)


def _of_problem(result: ProblemResult) -> _ByEpisode:
    return _ByEpisode(result.scenario, result.measure, *result.curves)


COMPARISON = FigureSpec(
    ComparisonResult,
    lambda result: FigureText("compare", f"{result.measure.column.capitalize()} by episode"),
    lambda result: draw_panels(_of_comparison(result).panels),
    lambda result: _of_comparison(result).caption,
    lambda result: _of_comparison(result).alt,
    columns=lambda result: curve_columns(_of_comparison(result).panels),
    live=lambda result: live_curves(_of_comparison(result).panels, result.study.scenario.title),
)

PROBLEM = FigureSpec(
    ProblemResult,
    lambda result: FigureText(f"curves-{result.place + 1}", f"{result.measure.column.capitalize()} by episode"),
    lambda result: draw_panels(_of_problem(result).panels),
    lambda result: _of_problem(result).caption,
    lambda result: _of_problem(result).alt,
    applies=lambda result: bool(result.curves.curves),
    columns=lambda result: curve_columns(_of_problem(result).panels),
    live=lambda result: live_curves(
        _of_problem(result).panels, result.scenario.name, MOST_NUMBERS // result.n_problems
    ),
)
