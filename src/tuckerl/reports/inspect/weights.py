"""The action weights (omega) that the tensor step set after each window."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tuckerl.generalization.step import TensorStepHistory
from tuckerl.reports.figure import WIDTH, FigureSpec, panel_figure
from tuckerl.reports.inspect.cells import colour_bar, draw_table, scale
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.styles import ACTION_STYLES, EndLabel, LineStyle, count_episodes, label_ends, plot_line
from tuckerl.reports.text import counted, number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

MOST_DRAWN = 1000
"""So many windows are drawn; of more, every second, third, ..."""

_CONSTANT = "constant"
_MARKERS = 12  # of a line
_ROW = 0.155


def draw_weights(inspection: Inspection) -> Figure:
    """Draw a line for each of a few actions, a map for many."""
    return _draw_lines(inspection) if inspection.n_actions <= len(ACTION_STYLES) else _draw_map(inspection)


def _draw_lines(inspection: Inspection) -> Figure:
    history = drawn_windows(inspection.history)
    level = 1 / math.sqrt(inspection.n_actions)
    longest = max(len(name) for name in (*inspection.action_names, _CONSTANT))
    beside = min(0.35 + 0.075 * longest, 2.2)
    figure, axes = panel_figure(0.62, 0.46, WIDTH - 0.62 - beside, 2.2, 0.24)
    for place, (look, values) in enumerate(zip(ACTION_STYLES, history.weights.T, strict=False)):
        draw_course(axes, history.episode, values, look, place / inspection.n_actions)
    axes.axhline(level, color="0.3", linewidth=1, linestyle="dotted", zorder=1)
    axes.margins(y=0.1)
    count_episodes(axes, int(history.episode.max()))
    axes.set_ylabel("action weight ω (no unit)")
    ends = zip(inspection.action_names, history.weights[-1], ACTION_STYLES, strict=False)
    labels = [EndLabel(name, float(value), look.colour) for name, value, look in ends]
    label_ends(axes, [*labels, EndLabel(_CONSTANT, level, "0.3")])
    return figure


def drawn_windows(history: TensorStepHistory) -> TensorStepHistory:
    """Return the last window and every so many before it: not more than are drawn."""
    every = windows_apart(history)
    return TensorStepHistory._make(column[(history.episode.size - 1) % every :: every] for column in history)


def windows_apart(history: TensorStepHistory) -> int:
    """Return that every so many windows are drawn."""
    return max(1, -(-history.episode.size // MOST_DRAWN))


def draw_course(axes: Axes, episode: IntArray, values: FloatArray, look: LineStyle, shift: float = 0.0) -> None:
    """Draw what a number was after each window, with a few markers, `shift` of their distance to the right."""
    apart = max(1, len(episode) // _MARKERS)
    marks = (int(shift * apart), apart)
    plot_line(axes, episode, values, look, markersize=2.5 + 1.5 * look.width, markevery=marks, clip_on=False)


def _draw_map(inspection: Inspection) -> Figure:
    history = inspection.history
    high = min(8.0, max(1.2, _ROW * inspection.n_actions))
    left = 0.55 + 0.065 * max(len(name) for name in inspection.action_names)
    figure, axes = panel_figure(left, 0.47, WIDTH - left - 1.0, high, 0.28)
    # Windows are equally long: a column spans the one that its weights were worked out from.
    extent = (0, int(history.episode[-1]), inspection.n_actions - 0.5, -0.5)
    names = inspection.action_names
    image = draw_table(axes, history.weights.T, scale(history.weights), names, extent=extent)
    axes.tick_params(axis="x", length=3.5)
    count_episodes(axes, int(history.episode[-1]))
    axes.set_ylabel("action")
    colour_bar(axes, image, "action weight ω (no unit)")
    return figure


def _caption(inspection: Inspection) -> str:
    history, n_actions = inspection.history, inspection.n_actions
    last = history.weights[-1]
    low, high = int(last.argmin()), int(last.argmax())
    level = f"1/√{n_actions} = {1 / math.sqrt(n_actions):.3g}"
    drawn = (
        f"Dotted, the constant control, {level}{every_words(history)}"
        if n_actions <= len(ACTION_STYLES)
        else f"Lighter is more; a column spans the window that its weights come from. The constant control is {level}"
    )
    ends = (
        f"all are {number(float(last[low]))}"
        if last[low] == last[high]
        else f"the least is {number(float(last[low]))} ({inspection.action_names[low]}), the largest "
        f"{number(float(last[high]))} ({inspection.action_names[high]})"
    )
    return (
        "What the learning rate is multiplied by for each action, as the tensor step set it after each of "
        f"{counted(history.episode.size, 'window')}, until the next one ends; during the first window it is 1. "
        f"{drawn}. After the last window {ends}."
    )


def every_words(history: TensorStepHistory) -> str:
    """Return which windows are drawn where not all are."""
    every = windows_apart(history)
    return f". Only the last window and one in {every} before it are drawn" if every > 1 else ""


def _alt(inspection: Inspection) -> str:
    last = inspection.history.weights[-1]
    order = np.argsort(-last, kind="stable")
    named = ", ".join(f"{inspection.action_names[action]} {number(float(last[action]))}" for action in order[:6])
    rest = f" and {inspection.n_actions - 6} more" if inspection.n_actions > 6 else ""
    kind = "Curves" if inspection.n_actions <= len(ACTION_STYLES) else "A map"
    return f"{kind} of each action's weight by window. After the last one, largest first: {named}{rest}."


WEIGHTS = FigureSpec(
    Inspection,
    FigureText("weights", "Action weights by window"),
    draw_weights,
    _caption,
    _alt,
    applies=lambda one: one.n_windows > 0,
)
