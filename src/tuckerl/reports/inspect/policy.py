"""The greedy policy and the state values: over a grid, and else as a table of few states or a profile of many."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from tuckerl.problems.parts import Layout
from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.explore import live_states
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, arrows, direction, shares_first_place
from tuckerl.reports.inspect.maps import (
    Map,
    cell_of,
    colour_bar,
    counting_ticks,
    draw_maps,
    draw_table,
    scale,
    sequential,
    where,
    with_legend,
)
from tuckerl.reports.styles import BLACK, BLUE
from tuckerl.reports.text import counted, number, span
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import BoolArray, FloatArray, IntArray

MARKERS = "os^DPXv*"  # of actions that point nowhere

_SMALLEST_ARROW = 7.0  # points: below, only every so many cells have one
_LONGEST_ARROW = 19.0
_DARK = 0.45  # of lightness: arrows are white on what is darker


def draw_policy(inspection: Inspection) -> Figure:
    """Draw agent 0's state values as colours, its greedy actions as arrows and, where it is known, its path."""
    shown = inspection.known[0]
    title = "agent 0" if inspection.n_agents > 1 else "greedy policy"
    field = Map(shown, scale(shown), title, "max Q(s, a)")
    figure, (axes,), key = draw_maps(inspection, [field], "no preference")
    columns, chosen = inspection.grid[1], _drawn(inspection)
    for path in (one for one in inspection.paths if one.words):
        for look in (
            {"color": "white", "linewidth": 3.2, "zorder": 0.8},
            {"color": BLACK, "linewidth": 1.4, "zorder": 0.9},
        ):
            axes.plot(path.states[0] % columns, path.states[0] // columns, **look)  # type: ignore[arg-type]  # of types
    _draw_arrows(axes, inspection, chosen & ~np.isnan(shown), field)
    return with_legend(figure, [*key, *_draw_marks(axes, inspection, chosen)])


def stride(layout: Layout) -> int:
    """Return that every so many rows and columns have an arrow."""
    return max(1, math.ceil(_SMALLEST_ARROW / min(cell_of(layout)) - 1e-9))


def _drawn(inspection: Inspection) -> BoolArray:
    """Return which cells have an arrow or a mark."""
    rows, columns = inspection.grid
    every = stride(inspection.grid)
    chosen = np.zeros((rows, columns), dtype=np.bool_)
    chosen[(every // 2) % rows :: every, (every // 2) % columns :: every] = True
    return chosen.ravel() & ~inspection.walls


def _draw_arrows(axes: Axes, inspection: Inspection, drawn: BoolArray, field: Map) -> None:
    """Draw the arrows, black or white as their cells are light or dark."""
    ways = arrows(inspection.q[0], inspection.action_names, inspection.allowed[0])
    places = np.flatnonzero(drawn & ways.any(axis=1))
    if places.size == 0:
        return
    columns = inspection.grid[1]
    shades = sequential()(field.norm(field.values[places]))[:, :3] @ (0.299, 0.587, 0.114)
    long = min(0.72 * stride(inspection.grid) * min(cell_of(inspection.grid)), _LONGEST_ARROW) / 72
    down, right = (ways[places] / np.linalg.norm(ways[places], axis=1, keepdims=True)).T
    look: dict[str, Any] = {"units": "inches", "scale_units": "inches", "pivot": "mid", "width": 0.1 * long}
    look |= {"headwidth": 5, "headlength": 4.5, "headaxislength": 4.5, "minlength": 0, "gid": "arrows"}
    colours = np.where(shades < _DARK, "white", "black").tolist()
    axes.quiver(places % columns, places // columns, right, -down, scale=1 / long, color=colours, **look)


def _draw_marks(axes: Axes, inspection: Inspection, drawn: BoolArray) -> list[Line2D]:
    """Mark where the greedy action points nowhere, a shape for each such action; return their legend."""
    columns = inspection.grid[1]
    size = min(7.0, 0.5 * stride(inspection.grid) * min(cell_of(inspection.grid)))
    look: dict[str, Any] = {"linestyle": "none", "color": BLACK, "markeredgecolor": "white", "markeredgewidth": 0.4}
    lines = []
    for action, marker in zip(_undirected(inspection), MARKERS, strict=False):
        places = np.flatnonzero(drawn & (inspection.best[0] == action))
        if places.size:
            name = inspection.action_names[action]
            lines += axes.plot(places % columns, places // columns, marker=marker, markersize=size, label=name, **look)
    return lines


def _undirected(inspection: Inspection) -> list[int]:
    """Return the actions that are drawn as marks: those without a direction, unless there are too many to tell."""
    found = [action for action, name in enumerate(inspection.action_names) if direction(name) is None]
    return found if len(found) <= len(MARKERS) else []


def policy_words(inspection: Inspection) -> list[str]:
    """Return in how many states agent 0 prefers an action, what its values are, and in how many several are best."""
    q, allowed = inspection.q[0][~inspection.walls], inspection.allowed[0][~inspection.walls]
    preferred = int(inspection.counts.sum())
    infinite = int((~(np.isfinite(q) | ~allowed).all(axis=1)).sum())
    words = [f"Agent 0 prefers an action in {preferred:,} of {counted(len(q), 'state')}"]
    if preferred:
        words[0] += f"; their values are {span(inspection.known[0][inspection.best[0] != NO_PREFERENCE])}"
    if preferred < len(q):
        words.append("Where all actions are worth the same, as where nobody has been, it has no preference")
    tied = int(shares_first_place(q, allowed).sum())
    if tied:
        words.append(
            f"In {counted(tied, 'state')} several but not all actions are equally good; the lowest numbered is shown"
        )
    if infinite:
        words.append(f"Left out: {counted(infinite, 'state')} with values that are not finite")
    return words


def _caption(inspection: Inspection) -> str:
    layout = inspection.grid
    every = stride(layout)
    words = [
        "Colour: the state value, the largest of each cell's Q(s, a); lighter is more. Arrow: the action that has it, "
        "by the direction of its name",
        *policy_words(inspection),
    ]
    words += [f"Line: the {path.name} from the start; {path.words}" for path in inspection.paths if path.words]
    if every > 1:
        words.append(f"Arrows are drawn in every {_ORDINALS.get(every, f'{every}th')} row and column only")
    unmarked = [name for name in inspection.action_names if direction(name) is None]
    if len(unmarked) > len(MARKERS):
        words.append(f"{len(unmarked)} actions whose names mean no direction have no mark")
    return ". ".join(words) + "."


_ORDINALS = {2: "second", 3: "third"}


def _alt(inspection: Inspection) -> str:
    rows, columns = inspection.grid
    text = f"A grid of {rows} rows and {columns} columns coloured by state value"
    known = inspection.known[0]
    if np.isfinite(known).any():
        highest = where(int(np.nanargmax(known)), inspection.layout)
        text += f", the highest in {highest}, with an arrow for the greedy action: {inspection.commonest(4)} cells"
    return f"{text}. {int(inspection.walls.sum()):,} cells are blocked."


POLICY = FigureSpec(
    Inspection,
    FigureText("policy", "Greedy policy and state values"),
    draw_policy,
    _caption,
    _alt,
    applies=lambda one: one.layout is not None,
    live=live_states,
)


TABLE_STATES = 60
"""So many states are shown one by one."""

_ROW = 0.155  # inches of a state or an action with its name
_BARS = 40  # actions that have one
_NAMED_COLUMNS = 30


def draw_plain(inspection: Inspection) -> Figure:
    """Draw agent 0's table, or a profile of its values and of the actions that it prefers."""
    return _draw_table(inspection) if inspection.n_states <= TABLE_STATES else _draw_profile(inspection)


def _draw_table(inspection: Inspection) -> Figure:
    q, best = inspection.q[0], inspection.best[0]
    n_states, n_actions = q.shape
    named = n_actions <= _NAMED_COLUMNS
    tilted = named and max(map(len, inspection.action_names)) * n_actions > 70
    figure = Figure(figsize=(WIDTH, max(0.5, _ROW * n_states) + (1.6 if tilted else 0.9)), layout="constrained")
    axes = figure.subplots()
    image = draw_table(axes, q, scale(q))
    states = np.flatnonzero(best != NO_PREFERENCE)
    axes.plot(best[states], states, linestyle="none", marker="o", markersize=5, color=BLACK, markeredgecolor="white")
    axes.set(xlim=(-0.5, n_actions - 0.5), ylim=(n_states - 0.5, -0.5), xlabel="action", ylabel="state")
    if named:
        axes.set_xticks(range(n_actions), inspection.action_names, rotation=90 if tilted else 0, parse_math=False)
    axes.set_yticks(counting_ticks(n_states))
    axes.set_title("agent 0: Q(s, a), with a dot the greedy action", loc="left")
    colour_bar(axes, image, "Q(s, a)")
    return figure


def _draw_profile(inspection: Inspection) -> Figure:
    shown = shown_actions(inspection)
    figure = Figure(figsize=(WIDTH, max(2.1, _ROW * shown.size) + 0.8), layout="constrained")
    curve, bars = figure.subplots(1, 2, width_ratios=(1.3, 1))
    _draw_values(curve, inspection.known)
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
        axes.plot(np.arange(1, sorted_values.size + 1), sorted_values, label=name, marker=marker, **look)  # type: ignore[arg-type]  # keywords of several types
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
            "Printed, left: the values of the states in which something is preferred, sorted; right: in how many of "
            "agent 0's states each action is greedy"
        )
        hidden = ["The states have no layout: on a screen they stand in a list"]
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
    live=live_states,
)
