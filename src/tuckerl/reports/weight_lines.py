"""Action weights (omega) over time where there are few enough actions for a line each."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.styles import ACTION_STYLES, EndLabel, label_ends, plot_line
from tuckerl.reports.text import counted
from tuckerl.studies.figure_text import WeightText
from tuckerl.studies.summary import Summary, WeightCourse

NO_WEIGHTS = "no window was finished: there are no weights to show"
_MOST_PANELS = 3


def weight_text(summary: Summary) -> WeightText:
    """Return the words of a scenario's weights."""
    scenario = summary.scenario
    numbers = tuple(str(action) for action in range(scenario.algorithm.n_actions))
    return scenario.text_of(
        WeightText(f"omega-{scenario.name}", f"{scenario.title}: action weights over time", numbers)
    )


def draw_weight_lines(summary: Summary) -> Figure:
    """Draw the mean action weights of the T-versions as the paper has them after each window, with 95 % bands."""
    courses, actions = shown_courses(summary), weight_text(summary).actions
    figure = Figure(figsize=(7.2, 3.0))
    if not courses:
        figure.text(0.5, 0.5, NO_WEIGHTS, horizontalalignment="center")
        return figure
    panels = figure.subplots(
        1,
        len(courses),
        sharey=True,
        squeeze=False,
        gridspec_kw={"left": 0.085, "right": 0.93, "top": 0.91, "bottom": 0.15, "wspace": 0.24},
    )[0]
    for axes, course in zip(panels, courses, strict=True):
        _draw_course(axes, course)
    panels[0].set_ylabel("action weight ω (no unit)")
    for axes, course in zip(panels, courses, strict=True):
        ends = zip(actions, ACTION_STYLES, course.bands, strict=False)
        label_ends(axes, [EndLabel(action, float(band.mean[-1]), look.colour) for action, look, band in ends])
    return figure


def shown_courses(summary: Summary) -> list[WeightCourse]:
    """Return the courses of the first T-versions with the paper's share that finished any window."""
    t_version = summary.scenario.algorithm.t_version
    shown = [c for c in summary.weights if c.variant.removeprefix(f"{t_version}-").isdigit() and c.episode.size]
    return shown[:_MOST_PANELS]


def _draw_course(axes: Axes, course: WeightCourse) -> None:
    for look, band in zip(ACTION_STYLES, course.bands, strict=False):
        axes.fill_between(course.episode, band.low, band.high, color=look.colour, alpha=0.2, linewidth=0)
        plot_line(axes, course.episode, band.mean, look, markersize=2 + 2 * look.width, clip_on=False)
    n_actions = len(course.bands)
    level = 1 / math.sqrt(n_actions)
    axes.axhline(level, color="0.3", linewidth=1, linestyle="dotted", zorder=1)
    axes.annotate(
        f"constant control, 1/√{n_actions} = {level:.3g}",
        (0.03, level),
        xytext=(0, 2),
        textcoords="offset points",
        xycoords=axes.get_yaxis_transform(),
        color="0.3",
        fontsize=8,
    )
    axes.set_xlim(0, int(np.max(course.episode)))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("episodes finished")
    axes.set_title(course.variant, loc="left", fontweight="bold", parse_math=False)
    axes.margins(y=0.1)


def _caption(summary: Summary) -> str:
    courses = shown_courses(summary)
    if not courses:
        return "No window of episodes was finished, so the tensor step never set a weight."
    n_actions = len(courses[0].bands)
    scenario = summary.scenario
    runs = counted(scenario.n_runs * scenario.n_instances, "run")
    of_all = f" (of all {scenario.instance}s)" if scenario.n_instances > 1 else ""
    ranks = [v.tensor_step.ranks[1] for v in scenario.variants if v.name == courses[0].variant and v.tensor_step]
    limit = (
        f" With {ranks[0]} columns for the actions no weight can exceed 1/√{ranks[0]} = {1 / math.sqrt(ranks[0]):.3f}."
        if ranks and ranks[0] < n_actions
        else ""
    )
    return (
        "What the learning rate is multiplied by for each action, as set by the tensor step after each window; "
        f"mean over {runs}{of_all}, shaded its pointwise 95 % interval. During the first window every "
        "weight is 1. Squares of the weights sum to 1: their root mean square is always that of the constant "
        f"control, 1/√{n_actions}.{limit}"
    )


def _alt(summary: Summary) -> str:
    actions = weight_text(summary).actions
    courses = "; ".join(
        f"{course.variant}: "
        + ", ".join(f"{name} {band.mean[-1]:.2f}" for name, band in zip(actions, course.bands, strict=False))
        for course in shown_courses(summary)
    )
    return f"Curves of each action's weight by episode. After the last window, {courses or 'none'}."


WEIGHT_LINES = FigureSpec(
    Summary,
    weight_text,
    draw_weight_lines,
    _caption,
    _alt,
    applies=lambda one: one.scenario.algorithm.n_actions <= len(ACTION_STYLES),
)
