"""The figure of a comparison: how each variant's episodes went, and by how much they were better than the base's."""

from matplotlib.figure import Figure

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.panels import Panels, draw_panels, left_out
from tuckerl.reports.text import counted, measured
from tuckerl.studies.comparison_result import ComparisonResult
from tuckerl.studies.figure_text import FigureText


def _draw(result: ComparisonResult) -> Figure:
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


def _text(result: ComparisonResult) -> FigureText:
    return FigureText("compare", f"{result.measure.column.capitalize()} by episode")


def _caption(result: ComparisonResult) -> str:
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


def _alt(result: ComparisonResult) -> str:
    ends = ", ".join(f"{curve.variant} {measured(float(curve.band.mean[-1]))}" for curve in result.curves)
    return f"Two panels of curves by episode. {result.measure.column.capitalize()} at the end: {ends}."


COMPARISON = FigureSpec(ComparisonResult, _text, _draw, _caption, _alt)
