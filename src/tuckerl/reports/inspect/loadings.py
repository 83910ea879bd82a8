"""The factors of the latest tables: the states' as maps or rows of colours, the others' beside one another."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tuckerl.generalization.loadings import ACTIONS, AGENTS, EPISODES, STATES, Loadings
from tuckerl.reports.figure import WIDTH, FigureSpec, Live
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.explore import colours, packed
from tuckerl.reports.inspect.maps import Map, colour_bar, draw_maps, draw_table, sequential, where, with_legend
from tuckerl.reports.text import counted, joined, number, percent, percents
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

MOST_MAPS = 20
MOST_STATES = 400
"""So many states without a layout are shown one by one."""
LEAST_ENERGY = 0.01
"""What carries a smaller part of the sum of squares is not drawn."""


def drawn_columns(loadings: Loadings, mode: int) -> IntArray:
    """Return which of a factor's columns are drawn: those that carry enough, and the first in any case."""
    enough = np.flatnonzero(loadings.energies(mode) >= LEAST_ENERGY)[:MOST_MAPS]
    return enough if enough.size else np.zeros(1, dtype=np.int64)


def draw_states(inspection: Inspection) -> Figure:
    """Draw the columns of the state factor."""
    return _draw_rows(inspection.decomposed) if inspection.layout is None else _draw_maps(inspection)


def on_all_states(inspection: Inspection) -> FloatArray:
    """Return the state factor with a row for every state, (S, r): NaN where a state's row did not change."""
    loadings = inspection.decomposed
    factor = loadings.factors[STATES]
    spread = np.full((inspection.n_states, factor.shape[1]), np.nan)
    spread[loadings.states] = factor
    return spread


def _draw_maps(inspection: Inspection) -> Figure:
    loadings, (rows, columns) = inspection.decomposed, inspection.grid
    spread, energies, maps = on_all_states(inspection), loadings.energies(STATES), []
    for place in drawn_columns(loadings, STATES):
        high = largest(spread[:, place])
        title = f"{place + 1}: {_short(energies[place])}\n±{number(high)}"
        maps.append(Map(spread[:, place], Normalize(-high, high), title))
    across = 5 if columns <= 2.5 * rows else 3 if columns <= 5 * rows else 1
    figure, panels, key = draw_maps(inspection, maps, "did not change", across=across, tallest=1.8, ticks=False)
    _draw_bar(panels, ScalarMappable(Normalize(-1, 1), sequential()))
    return with_legend(figure, key)


def largest(column: FloatArray) -> float:
    """Return the largest magnitude of a column, 1 where it has none."""
    finite = np.abs(column[np.isfinite(column)])
    return float(finite.max()) if finite.size and finite.max() > 0 else 1.0


def _short(part: float) -> str:
    """Return a part of 1 in percent, in few letters."""
    return f"{100 * part:.3g} %" if part == 0 or part >= 0.0005 else "<0.1 %"


def shown_rows(loadings: Loadings) -> IntArray:
    """Return the rows of the state factor that are drawn without a layout: the longest, in order of state."""
    norms = np.linalg.norm(loadings.factors[STATES], axis=1)
    longest = np.argsort(-norms, kind="stable")[:MOST_STATES]
    return longest[np.argsort(loadings.states[longest], kind="stable")]


def _draw_rows(loadings: Loadings) -> Figure:
    rows, columns = shown_rows(loadings), drawn_columns(loadings, STATES)
    factor = loadings.factors[STATES][np.ix_(rows, columns)].T
    figure = Figure(figsize=(WIDTH, max(0.5, 0.2 * columns.size) + 0.9), layout="constrained")
    axes = figure.subplots()
    scaled = factor / np.array([[largest(column)] for column in factor])
    names = [f"{place + 1}: {_short(loadings.energies(STATES)[place])}" for place in columns]
    image = draw_table(axes, scaled, Normalize(-1, 1), names)
    places = np.unique(np.linspace(0, rows.size - 1, min(rows.size, 9)).round().astype(np.int64))
    axes.set_xticks(places, [f"{state}" for state in loadings.states[rows][places]])
    axes.tick_params(length=2)
    axes.set_xlabel("state (its number)")
    axes.set_title("factor: part of the sum of squares", loc="left")
    _draw_bar(axes, image)
    return figure


def _draw_bar(axes: Axes | list[Axes], colours: ScalarMappable) -> None:
    bar = colour_bar(axes, colours, "loading", ticks=[-1.0, 0.0, 1.0])
    bar.set_yticks([-1, 0, 1], ["\N{MINUS SIGN}largest", "0", "largest"])


def fit_words(loadings: Loadings) -> str:
    """Return the fit and the part of the sum of squares that it means."""
    if math.isnan(loadings.fit):
        return "the fit is not known"
    explained = 1 - (1 - loadings.fit) ** 2
    return f"the fit is {loadings.fit:.4g}, which means that {percent(explained)} of the tables' sum of squares is kept"


def _states_caption(inspection: Inspection) -> str:
    loadings = inspection.decomposed
    n_columns = loadings.factors[STATES].shape[1]
    share = percents(loadings.energies(STATES))
    words = [
        f"{counted(n_columns, 'column')} of the state factor of the latest tables' Tucker decomposition; "
        f"{fit_words(loadings)}. Of what is kept, they carry {share} (squares of the core)",
        "Lighter is positive, darker negative; each is scaled to its own largest magnitude, and its sign is arbitrary",
    ]
    if inspection.layout is not None:
        words.append("Over each map stand its share and that magnitude")
    hidden = np.delete(loadings.energies(STATES), drawn_columns(loadings, STATES))
    if hidden.size:
        carried = percent(float(hidden.sum()))
        words.append(
            f"Not drawn: {counted(hidden.size, 'column')} of less than {percent(LEAST_ENERGY)}, together {carried}"
        )
    still = int((~inspection.walls).sum()) - int((~inspection.walls[loadings.states]).sum())
    if still:
        has = "has" if still == 1 else "have"
        words.append(f"{counted(still, 'state')} did not change in these episodes and {has} no loadings")
    if inspection.layout is None:
        words += _hidden(loadings)
    return ". ".join(words) + "."


def _hidden(loadings: Loadings) -> list[str]:
    norms = np.square(loadings.factors[STATES]).sum(axis=1)
    rows = shown_rows(loadings)
    if rows.size == norms.size or not norms.any():
        return []
    part = 1 - float(norms[rows].sum() / norms.sum())
    return [
        f"Drawn are the {rows.size} states with the largest loadings; the other {norms.size - rows.size:,} carry "
        f"{percent(part)} of the factor's squares"
    ]


def _states_alt(inspection: Inspection) -> str:
    loadings = inspection.decomposed
    factor = loadings.factors[STATES]
    if factor.size == 0:
        return "No state has loadings."
    peaks = []
    for place in range(min(3, factor.shape[1])):
        row = int(np.abs(factor[:, place]).argmax())
        at = where(int(loadings.states[row]), inspection.layout)
        peaks.append(f"column {place + 1} is largest in {at}, {number(factor[row, place])}")
    kind = "Small maps" if inspection.layout is not None else "Rows of colours"
    return f"{kind} of {counted(factor.shape[1], 'column')} of the state factor: {'; '.join(peaks)}."


def live_loadings(inspection: Inspection) -> Live:
    """Return the drawn columns of the state factor, and how strong each is in each episode of the window."""
    loadings = inspection.decomposed
    drawn, energies = drawn_columns(loadings, STATES), loadings.energies(STATES)
    of_states = on_all_states(inspection) if inspection.layout else loadings.factors[STATES][shown_rows(loadings)]
    columns = [
        {
            "loadings": packed(of_states[:, place]),
            "largest": largest(of_states[:, place]),
            "energy": percent(energies[place]),
        }
        for place in drawn
    ]
    content = {
        "layout": inspection.layout,
        "n_states": len(of_states),
        "walls": packed(inspection.walls, "u1") if inspection.layout and inspection.walls.any() else None,
        "columns": columns,
        "strength": packed(strengths(loadings)[:, drawn]),
        "first": loadings.first_episode,
        "last": loadings.episode,
        "colours": colours(),
    }
    return Live("loadings", content)


def strengths(loadings: Loadings) -> FloatArray:
    """Return how strong each column of the state factor is in each episode, 1 where it is strongest: (E, r).

    It is the norm of the part of the core that belongs to the column, multiplied by the episode's row.
    """
    parts = np.einsum("sapn,ep->esan", loadings.core, loadings.factors[EPISODES])
    norms = np.sqrt(np.square(parts).sum(axis=(2, 3)))
    most = norms.max(axis=0)
    return np.asarray(np.divide(norms, most, out=np.zeros_like(norms), where=most > 0))


STATE_LOADINGS = FigureSpec(
    Inspection,
    FigureText("state-loadings", "State loadings"),
    draw_states,
    _states_caption,
    _states_alt,
    applies=lambda one: one.loadings is not None and one.loadings.factors[STATES].size > 0,
    live=live_loadings,
)


_ROW = 0.155
_MOST_ROWS = 40  # that are drawn as high as letters
_MOST_NUMBERS = 12  # columns of all three factors that have room for a number in each cell


class _Part(NamedTuple):
    """A factor and the names of its rows."""

    title: str
    columns: IntArray  # (c,) those that are drawn
    factor: FloatArray  # (n, c)
    names: Sequence[str]  # (n,)


def draw_loadings(inspection: Inspection) -> Figure:
    """Draw the three factors, rows down and columns across, on one scale."""
    parts = _parts(inspection)
    rows = [min(len(part.names), _MOST_ROWS) for part in parts]
    counts = [part.columns.size for part in parts]
    figure = Figure(figsize=(WIDTH, max(0.5, _ROW * max(rows)) + 0.8), layout="constrained")
    # The square root leaves a factor of one column beside one of twenty some width.
    panels = figure.subplots(1, 3, width_ratios=np.sqrt(counts).tolist()).tolist()
    largest = max(float(np.abs(part.factor).max(initial=0)) for part in parts) or 1.0
    for axes, part, count in zip(panels, parts, counts, strict=True):
        words = _hundredths if sum(counts) <= _MOST_NUMBERS and len(part.names) <= _MOST_ROWS else None
        image = draw_table(axes, part.factor, Normalize(-largest, largest), part.names, most=_MOST_ROWS, words=words)
        step = max(1, -(-count // 10))
        axes.set_xticks(range(0, count, step), [str(column + 1) for column in part.columns[::step]])
        axes.set_xlabel("factor", labelpad=1)
        axes.set_title(part.title, loc="left", pad=4)
    colour_bar(panels, image, "loading")
    return figure


def _parts(inspection: Inspection) -> list[_Part]:
    loadings = inspection.decomposed
    n_episodes, first = len(loadings.factors[EPISODES]), loadings.first_episode
    names = {
        ACTIONS: ("action", inspection.action_names),
        EPISODES: ("episode", [str(first + place) for place in range(n_episodes)]),
        AGENTS: ("agent", [str(agent) for agent in range(inspection.n_agents)]),
    }
    drawn = {mode: drawn_columns(loadings, mode) for mode in names}
    return [
        _Part(title, drawn[mode], loadings.factors[mode][:, drawn[mode]], rows) for mode, (title, rows) in names.items()
    ]


def _hundredths(value: float) -> str:
    return f"{round(float(value), 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _caption(inspection: Inspection) -> str:
    loadings = inspection.decomposed
    names = {ACTIONS: "action", EPISODES: "episode", AGENTS: "agent"}
    shares = joined(f"the {name} factors {percents(loadings.energies(mode))}" for mode, name in names.items())
    first = loadings.first_episode
    last = first + loadings.factors[EPISODES].shape[0] - 1
    return (
        f"The columns of the action, episode and agent factors of the tables of episodes {first} to {last}; "
        f"{fit_words(loadings)}. Of what is kept, {shares} (squares of the core, by column). Columns have length 1; "
        "lighter is positive, darker negative. The length of an action's row gives its weight ω in the tensor step, "
        f"that of an agent's row decides whose table the rules 'max' and 'min' copy.{_not_drawn(loadings)}"
    )


def _not_drawn(loadings: Loadings) -> str:
    modes = (ACTIONS, EPISODES, AGENTS)
    hidden = any(drawn_columns(loadings, mode).size < loadings.core.shape[mode] for mode in modes)
    return f" Columns that carry less than {percent(LEAST_ENERGY)} are not drawn." if hidden else ""


def _alt(inspection: Inspection) -> str:
    words = []
    for part in _parts(inspection):
        first = part.factor[:, 0]
        row = int(np.abs(first).argmax())
        words.append(f"{part.title} {part.names[row]} ({number(float(first[row]))})")
    return f"Three tables of loadings. Largest in the first columns: {joined(words)}."


LOADINGS = FigureSpec(
    Inspection,
    FigureText("loadings", "Action, episode and agent loadings"),
    draw_loadings,
    _caption,
    _alt,
    applies=lambda one: one.loadings is not None,
)
