"""The greedy policy and the values where the states have no layout: a table of few states, a profile of many."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import WIDTH, FigureSpec, panel, panel_figure
from tuckerl.reports.inspect.cells import colour_bar, counting_ticks, draw_table, scale
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.greedy import NO_PREFERENCE
from tuckerl.reports.inspect.policy import policy_words
from tuckerl.reports.styles import BLACK, BLUE
from tuckerl.reports.text import number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

TABLE_STATES = 60
"""So many states are shown one by one."""

_ROW = 0.155  # inches of a state or an action with its name
_BARS = 40  # actions that have one
_NAMED_COLUMNS = 30


def draw_plain(inspection: Inspection) -> Figure:
    """Draw agent 0's table, or a profile of its values and of the actions that it prefers."""
    return _draw_table(inspection) if inspection.n_states <= TABLE_STATES else _draw_profile(inspection)


def _draw_table(inspection: Inspection) -> Figure:
    q = inspection.q[0]
    n_states, n_actions = q.shape
    wide, high = min(5.5, max(1.2, 0.6 * n_actions)), max(0.35, _ROW * n_states)
    longest = 0.075 * max(len(name) for name in inspection.action_names)
    tilted = n_actions <= _NAMED_COLUMNS and longest > 0.95 * wide / n_actions
    below = 0.36 + (min(1.6, longest) if tilted else 0.2)
    figure, axes = panel_figure(0.62, below, wide, high, 0.3)
    image = draw_table(axes, q, scale(q))
    best = inspection.best[0]
    states = np.flatnonzero(best != NO_PREFERENCE)
    axes.plot(best[states], states, linestyle="none", marker="o", markersize=5, color=BLACK, markeredgecolor="white")
    axes.set_xlim(-0.5, n_actions - 0.5)
    axes.set_ylim(n_states - 0.5, -0.5)
    if n_actions <= _NAMED_COLUMNS:
        axes.set_xticks(range(n_actions), inspection.action_names, rotation=90 if tilted else 0, parse_math=False)
    axes.set_yticks(counting_ticks(n_states))
    axes.tick_params(length=2)
    axes.set_xlabel("action")
    axes.set_ylabel("state")
    axes.set_title("agent 0: Q(s, a), with a dot the greedy action", loc="left")
    colour_bar(axes, image, "Q(s, a)")
    return figure


def _draw_profile(inspection: Inspection) -> Figure:
    shown = shown_actions(inspection)
    high = max(2.1, _ROW * shown.size)
    figure = Figure(figsize=(WIDTH, high + 0.8))
    longest = max(len(inspection.action_names[action]) for action in shown)
    gap = 0.6 + 0.07 * min(longest, 20)
    left_width = 0.55 * (WIDTH - 0.62 - gap - 0.2)
    _draw_values(panel(figure, 0.62, 0.48, left_width, high), inspection.known)
    left = 0.62 + left_width + gap
    bars = panel(figure, left, 0.48, WIDTH - left - 0.2, high)
    _draw_counts(bars, inspection.counts[shown], [inspection.action_names[action] for action in shown])
    return figure


def shown_actions(inspection: Inspection) -> IntArray:
    """Return the actions that have a bar: all, or those that are greedy most often, in order of number."""
    return np.sort(np.argsort(-inspection.counts, kind="stable")[:_BARS])


def _draw_values(axes: Axes, known: FloatArray) -> None:
    """Draw each agent's values from the highest down, agent 0's on top."""
    for agent in range(len(known) - 1, -1, -1):
        sorted_values = np.sort(known[agent][np.isfinite(known[agent])])[::-1]
        look = {"color": BLUE, "linewidth": 1.8} if agent == 0 else {"color": "0.6", "linewidth": 0.9}
        name = "agent 0" if agent == 0 else "the other agents" if agent == len(known) - 1 else "_"
        marker = "o" if sorted_values.size == 1 else ""
        axes.plot(np.arange(1, sorted_values.size + 1), sorted_values, label=name, marker=marker, **look)  # type: ignore[arg-type]
    if not np.isfinite(known).any():
        axes.text(0.5, 0.5, "no state prefers an action", transform=axes.transAxes, horizontalalignment="center")
    elif len(known) > 1:
        axes.legend(frameon=False)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("states, the most valuable first")
    axes.set_title("state value, max Q(s, a)", loc="left")  # not beside the numbers, whose width is not known


def _draw_counts(axes: Axes, counts: IntArray, names: list[str]) -> None:
    axes.barh(range(len(names)), counts, height=0.75, color=BLUE)
    axes.set_yticks(range(len(names)), names, parse_math=False)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(0, max(1, int(counts.max(initial=0))) * 1.02)
    axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("states in which it is greedy")
    axes.set_title("action", loc="left")


def plain_caption(inspection: Inspection) -> str:
    """Return what the table or the profile shows, and what it does not."""
    words = policy_words(inspection)
    if inspection.n_states <= TABLE_STATES:
        first = "Agent 0's table, lighter is more; a dot marks the greedy action"
        hidden = ["Only agent 0's values are shown"] if inspection.n_agents > 1 else []
    else:
        first = (
            "Left: the values of the states in which something is preferred, sorted. Right: in how many of agent 0's "
            "states each action is greedy"
        )
        hidden = ["Which state has which value and action is not shown, as the states have no layout"]
        missing = inspection.n_actions - shown_actions(inspection).size
        if missing:
            hidden.append(f"{missing} actions that are greedy less often have no bar")
    return ". ".join([first, *words, *hidden]) + "."


def plain_alt(inspection: Inspection) -> str:
    """Return the highest value and the commonest greedy actions."""
    known = inspection.known[0]
    kind = (
        "A table of values" if inspection.n_states <= TABLE_STATES else "A falling curve of values and bars of actions"
    )
    if not inspection.counts.any():
        return f"{kind}; no state prefers an action."
    best = int(np.nanargmax(known))
    value = number(float(known[best]))
    return f"{kind}. The highest value is {value}, of state {best}. Greedy: {inspection.commonest(3)} states."


PLAIN = FigureSpec(
    Inspection,
    FigureText("policy", "Greedy policy and state values"),
    draw_plain,
    plain_caption,
    plain_alt,
    applies=lambda one: one.layout is None,
)
