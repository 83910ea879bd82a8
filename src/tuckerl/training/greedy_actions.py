"""Greedy and random actions: the largest entry of a row, ties, action masks.

Where all actions may be taken, `action_mask` has no entries and costs one test.
"""

import numpy as np

from tuckerl._jit import kernel
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.types import BoolArray, FloatArray, Stream


@kernel
def row_max(table: FloatArray, row: int) -> float:
    """Return the largest entry of a row of `table`, (R, C) float64."""
    best = table[row, 0]
    for column in range(1, table.shape[1]):
        best = max(best, table[row, column])
    return best


@kernel
def maxima(table: FloatArray, row: int) -> tuple[int, int]:
    """Return the first column of a row's largest entry, and in how many columns that entry stands.

    Parameters
    ----------
    table : (R, C) float64
    row : int
    """
    # Two passes without a branch that depends on the values: twice as fast as one pass that mispredicts.
    best = row_max(table, row)
    first, ties = 0, 0
    for column in range(table.shape[1] - 1, -1, -1):
        if table[row, column] == best:
            first = column
            ties += 1
    return first, ties


@kernel
def random_maximum(table: FloatArray, row: int, first: int, ties: int, rng: Stream) -> int:
    """Draw one of the columns that `maxima` counted.

    Parameters
    ----------
    table : (R, C) float64
    row : int
    first, ties : int
        What `maxima` returned.
    rng : (4,) uint64
        Moves on where there are several.
    """
    if ties == 1:
        return first
    skip = below(ties, rng)
    column = first
    while skip > 0:
        column += 1
        if table[row, column] == table[row, first]:
            skip -= 1
    return column


@kernel
def best_value(q: FloatArray, action_mask: BoolArray, state: int) -> float:
    """Return the largest value of the actions that may be taken in a state.

    Parameters
    ----------
    q : (S, A) float64
    action_mask : (S, A) bool
        True where an action may be taken; (0, 0) where all may.
    state : int
    """
    if action_mask.size == 0:
        return row_max(q, state)
    best = -np.inf
    for action in range(q.shape[1]):
        if action_mask[state, action]:
            best = max(best, q[state, action])
    return best


@kernel
def greedy_action(agent: AgentArrays, state: int) -> int:
    """Return an action of the largest value among those that may be taken."""
    if agent.action_mask.size > 0:
        return _greedy_allowed(agent, state)
    first, ties = maxima(agent.q, state)
    return random_maximum(agent.q, state, first, ties, agent.rng) if agent.settings.random_ties else first


@kernel
def _greedy_allowed(agent: AgentArrays, state: int) -> int:
    q, action_mask = agent.q, agent.action_mask
    best, ties, first = best_value(q, action_mask, state), 0, 0
    for action in range(q.shape[1] - 1, -1, -1):
        if action_mask[state, action] and q[state, action] == best:
            first = action
            ties += 1
    if ties <= 1 or not agent.settings.random_ties:
        return first
    skip = below(ties, agent.rng)
    action = first
    while skip > 0:
        action += 1
        if action_mask[state, action] and q[state, action] == best:
            skip -= 1
    return action


@kernel
def random_action(agent: AgentArrays, state: int) -> int:
    """Draw one of the actions that may be taken."""
    if agent.action_mask.size == 0:
        return below(agent.q.shape[1], agent.rng)
    n_allowed = 0
    for action in range(agent.q.shape[1]):
        n_allowed += agent.action_mask[state, action]
    skip = below(n_allowed, agent.rng)
    action = 0
    while skip > 0 or not agent.action_mask[state, action]:
        skip -= agent.action_mask[state, action]
        action += 1
    return action


@kernel
def is_allowed(agent: AgentArrays, state: int, action: int) -> bool:
    """Return whether an action may be taken."""
    return agent.action_mask.size == 0 or agent.action_mask[state, action]


@kernel
def share_among_allowed(agent: AgentArrays, state: int, probability: float, out: FloatArray) -> None:
    """Add a probability to `out` (A,), divided evenly among the actions that may be taken."""
    n_allowed = 0
    for action in range(out.size):
        n_allowed += is_allowed(agent, state, action)
    for action in range(out.size):
        if is_allowed(agent, state, action):
            out[action] += probability / n_allowed


@kernel
def share_among_greedy(agent: AgentArrays, state: int, probability: float, out: FloatArray) -> None:
    """Add a probability to `out` (A,): to the first greedy action, or divided evenly where ties are random."""
    best, n_best = best_value(agent.q, agent.action_mask, state), 0
    for action in range(out.size):
        if _is_best(agent, state, action, best):
            n_best += 1
    for action in range(out.size):
        if _is_best(agent, state, action, best):
            out[action] += probability / n_best if agent.settings.random_ties else probability
            if not agent.settings.random_ties:
                return


@kernel
def _is_best(agent: AgentArrays, state: int, action: int, best: float) -> bool:
    return is_allowed(agent, state, action) and agent.q[state, action] == best
