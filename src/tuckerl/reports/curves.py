"""The curves of a scenario's variants, cumulated as in Figures 9, 11 and 13, and those of a comparison by episode."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.interactive import plotly_panels
from tuckerl.reports.panels import Panels, draw_panels, left_out
from tuckerl.reports.text import counted, measured, whole
from tuckerl.studies.comparison_result import ComparisonResult
from tuckerl.studies.figure_text import CurveText, FigureText
from tuckerl.studies.summary import Summary


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
    words = (one.format(base=base, instances=instances) for one in (text.total, text.gain, text.summed))
    return CurveText(text.name, text.title, *words)


def panels_of(summary: Summary) -> Panels:
    """Return the panels of a scenario, cumulated over episodes."""
    measure, text = summary.measure, _text(summary)
    episode = np.arange(1, summary.curves[0].band.mean.size + 1)
    counts_steps = measure.column == "steps"
    return Panels(
        summary.scenario, episode, summary.curves, measure.larger_is_better, text.total, text.gain, counts_steps
    )


def _draw(summary: Summary) -> Figure:
    return draw_panels(panels_of(summary))


def _interactive(summary: Summary) -> dict[str, Any]:
    return plotly_panels(panels_of(summary))


def _caption(summary: Summary) -> str:
    runs, base = counted(summary.scenario.n_runs, "run"), summary.curves[0].variant
    return (
        f"Above: {_text(summary).summed}; mean of {runs}. Below: the same as a difference from {base}, taken run by "
        "run, so that more is better. Shaded: pointwise 95 % interval of the mean over runs (Student's t). The colour "
        "says how many agents there are; controls are dashed (constant weights) and dotted (permuted weights)."
        f"{left_out(summary.curves)}"
    )


def _alt(summary: Summary) -> str:
    column = summary.measure.column
    words = whole if column == "steps" else measured
    ends = ", ".join(f"{curve.variant} {words(float(curve.band.mean[-1]))}" for curve in summary.curves)
    return f"Two panels of curves by episode. {column.capitalize()} cumulated at the end: {ends}."


CURVES = FigureSpec(Summary, _text, _draw, _caption, _alt, interactive=_interactive)


def _compared_draw(result: ComparisonResult) -> Figure:
    """Draw each variant's learning curve above and its paired difference from the base below."""
    column, base = result.measure.column, result.curves[0].variant
    return draw_panels(
        Panels(
            result.study.scenario,
            result.episode,
            result.curves,
            result.measure.larger_is_better,
            f"{column} of an episode",
            f"better than {base} by ({column})",
            counts_steps=False,
        )
    )


def _compared_text(result: ComparisonResult) -> FigureText:
    return FigureText("compare", f"{result.measure.column.capitalize()} by episode")


def _compared_caption(result: ComparisonResult) -> str:
    config, base = result.study.config, result.curves[0].variant
    per_point = int(result.episode[0])
    rest = " (the last, of what is left)" if config.n_episodes % per_point else ""
    points = f" Each point is the mean of {per_point} episodes{rest}." if per_point > 1 else ""
    band = (
        "Shaded: pointwise 95 % interval of the mean over runs (Student's t)."
        if config.n_runs > 1
        else "One run has no interval."
    )
    control = " The control, with constant weights, is dashed." if result.study.comparison.control else ""
    return (
        f"Above: {result.measure.column} of an episode while learning goes on, averaged over a variant's agents; mean "
        f"of {counted(config.n_runs, 'run')}.{points} Below: the same as a difference from {base}, taken run by run, "
        f"so that more is better. {band}{control}{left_out(result.curves)}"
    )


def _compared_alt(result: ComparisonResult) -> str:
    ends = ", ".join(f"{curve.variant} {measured(float(curve.band.mean[-1]))}" for curve in result.curves)
    return f"Two panels of curves by episode. {result.measure.column.capitalize()} at the end: {ends}."


COMPARISON = FigureSpec(ComparisonResult, _compared_text, _compared_draw, _compared_caption, _compared_alt)
