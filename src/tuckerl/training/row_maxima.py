"""The largest entry of each row, known while one entry after the other changes.

Acting and learning ask for a row's maximum at every step, though at most one of its entries has changed since they last
asked. So an algorithm that changes its table by `change_value` alone keeps for each row what its maximum is, where it
stands, in how many columns, and a bound on all other entries. From these follows in most cases what a change makes of
the maximum, and the row is looked through again only where its one largest entry falls to what others may have.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import ByKind, is_rare, kernel
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.types import BoolArray, FloatArray

# One record, half a line of the processor's cache: what a step needs to know of a row, it finds in memory once.
ROW = np.dtype(
    [
        ("largest", np.float64),
        ("bound", np.float64),  # no smaller entry is above it
        ("first", np.uint32),  # the first column of the largest entry
        ("ties", np.uint32),  # in how many columns it stands
        ("call", np.int64),  # in which call of a kernel all this was known
    ],
    align=True,
)

WORTH_FOLLOWING = 10
"""From how many actions on a row is followed; one of fewer is looked through sooner (measured with 4, 6 and 21)."""


class RowMaxima(NamedTuple):
    """What is known of the rows of a table with S states, as far as actions may be taken."""

    rows: NDArray[np.void]  # (S,) of ROW
    call: int  # the present call of a kernel, from 1: what was known in an earlier one may have changed since


class NoMaxima(NamedTuple):
    """Of a table that changes in other ways, or whose masks do: its rows are looked through every time."""


@kernel
def largest_entries(table: FloatArray, row: int) -> tuple[float, float, int, int]:
    """Return what `ROW` holds of a row of `table`, (R, C): largest entry, bound, first column, number of ties."""
    # No branch depends on the values: mispredicted ones cost twice the time. The next state waits for `first`, so that
    # comes from the first pass; nothing waits for the ties.
    largest, bound, first, ties = table[row, 0], -np.inf, 0, 0
    for column in range(1, table.shape[1]):
        value = table[row, column]
        is_larger = value > largest
        largest = value if is_larger else largest
        first = column if is_larger else first
    for column in range(table.shape[1]):
        value = table[row, column]
        is_largest = value == largest
        bound = max(bound, -np.inf if is_largest else value)
        ties += is_largest
    return largest, bound, first, ties


@kernel
def largest_allowed(q: FloatArray, action_mask: BoolArray, state: int) -> tuple[float, float, int, int]:
    """Return what `ROW` holds of a row of values, of the actions that may be taken there.

    Parameters
    ----------
    q : (S, A) float64
    action_mask : (S, A) bool
        True where an action may be taken; (0, 0) where all may.
    state : int
    """
    if action_mask.size == 0:
        return largest_entries(q, state)
    largest, bound, first, ties = -np.inf, -np.inf, -1, 0
    for action in range(q.shape[1]):
        value = q[state, action]
        is_larger = action_mask[state, action] & ((value > largest) | (first < 0))  # the first one, though it be -inf
        largest = value if is_larger else largest
        first = action if is_larger else first
    for action in range(q.shape[1]):
        value = q[state, action]
        is_allowed = action_mask[state, action]
        is_largest = is_allowed & (value == largest)
        bound = max(bound, value if is_allowed & (value != largest) else -np.inf)
        ties += is_largest
    return largest, bound, first, ties


@kernel
def _learn_row(maxima: RowMaxima, agent: AgentArrays, state: int) -> None:
    """Keep what a row of ``agent.q`` (S, A) now is."""
    row = maxima.rows[state]
    row["largest"], row["bound"], row["first"], row["ties"] = largest_allowed(agent.q, agent.action_mask, state)
    row["call"] = maxima.call


@kernel
def _known(maxima: RowMaxima, agent: AgentArrays, state: int) -> tuple[float, int, int]:
    row = maxima.rows[state]
    if is_rare(row["call"] != maxima.call):
        _learn_row(maxima, agent, state)
    return row["largest"], row["first"], row["ties"]


@kernel
def _looked_up(maxima: NoMaxima, agent: AgentArrays, state: int) -> tuple[float, int, int]:
    largest, _, first, ties = largest_allowed(agent.q, agent.action_mask, state)
    return largest, first, ties


maximum = ByKind({RowMaxima: _known, NoMaxima: _looked_up})
"""``maximum(agent.maxima, agent, state)``: the largest value among the allowed actions, the first column, the ties."""


@kernel
def _change_known(maxima: RowMaxima, agent: AgentArrays, state: int, action: int, value: float) -> None:
    """Set an entry of ``agent.q`` (S, A), and say what becomes of its row's maximum."""
    before, row = agent.q[state, action], maxima.rows[state]
    agent.q[state, action] = value
    if row["call"] != maxima.call or (agent.action_mask.size > 0 and not agent.action_mask[state, action]):
        return
    largest = row["largest"]
    if row["ties"] == 1 and row["first"] == action:
        if value > row["bound"]:
            row["largest"] = value
        else:
            _learn_row(maxima, agent, state)
    elif before < largest and value < largest:
        row["bound"] = max(row["bound"], value)
    elif value > largest:
        row["largest"], row["bound"], row["first"], row["ties"] = value, largest, action, 1
    elif value != before:
        _learn_row(maxima, agent, state)


@kernel
def _change(maxima: NoMaxima, agent: AgentArrays, state: int, action: int, value: float) -> None:
    """Set an entry of ``agent.q`` (S, A)."""
    agent.q[state, action] = value


_change_entry = ByKind({RowMaxima: _change_known, NoMaxima: _change})


@kernel
def change_value(agent: AgentArrays, state: int, action: int, value: float) -> None:
    """Set Q(s, a), an entry of ``agent.q`` (S, A)."""
    _change_entry(agent.maxima, agent, state, action, value)


def room_for_maxima(n_states: int, n_actions: int) -> NDArray[np.void] | None:
    """Return room for what is known of rows, (S,) of `ROW`: nothing yet; None where they are not worth following."""
    return np.zeros(n_states, dtype=ROW) if n_actions >= WORTH_FOLLOWING else None


def maxima_bytes(n_states: int, n_actions: int) -> int:
    """Return the bytes of what `room_for_maxima` returns."""
    return n_states * ROW.itemsize if n_actions >= WORTH_FOLLOWING else 0


def maxima_of(rows: NDArray[np.void] | None, call: int) -> RowMaxima | NoMaxima:
    """Return what kernels read in one call of what is known of `rows` (S,), if they are followed."""
    return NoMaxima() if rows is None else RowMaxima(rows, call)
