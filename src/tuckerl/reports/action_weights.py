"""Action weights (omega) over time, of a study's runs or of one agent: lines of a few actions, a map of many."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.live_weights import live_weights, weight_columns
from tuckerl.reports.styles import ACTION_STYLES, BLACK, EndLabel, LineStyle, count_episodes, label_ends, plot_line
from tuckerl.reports.text import counted, number
from tuckerl.studies.figure_text import WeightText
from tuckerl.studies.summary import Summary
from tuckerl.tensor.ranks import numbers_or_share
from tuckerl.types import FloatArray, IntArray

NO_WEIGHTS = "no window was finished: there are no weights to show"
COLOURS = "cividis"  # lightness grows evenly with the number: the same order in grey and for the colour-blind

_NOTHING = "No window of episodes was finished, so the tensor step never set a weight."
MEANING = "What the learning rate is multiplied by for each action"
_MOST_PANELS = 3
_MARKERS = 12  # of a line
_ROW, _HIGHEST = 0.155, 8.0  # inches of an action in a map, and of the map


class Course(NamedTuple):
    """The weights of A actions after each of W windows, with or without an interval."""

    title: str
    episode: IntArray  # (W,) finished by then
    mean: FloatArray  # (W, A)
    low: FloatArray | None = None  # (W, A)
    high: FloatArray | None = None


def draw_courses(courses: Sequence[Course], actions: Sequence[str], axis: str = "action") -> Figure:
    """Draw weights over time: a panel of lines for each course, or a map of the first one where actions are many."""
    if not courses:
        figure = Figure(figsize=(WIDTH, 1.0))
        figure.text(0.5, 0.5, NO_WEIGHTS, horizontalalignment="center")
        return figure
    return _draw_lines(courses, actions) if len(actions) <= len(ACTION_STYLES) else _draw_map(courses[0], actions, axis)


def _draw_lines(courses: Sequence[Course], actions: Sequence[str]) -> Figure:
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    panels = figure.subplots(1, len(courses), sharey=True, squeeze=False)[0]
    level = _level(len(actions))
    for axes, course in zip(panels, courses, strict=True):
        for action, (look, values) in enumerate(zip(ACTION_STYLES, course.mean.T, strict=False)):
            if course.low is not None and course.high is not None:
                band = (course.low[:, action], course.high[:, action])
                axes.fill_between(course.episode, *band, color=look.colour, alpha=0.2, linewidth=0)
            draw_course(axes, course.episode, values, look, action / len(actions))
        axes.axhline(level, color="0.3", linewidth=1, linestyle="dotted", zorder=1)
        count_episodes(axes, int(course.episode.max()), 10 // len(courses))
        axes.set_title(course.title, loc="left", fontweight="bold", parse_math=False)
        axes.margins(y=0.1)
    panels[0].set_ylabel("action weight ω (no unit)")
    for axes, course in zip(panels, courses, strict=True):
        ends = zip(actions, course.mean[-1], ACTION_STYLES, strict=False)
        labels = [EndLabel(name, float(value), look.colour) for name, value, look in ends]
        label_ends(axes, [*labels, EndLabel("constant", level, "0.3")])
    return figure


def draw_course(axes: Axes, episode: IntArray, values: FloatArray, look: LineStyle, shift: float = 0.0) -> None:
    """Draw what a number was after each window, with a few markers, `shift` of their distance to the right."""
    apart = max(1, len(episode) // _MARKERS)
    marks = (int(shift * apart), apart)
    plot_line(axes, episode, values, look, markersize=2.5 + 1.5 * look.width, markevery=marks, clip_on=False)


def _draw_map(course: Course, actions: Sequence[str], axis: str) -> Figure:
    figure = Figure(figsize=(WIDTH, min(_HIGHEST, max(1.2, _ROW * len(actions))) + 0.95), layout="constrained")
    if course.low is None or course.high is None:
        over_time = figure.subplots()
    else:
        over_time, last = figure.subplots(1, 2, sharey=True, width_ratios=(2.3, 1))
        _draw_last(last, course.mean[-1], course.low[-1], course.high[-1])
    edges = np.append(0, course.episode)  # a column spans the window that its weights were worked out from
    rows = np.arange(len(actions) + 1) - 0.5
    mesh = over_time.pcolormesh(edges, rows, course.mean.T, cmap=COLOURS, edgecolors="face", linewidth=0.4)
    over_time.set_facecolor("0.85")  # where no run is left
    over_time.set_ylim(len(actions) - 0.5, -0.5)
    count_episodes(over_time, int(course.episode[-1]))
    every = -(-len(actions) * 0.155 // _HIGHEST)
    over_time.set_yticks(range(0, len(actions), int(every)), actions[:: int(every)], parse_math=False)
    over_time.tick_params(axis="y", length=0)
    over_time.set_ylabel(axis)
    over_time.set_title(course.title, loc="left", fontweight="bold", parse_math=False)
    bar = figure.colorbar(mesh, ax=over_time, pad=0.02, fraction=0.06, aspect=35, label="action weight ω (no unit)")
    bar.outline.set_visible(False)
    return figure


def _draw_last(axes: Axes, mean: FloatArray, low: FloatArray, high: FloatArray) -> None:
    places = np.arange(mean.size)
    axes.hlines(places, low, high, color=BLACK, linewidth=1.1)
    axes.plot(mean, places, linestyle="none", marker="o", markersize=3.5, color=BLACK)
    axes.axvline(_level(mean.size), color="0.3", linewidth=1, linestyle="dotted", zorder=1)
    axes.set_xlim(left=0)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("ω, mean and 95 % interval", fontsize=8)
    axes.tick_params(axis="y", length=0, labelleft=False)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="y", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_title("after the last window", loc="left")


def _level(n_actions: int) -> float:
    return 1 / math.sqrt(n_actions)


def constant_words(n_actions: int) -> str:
    """Return the constant control's weight, as it is made and as a number."""
    return f"1/√{n_actions} = {_level(n_actions):.3g}"


def weight_text(summary: Summary) -> WeightText:
    """Return the words of a scenario's weights."""
    scenario = summary.scenario
    numbers = tuple(str(action) for action in range(scenario.algorithm.n_actions))
    return scenario.text_of(
        WeightText(f"omega-{scenario.name}", f"{scenario.title}: action weights over time", numbers)
    )


def courses_of(summary: Summary) -> list[Course]:
    """Return the mean weights of the first T-versions with the paper's share that finished any window.

    Where actions are many: of the one with one agent.
    """
    algorithm = summary.scenario.algorithm
    few = algorithm.n_actions <= len(ACTION_STYLES)
    wanted = [f"{algorithm.t_version}-{count}" for count in (range(1, 100) if few else (1,))]
    shown = [one for one in summary.weights if one.variant in wanted and one.episode.size]
    return [
        Course(one.variant, one.episode, *(np.column_stack(values) for values in zip(*one.bands, strict=True)))
        for one in shown[:_MOST_PANELS]
    ]


def _draw(summary: Summary) -> Figure:
    text = weight_text(summary)
    return draw_courses(courses_of(summary), text.actions, text.axis)


def _caption(summary: Summary) -> str:
    courses, scenario = courses_of(summary), summary.scenario
    if not courses:
        return _NOTHING
    n_actions = courses[0].mean.shape[1]
    of_all = f" (of all {scenario.instance}s)" if scenario.n_instances > 1 else ""
    runs = (
        f"the mean over {counted(scenario.n_runs * scenario.n_instances, 'run')}{of_all} (those that did not diverge)"
    )
    if n_actions > len(ACTION_STYLES):
        return (
            f"{MEANING}: {runs}; lighter is more. Left: a column spans a window of episodes and shows the weights "
            "that the tensor step set at its end and that hold during the next; in the first window every weight is 1. "
            "Right: the weights after the last window, with the 95 % interval of the mean (Student's t); dotted, the "
            f"constant control, {constant_words(n_actions)}, which is always the weights' root mean square."
        )
    steps = [v.tensor_step for v in scenario.variants if v.name == courses[0].title and v.tensor_step]
    asked = [numbers_or_share(step.ranks) for step in steps if step.ranks is not None]
    ranks = [one[1] for one in asked if isinstance(one, tuple) and one[1] < n_actions]  # others: what a window needs
    limit = [
        f" With {rank} columns for the actions no weight can exceed 1/√{rank} = {_level(rank):.3f}." for rank in ranks
    ]
    return (
        f"{MEANING}, as set by the tensor step after each window: {runs}, shaded its pointwise 95 % interval. During "
        "the first window every weight is 1. Squares of the weights sum to 1: their root mean square is always that of "
        f"the constant control, dotted, {constant_words(n_actions)}.{''.join(limit[:1])}"
    )


def _alt(summary: Summary) -> str:
    courses = courses_of(summary)
    if not courses:
        return "No weights to show."
    kind = "Curves of each action's weight" if len(courses[0].mean.T) <= len(ACTION_STYLES) else "A map of weights"
    ends = "; ".join(ends_words(course, weight_text(summary).actions) for course in courses)
    return f"{kind} by episode. After the last window, largest first: {ends}."


def ends_words(course: Course, actions: Sequence[str], most: int = 6) -> str:
    """Return the weights after the last window, the largest first; of very many, the largest and the least."""
    last = course.mean[-1]
    order = [action for action in np.argsort(-last, kind="stable") if np.isfinite(last[action])]
    listed = order if len(order) <= most else [*order[: most - 1], order[-1]]
    named = [f"{actions[action]} {number(float(last[action]))}" for action in listed]
    if len(order) > most:
        named.insert(-1, f"{len(order) - most} between")
    return f"{course.title}{': ' if course.title else ''}{', '.join(named) or 'no run is left'}"


WEIGHTS = FigureSpec(
    Summary,
    weight_text,
    _draw,
    _caption,
    _alt,
    columns=lambda summary: weight_columns(summary, weight_text(summary)),
    live=lambda summary: live_weights(summary, weight_text(summary)),
)
