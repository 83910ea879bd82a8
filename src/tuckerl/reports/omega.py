"""Action weights (omega) over time."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.picture import Picture
from tuckerl.reports.styles import BLUE, GREEN, PURPLE, VERMILLION, EndLabel, LineStyle, label_ends
from tuckerl.reports.text import counted
from tuckerl.studies.summary import Summary, WeightCourse

# As in problems/maze.py. The first and third come to lie on one another, so they differ in width as well.
_ACTIONS = {
    "up": LineStyle(BLUE, "solid", "o", 2.4),
    "down": LineStyle(VERMILLION, "solid", "s", 1.5),
    "left": LineStyle(GREEN, "dashed", "^", 1.4),
    "right": LineStyle(PURPLE, "solid", "D", 1.5),
}


def draw_omega_dyna_maze(summary: Summary) -> Figure:
    """Draw the mean action weights of the T-versions whose paths are shown after each window, with 95 % bands."""
    courses = shown_courses(summary)
    figure = Figure(figsize=(7.2, 3.0))
    if not courses:
        figure.text(0.5, 0.5, "no window was finished: there are no weights to show", horizontalalignment="center")
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
        ends = zip(_ACTIONS.items(), course.bands, strict=False)
        labels = [EndLabel(action, float(band.mean[-1]), look.colour) for (action, look), band in ends]
        label_ends(axes, labels)
    return figure


def shown_courses(summary: Summary) -> list[WeightCourse]:
    """Return the courses of the variants whose paths are shown that have any window."""
    record_paths_of = summary.scenario.record_paths_of
    return [course for course in summary.weights if course.variant in record_paths_of and course.episode.size]


def _draw_course(axes: Axes, course: WeightCourse) -> None:
    for look, band in zip(_ACTIONS.values(), course.bands, strict=False):
        axes.fill_between(course.episode, band.low, band.high, color=look.colour, alpha=0.2, linewidth=0)
        axes.plot(
            course.episode,
            band.mean,
            color=look.colour,
            linestyle=look.dash,
            linewidth=look.width,
            marker=look.marker,
            markersize=2 + 2 * look.width,
            markeredgecolor="white",
            markeredgewidth=0.6,
            clip_on=False,
        )
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
    ranks = [v.tensor_step.ranks[1] for v in scenario.variants if v.name == courses[0].variant and v.tensor_step]
    limit = (
        f" With {ranks[0]} columns for the actions no weight can exceed 1/√{ranks[0]} = {1 / math.sqrt(ranks[0]):.3f}."
        if ranks and ranks[0] < n_actions
        else ""
    )
    return (
        "What the learning rate is multiplied by for each action, as set by the tensor step after each window; "
        f"mean over {runs} (of all mazes), shaded its pointwise 95 % interval. During the first window every "
        "weight is 1. Squares of the weights sum to 1: their root mean square is always that of the constant "
        f"control, 1/√{n_actions}.{limit}"
    )


def _alt(summary: Summary) -> str:
    courses = "; ".join(
        f"{course.variant}: "
        + ", ".join(f"{name} {band.mean[-1]:.2f}" for name, band in zip(_ACTIONS, course.bands, strict=False))
        for course in shown_courses(summary)
    )
    return f"Curves of each action's weight by episode. After the last window, {courses or 'none'}."


OMEGA_DYNA_MAZE = Picture(
    "omega-dyna-maze",
    "dyna-maze",
    "Action weights over time",
    draw_omega_dyna_maze,
    _caption,
    _alt,
)
