"""Action weights (omega) over time: a line for each of a few actions, a map and the last window for many."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.styles import ACTION_STYLES, BLACK, EndLabel, count_episodes, label_ends, plot_line
from tuckerl.reports.text import counted
from tuckerl.studies.figure_text import WeightText
from tuckerl.studies.summary import Summary, WeightCourse
from tuckerl.tensor.ranks import numbers_or_share

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
    count_episodes(axes, int(np.max(course.episode)))
    axes.set_title(course.variant, loc="left", fontweight="bold", parse_math=False)
    axes.margins(y=0.1)


def _lines_caption(summary: Summary) -> str:
    courses = shown_courses(summary)
    if not courses:
        return "No window of episodes was finished, so the tensor step never set a weight."
    n_actions = len(courses[0].bands)
    scenario = summary.scenario
    runs = counted(scenario.n_runs * scenario.n_instances, "run")
    of_all = f" (of all {scenario.instance}s)" if scenario.n_instances > 1 else ""
    steps = [v.tensor_step for v in scenario.variants if v.name == courses[0].variant and v.tensor_step]
    asked = [numbers_or_share(step.ranks) for step in steps if step.ranks is not None]
    ranks = [one[1] for one in asked if isinstance(one, tuple)]  # the others have as many as a window needs
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


def _lines_alt(summary: Summary) -> str:
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
    _lines_caption,
    _lines_alt,
    applies=lambda one: one.scenario.algorithm.n_actions <= len(ACTION_STYLES),
)


COLOURS = "cividis"  # lightness grows evenly with the number: the same order in grey and for the colour-blind


def draw_weight_map(summary: Summary) -> Figure:
    """Draw the mean weight of each action (down) after each window (across), and the last window with intervals."""
    course, text = shown_course(summary), weight_text(summary)
    figure = Figure(figsize=(7.2, 0.95 + 0.155 * len(text.actions)))
    if course is None:
        figure.text(0.5, 0.5, NO_WEIGHTS, horizontalalignment="center")
        return figure
    height = figure.get_size_inches()[1]
    grid = figure.add_gridspec(
        1, 2, width_ratios=(2.3, 1), left=0.135, right=0.985, top=1 - 0.28 / height, bottom=0.47 / height, wspace=0.34
    )
    over_time = figure.add_subplot(grid[0, 0])
    _draw_map(figure, over_time, course)
    last = figure.add_subplot(grid[0, 1], sharey=over_time)
    _draw_last(last, course)
    over_time.set_yticks(range(len(text.actions)), text.actions)
    over_time.set_ylabel(text.axis)
    over_time.set_title(course.variant, loc="left", fontweight="bold", parse_math=False)
    last.set_title("after the last window", loc="left")
    return figure


def shown_course(summary: Summary) -> WeightCourse | None:
    """Return the course of the T-version with one agent, if it finished any window."""
    name = f"{summary.scenario.algorithm.t_version}-1"
    found = [course for course in summary.weights if course.variant == name and course.episode.size]
    return found[0] if found else None


def _draw_map(figure: Figure, axes: Axes, course: WeightCourse) -> None:
    means = np.array([band.mean for band in course.bands])
    edges = np.append(0, course.episode)  # a column spans the window that its weights were worked out from
    mesh = axes.pcolormesh(
        edges, np.arange(means.shape[0] + 1) - 0.5, means, cmap=COLOURS, edgecolors="face", linewidth=0.4
    )
    axes.set_facecolor("0.85")  # where no run is left
    axes.set_ylim(means.shape[0] - 0.5, -0.5)
    count_episodes(axes, int(course.episode[-1]))
    axes.tick_params(axis="y", length=0)
    bar = figure.colorbar(mesh, ax=axes, pad=0.02, fraction=0.06, aspect=35)
    bar.ax.set_title("mean ω", fontsize=8, pad=4)
    bar.outline.set_visible(False)


def _draw_last(axes: Axes, course: WeightCourse) -> None:
    ends = np.array([[float(values[-1]) for values in band] for band in course.bands])  # mean, low, high
    places = np.arange(ends.shape[0])
    axes.hlines(places, ends[:, 1], ends[:, 2], color=BLACK, linewidth=1.1)
    axes.plot(ends[:, 0], places, linestyle="none", marker="o", markersize=3.5, color=BLACK)
    axes.axvline(1 / math.sqrt(ends.shape[0]), color="0.3", linewidth=1, linestyle="dotted", zorder=1)
    axes.set_xlim(left=0)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("ω, mean and 95 % interval", fontsize=8)
    axes.tick_params(axis="y", length=0, labelleft=False)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="y", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)


def _map_caption(summary: Summary) -> str:
    course = shown_course(summary)
    if course is None:
        return "No window of episodes was finished, so the tensor step never set a weight."
    n_actions = len(course.bands)
    runs = counted(summary.scenario.n_runs * summary.scenario.n_instances, "run")
    return (
        f"What the learning rate is multiplied by for each action: the mean over {runs} (those that did not diverge); "
        "lighter is more. Left: a column spans a window of episodes and shows the weights that the tensor step set at "
        "its end and that hold during the next; during the first window every weight is 1. Right: the weights after "
        "the last window, with the 95 % interval of the mean (Student's t); dotted, the constant control, "
        f"1/√{n_actions} = {1 / math.sqrt(n_actions):.3g}, which is always the weights' root mean square."
    )


def _map_alt(summary: Summary) -> str:
    course, names = shown_course(summary), weight_text(summary).actions
    if course is None:
        return "No weights to show."
    ends = [(float(band.mean[-1]), name) for band, name in zip(course.bands, names, strict=True)]
    finite = [end for end in ends if not math.isnan(end[0])]
    if not finite:
        return "A map of the weights by action and episode; no run is left."
    (low, least), (high, most) = min(finite), max(finite)
    return (
        f"A map of {course.variant}'s weights by action and episode. After the last window the mean weights go from "
        f"{low:.3g} ({least}) to {high:.3g} ({most})."
    )


WEIGHT_MAP = FigureSpec(
    Summary,
    weight_text,
    draw_weight_map,
    _map_caption,
    _map_alt,
    applies=lambda one: one.scenario.algorithm.n_actions > len(ACTION_STYLES),
)
