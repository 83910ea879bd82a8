"""How far several agents' tables differ."""

from typing import NamedTuple

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.greedy import NO_PREFERENCE
from tuckerl.reports.inspect.maps import Map, colour_bar, draw_maps, draw_table, scale, where, with_legend
from tuckerl.reports.text import counted, joined, number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray

_MOST_AGENTS = 20  # of a matrix
_NUMBERED = 8
_LISTED = 6


class Differences(NamedTuple):
    """The differences of the other agents' greedy actions and values from agent 0's."""

    others: FloatArray  # (S,) agents with another action than agent 0; NaN where agent 0 prefers none, or a wall is
    spread: FloatArray  # (S,) largest minus smallest state value over the agents that prefer something; NaN for < 2
    agreement: FloatArray  # (N, N) part of the states in which both prefer something where it is the same; NaN if none


def differences(inspection: Inspection) -> Differences:
    """Compare the agents' tables."""
    best, known = inspection.best, inspection.known
    prefers = best != NO_PREFERENCE
    others = np.where(prefers[0], ((best != best[0]) & prefers).sum(axis=0), np.nan)
    several = prefers.sum(axis=0) > 1
    spread = np.full(inspection.n_states, np.nan)
    spread[several] = np.nanmax(known[:, several], axis=0) - np.nanmin(known[:, several], axis=0)
    agreement = np.full((inspection.n_agents, inspection.n_agents), np.nan)
    for one in range(inspection.n_agents):
        both = prefers[one] & prefers
        same = (best == best[one]) & both
        compared = both.sum(axis=1)
        agreement[one] = np.divide(same.sum(axis=1), compared, out=agreement[one], where=compared > 0)
    return Differences(others, spread, agreement)


def tables_differ(inspection: Inspection) -> bool:
    """Return whether there are several agents and not all have the same table."""
    return bool((~np.isclose(inspection.q, inspection.q[:1], rtol=0, atol=0, equal_nan=True)).any())


def draw_agents(inspection: Inspection) -> Figure:
    """Draw where the agents differ over the grid, or how far each two agree."""
    found, n_others = differences(inspection), inspection.n_agents - 1
    if inspection.layout is not None:
        whole = MaxNLocator(6, integer=True)
        counts = Map(found.others, Normalize(0, n_others), "agents with another greedy action", "agents", whole)
        spread = scale(np.append(found.spread, 0.0))
        maps = [counts, Map(found.spread, spread, "spread of the state values", "spread")]
        figure, _, key = draw_maps(inspection, maps, "agent 0 prefers nothing, or no two agents do")
        return with_legend(figure, key)
    agreement = found.agreement[:_MOST_AGENTS, :_MOST_AGENTS]
    n = len(agreement)
    figure = Figure(figsize=(WIDTH, min(4.5, max(1.2, 0.45 * n)) + 0.9), layout="compressed")
    axes = figure.subplots(subplot_kw={"box_aspect": 1})
    words = _whole_percent if n <= _NUMBERED else None
    image = draw_table(axes, agreement, Normalize(0, 1), list(map(str, range(n))), words=words)
    axes.set(xticks=range(n), xlabel="agent", ylabel="agent")
    axes.set_title("states with the same greedy action", loc="left")
    if n > _NUMBERED:
        colour_bar(axes, image, "part of the states")
    return figure


def _whole_percent(part: float) -> str:
    return "100 %" if part == 1 else f"{min(100 * part, 99):.0f} %"


def _pairs(inspection: Inspection) -> list[str]:
    """Return for each agent but the first in how many states its greedy action is another than agent 0's."""
    best = inspection.best
    words = []
    for agent in range(1, min(inspection.n_agents, _LISTED + 1)):
        both = (best[0] != NO_PREFERENCE) & (best[agent] != NO_PREFERENCE)
        other = int((best[agent] != best[0])[both].sum())
        words.append(f"agent {agent} in {other:,} of {int(both.sum()):,}")
    hidden = inspection.n_agents - 1 - len(words)
    return words if hidden == 0 else [*words, f"{counted(hidden, 'further agent')} not listed"]


def _caption(inspection: Inspection) -> str:
    spread = differences(inspection).spread
    words = [
        "States in which the greedy action is another than agent 0's, of those in which both prefer something: "
        + joined(_pairs(inspection))
    ]
    if np.isfinite(spread).any():
        state = int(np.nanargmax(spread))
        words.append(f"Their state values differ most in {where(state, inspection.layout)}, by {number(spread[state])}")
    if inspection.layout is None and inspection.n_agents > _MOST_AGENTS:
        words.append(f"Only the first {_MOST_AGENTS} agents are drawn")
    return ". ".join(words) + "."


def _alt(inspection: Inspection) -> str:
    kind = "A matrix of agreement" if inspection.layout is None else "Two maps of differences"
    return f"{kind} between agents. Greedy actions other than agent 0's: {joined(_pairs(inspection))} states."


AGENTS = FigureSpec(
    Inspection,
    FigureText("agents", "How far the agents differ"),
    draw_agents,
    _caption,
    _alt,
    applies=lambda one: one.n_agents > 1 and tables_differ(one),
)
