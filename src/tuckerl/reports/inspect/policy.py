"""The greedy policy and the state values where the states are the cells of a grid."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.inspect import cells
from tuckerl.reports.inspect.cells import Room
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, ArrowField, arrow_field, direction, shares_first_place
from tuckerl.reports.text import counted, span
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import BoolArray, IntArray

MARKERS = "os^DPXv*"  # of actions that point nowhere

_SMALLEST_ARROW = 7.0  # points: below, only every so many cells have one
_LONGEST_ARROW = 19.0
_DARK = 0.45  # of lightness: arrows are white on what is darker


def draw_policy(inspection: Inspection) -> Figure:
    """Draw agent 0's state values as colours and its greedy actions as arrows."""
    layout, q, allowed = inspection.grid, inspection.q[0], inspection.allowed[0]
    figure, axes, room = cells.grid_figure(layout)
    shown = inspection.known[0]
    norm = cells.scale(shown)
    colours = cells.draw_cells(axes, shown, layout, inspection.walls, norm, room)
    dark = (
        np.asarray(colours.to_rgba(np.nan_to_num(shown, nan=norm.vmax or 0.0)))[:, :3] @ (0.299, 0.587, 0.114) < _DARK
    )
    field = arrow_field(q, inspection.action_names, allowed)
    drawn = _drawn(inspection, room)
    _draw_arrows(axes, field, drawn, dark, room)
    marks = _draw_marks(axes, inspection, field.action, drawn, room)
    key = [*cells.key_of_cells(inspection.walls, np.isnan(shown), "no preference"), *marks]
    cells.legend_below(axes, room, key, 5, columnspacing=1.2)
    axes.set_title("agent 0" if inspection.n_agents > 1 else "greedy policy", loc="left")
    cells.colour_bar(axes, colours, "max Q(s, a)")
    return figure


def stride(room: Room) -> int:
    """Return that every so many rows and columns have an arrow."""
    return max(1, math.ceil(_SMALLEST_ARROW / room.cell - 1e-9))


def _drawn(inspection: Inspection, room: Room) -> BoolArray:
    """Return which cells have an arrow or a mark."""
    rows, columns = inspection.grid
    every = stride(room)
    chosen = np.zeros((rows, columns), dtype=np.bool_)
    chosen[(every // 2) % rows :: every, (every // 2) % columns :: every] = True
    return chosen.ravel() & ~inspection.walls


def _draw_arrows(axes: Axes, field: ArrowField, drawn: BoolArray, dark: BoolArray, room: Room) -> None:
    """Draw each arrow as one shape, black or white as its cell is light or dark."""
    places = np.flatnonzero(drawn & ((field.down != 0) | (field.right != 0)))
    columns = round(axes.get_xlim()[1] + 0.5)
    half = min(0.36 * stride(room) * room.cell, _LONGEST_ARROW / 2)  # points, so that oblong cells bend no arrow
    # Along and across its direction: a shaft, barbs, a tip.
    outline = np.array(
        [(-1, 0.1), (0.1, 0.1), (0.1, 0.52), (1, 0), (0.1, -0.52), (0.1, -0.1), (-1, -0.1)], dtype=np.float64
    )
    along = np.column_stack([field.right, field.down])[places, np.newaxis]
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    points = half * (outline[:, :1] * along + outline[:, 1:] * along[..., ::-1] * (-1, 1))
    centres = np.column_stack([places % columns, places // columns])[:, np.newaxis]
    shapes = centres + points / (room.across, room.down)
    colours = np.where(dark[places], "white", "black").tolist()
    axes.add_collection(PolyCollection(shapes, facecolors=colours, edgecolors="none", gid="arrows"), autolim=False)


def _draw_marks(axes: Axes, inspection: Inspection, action: IntArray, drawn: BoolArray, room: Room) -> list[Line2D]:
    """Mark where the greedy action points nowhere, a shape for each such action; return their legend."""
    columns = inspection.grid[1]
    look: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "black", "markeredgecolor": "white"}
    look |= {"markersize": min(7.0, 0.5 * stride(room) * room.cell), "markeredgewidth": 0.4}
    lines = []
    for number, marker in zip(_undirected(inspection), MARKERS, strict=False):
        places = np.flatnonzero(drawn & (action == number))
        name = inspection.action_names[number]
        if places.size:
            lines += axes.plot(places % columns, places // columns, marker=marker, label=name, **look)
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
    every = stride(cells.room_for(layout))
    words = [
        "Colour: the state value, the largest of each cell's Q(s, a); lighter is more. Arrow: the action that has it, "
        "by the direction of its name",
        *policy_words(inspection),
    ]
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
        highest = cells.where(int(np.nanargmax(known)), inspection.layout)
        text += f", the highest in {highest}, with an arrow for the greedy action: {inspection.commonest(4)} cells"
    return f"{text}. {int(inspection.walls.sum()):,} cells are blocked."


POLICY = FigureSpec(
    Inspection,
    FigureText("policy", "Greedy policy and state values"),
    draw_policy,
    _caption,
    _alt,
    applies=lambda one: one.layout is not None,
)
