"""What the page's scripts need to draw a table of values anew, for it to be explored."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.reports.figure import Live
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.greedy import direction
from tuckerl.reports.inspect.maps import sequential
from tuckerl.reports.text import counted
from tuckerl.types import IntArray

MOST_STEPS = 5000
"""So many steps of a path are drawn."""
MOST_VALUES = 250_000
"""So many Q-values are listed in a page, in four bytes each: of more, first fewer agents, then fewer states."""


def packed(values: ArrayLike, kind: str = "<f4") -> str:
    """Return an array as the scripts read it: its bytes as base64."""
    with np.errstate(over="ignore"):  # what no float32 can hold is shown as infinite
        return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def listed(inspection: Inspection) -> tuple[int, IntArray]:
    """Return how many agents' tables a page lists, and of which states, in order of number: none that are blocked."""
    states = np.flatnonzero(~inspection.walls)
    if states.size * inspection.n_actions > MOST_VALUES:
        # Those in which most was learned: whose values are farthest apart.
        finite = np.where(np.isfinite(inspection.q[0][states]), inspection.q[0][states], 0.0)
        most = np.argsort(-np.ptp(finite, axis=1), kind="stable")[: max(1, MOST_VALUES // inspection.n_actions)]
        states = np.sort(states[most])
    return max(1, min(inspection.n_agents, MOST_VALUES // max(1, states.size * inspection.n_actions))), states


def live_states(inspection: Inspection) -> Live:
    """Return the tables of values, for the states to be pointed at, searched and sorted."""
    n_agents, states = listed(inspection)
    mask = inspection.action_mask
    content: dict[str, Any] = {
        "layout": inspection.layout,
        "n_states": inspection.n_states,
        "factors": inspection.state_factors,
        "actions": inspection.action_names,
        "ways": [direction(name) for name in inspection.action_names],
        "states": packed(states, "<i4"),
        "q": [packed(table[states]) for table in inspection.q[:n_agents]],
        "best": [packed(best[states], "<i4") for best in inspection.best[:n_agents]],
        "allowed": None if mask is None else [packed(table[states], "u1") for table in mask[:n_agents]],
        "walls": packed(inspection.walls, "u1") if inspection.walls.any() else None,
        "optimal": None if inspection.optimal is None else packed(inspection.optimum),
        "paths": _paths(inspection, n_agents),
        "colours": colours(),
        "note": _note(inspection, n_agents, states.size),
    }
    return Live("states", content)


def _paths(inspection: Inspection, n_agents: int) -> list[dict[str, Any]]:
    return [
        {"name": path.name, "states": [states[:MOST_STEPS].tolist() for states in path.states[:n_agents]]}
        for path in inspection.paths
    ]


def _note(inspection: Inspection, n_agents: int, n_states: int) -> str:
    """Return what a page does not list."""
    words = []
    n_open = int((~inspection.walls).sum())
    if n_states < n_open:
        words.append(f"Listed are the {n_states:,} of {counted(n_open, 'state')} whose values are farthest apart")
    if n_agents < inspection.n_agents:
        words.append(f"Only the first {counted(n_agents, 'agent')} of {inspection.n_agents:,} can be chosen")
    return f"{'. '.join(words)}: a page holds {MOST_VALUES:,} values." if words else ""


def colours() -> list[list[int]]:
    """Return the colours of maps, from the least to the largest number, as red, green and blue."""
    rgb: list[list[int]] = (sequential()(np.linspace(0, 1, 17))[:, :3] * 255).round().astype(int).tolist()
    return rgb
