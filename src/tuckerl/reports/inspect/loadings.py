"""The action, episode and agent factors, beside one another."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from tuckerl.generalization.loadings import ACTIONS, AGENTS, EPISODES, Loadings
from tuckerl.reports.figure import WIDTH, FigureSpec, panel
from tuckerl.reports.inspect.cells import colour_bar, draw_table
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.state_loadings import fit_words
from tuckerl.reports.text import joined, number, percents
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray

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
