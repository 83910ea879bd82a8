"""A figure of the report: in how many runs each variant did not diverge."""

from matplotlib.figure import Figure

from tuckerl.reports.figure import FigureSpec
from tuckerl.studies.figure_text import FigureText
from tuckerl.studies.summary import Summary


def draw_run_bars(summary: Summary) -> Figure:
    """Draw a bar for each variant."""
    figure = Figure(figsize=(6.9, 2.5))
    axes = figure.add_axes((0.3, 0.2, 0.65, 0.75))
    axes.barh([curve.variant for curve in summary.curves], [curve.n_runs for curve in summary.curves], color="#0072B2")
    axes.set_xlabel("runs")
    return figure


def _text(summary: Summary) -> FigureText:
    return FigureText(f"runs-{summary.scenario.name}", "Runs that count")


def _caption(summary: Summary) -> str:
    return "In how many runs no table diverged."


def _alt(summary: Summary) -> str:
    return "A bar for each variant."


RUN_BARS = FigureSpec(Summary, _text, draw_run_bars, _caption, _alt)
