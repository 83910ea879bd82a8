"""The factors of the latest tables: the states' as maps or rows of colours, the others' beside one another."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from tuckerl.generalization.loadings import ACTIONS, AGENTS, EPISODES, STATES, Loadings
from tuckerl.reports.figure import WIDTH, FigureSpec, panel, panel_figure
from tuckerl.reports.inspect.cells import colour_bar, draw_cells, draw_table, key_of_cells, room_for, where
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.text import counted, joined, number, percent, percents
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

MOST_MAPS = 20
MOST_STATES = 400
"""So many states without a layout are shown one by one."""

_ACROSS = 5


def draw_states(inspection: Inspection) -> Figure:
    """Draw the columns of the state factor."""
    loadings = inspection.decomposed
    return _draw_maps(inspection, loadings) if inspection.layout is not None else _draw_rows(loadings)


def on_all_states(inspection: Inspection) -> FloatArray:
    """Return the state factor with a row for every state, (S, r): NaN where a state's row did not change."""
    loadings = inspection.decomposed
    factor = loadings.factors[STATES]
    spread = np.full((inspection.n_states, factor.shape[1]), np.nan)
    spread[loadings.states] = factor
    return spread


def _draw_maps(inspection: Inspection, loadings: Loadings) -> Figure:
    layout = inspection.layout or (1, inspection.n_states)
    columns = on_all_states(inspection)
    n_maps = min(columns.shape[1], MOST_MAPS)
    rows, columns_of = layout
    across = min(n_maps, _ACROSS if columns_of <= 2.5 * rows else 3 if columns_of <= 5 * rows else 1)
    down = math.ceil(n_maps / across)
    width = min((WIDTH - 1.35 - 0.14 * (across - 1)) / across, 1.8 if across > 1 else 5.0)
    room = room_for(layout, width=width, height=2.4)
    step_x, step_y = max(room.width + 0.14, 1.16), room.height + 0.5
    below = max(0.34, 0.9 - room.height)
    height = down * step_y + below
    figure = Figure(figsize=(WIDTH, height))
    energies = loadings.energies(STATES)
    for place in range(n_maps):
        left, top = 0.2 + (place % across) * step_x, height - 0.4 - (place // across) * step_y
        axes = panel(figure, left, top - room.height, room.width, room.height)
        largest = _largest(columns[:, place])
        colours = draw_cells(
            axes, columns[:, place], layout, inspection.walls, Normalize(-largest, largest), room, lines=False
        )
        axes.set(xticks=[], yticks=[], xlabel="", ylabel="")
        axes.set_title(f"{place + 1}: {_short(energies[place])}\n±{number(largest)}", loc="left", fontsize=8, pad=2)
        if place == across - 1:
            colours.set_norm(Normalize(-1, 1))
            _draw_bar(axes, colours)
    key = key_of_cells(inspection.walls, np.isnan(columns[:, 0]), "did not change")
    if key:
        figure.legend(handles=key, loc="lower left", bbox_to_anchor=(0.2 / WIDTH, 0), ncols=2, frameon=False)
    return figure


def _largest(column: FloatArray) -> float:
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
    rows = shown_rows(loadings)
    factor = loadings.factors[STATES][rows, :MOST_MAPS].T
    n_columns = len(factor)
    figure, axes = panel_figure(1.05, 0.5, 5.1, max(0.5, 0.2 * n_columns), 0.35)
    scaled = factor / np.array([[_largest(column)] for column in factor])
    names = [f"{place}: {_short(part)}" for place, part in enumerate(loadings.energies(STATES)[:n_columns], 1)]
    image = draw_table(axes, scaled, Normalize(-1, 1), names)
    places = np.unique(np.linspace(0, rows.size - 1, min(rows.size, 9)).round().astype(np.int64))
    axes.set_xticks(places, [f"{state}" for state in loadings.states[rows][places]])
    axes.tick_params(length=2)
    axes.set_xlabel("state (its number)")
    axes.set_title("factor: part of the sum of squares", loc="left", x=-0.16)
    _draw_bar(axes, image)
    return figure


def _draw_bar(axes: Axes, colours: ScalarMappable) -> None:
    bar = colour_bar(axes, colours, "loading", [-1.0, 0.0, 1.0])
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
    if n_columns > MOST_MAPS:
        words.append(f"Only the first {MOST_MAPS} are drawn")
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


STATE_LOADINGS = FigureSpec(
    Inspection,
    FigureText("state-loadings", "State loadings"),
    draw_states,
    _states_caption,
    _states_alt,
    applies=lambda one: one.loadings is not None and one.loadings.factors[STATES].size > 0,
)


_ROW = 0.155
_MOST_ROWS = 40  # that are drawn as high as letters
_NUMBER = 0.4  # inches that a number needs
_GAP = 0.18


class _Part(NamedTuple):
    """A factor and the names of its rows."""

    title: str
    factor: FloatArray
    names: Sequence[str]


def draw_loadings(inspection: Inspection) -> Figure:
    """Draw the three factors, rows down and columns across, on one scale."""
    loadings = inspection.decomposed
    parts = _parts(inspection, loadings)
    highest = max(_height(part) for part in parts)
    height = highest + 0.8
    figure = Figure(figsize=(WIDTH, height))
    labels = [0.14 + 0.065 * max(3, *(len(name) for name in part.names)) for part in parts]
    room = WIDTH - 0.95 - _GAP * (len(parts) - 1) - sum(labels)
    columns = [part.factor.shape[1] for part in parts]
    largest = max(float(np.abs(part.factor).max(initial=0)) for part in parts) or 1.0
    norm = Normalize(-largest, largest)
    left = 0.05
    for part, label, count in zip(parts, labels, columns, strict=True):
        left += label
        width = min(room * _share(count, columns), 0.55 * count)
        high = _height(part)
        axes = panel(figure, left, height - 0.3 - high, width, high)
        image = _draw_part(axes, part, norm, numbered=width / count >= _NUMBER)
        left += width + _GAP
    colour_bar(axes, image, "loading", least=highest)
    return figure


def _parts(inspection: Inspection, loadings: Loadings) -> list[_Part]:
    first = loadings.first_episode
    episodes = [str(first + place) for place in range(loadings.factors[EPISODES].shape[0])]
    return [
        _Part("action", loadings.factors[ACTIONS], inspection.action_names),
        _Part("episode", loadings.factors[EPISODES], episodes),
        _Part("agent", loadings.factors[AGENTS], [str(agent) for agent in range(inspection.n_agents)]),
    ]


def _height(part: _Part) -> float:
    return max(0.3, _ROW * min(len(part.names), _MOST_ROWS))


def _share(count: int, counts: list[int]) -> float:
    # The square root leaves a factor of one column beside one of twenty some width.
    return float(np.sqrt(count) / np.sum(np.sqrt(counts)))


def _draw_part(axes: Axes, part: _Part, norm: Normalize, *, numbered: bool) -> AxesImage:
    n_rows, n_columns = part.factor.shape
    words = _hundredths if numbered and n_rows <= _MOST_ROWS else None
    image = draw_table(axes, part.factor, norm, part.names, most=_MOST_ROWS, words=words)
    step = max(1, -(-n_columns // 10))
    axes.set_xticks(range(0, n_columns, step), [str(place + 1) for place in range(0, n_columns, step)])
    axes.set_xlabel("factor", labelpad=1)
    axes.set_title(part.title, loc="left", pad=4)
    return image


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
        "that of an agent's row decides whose table the rules 'max' and 'min' copy."
    )


def _alt(inspection: Inspection) -> str:
    loadings = inspection.decomposed
    words = []
    for part in _parts(inspection, loadings):
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
