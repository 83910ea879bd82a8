"""Greedy and random actions: the largest entry of a row, ties, action masks.

Where all actions may be taken, `action_mask` has no entries and costs one test.
"""

from tuckerl._jit import kernel
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.row_maxima import largest_allowed, maximum
from tuckerl.types import BoolArray, FloatArray


@kernel
def best_value(q: FloatArray, action_mask: BoolArray, state: int) -> float:
    """Return the largest value of the actions that may be taken in a state, of any table.

    Parameters
    ----------
    q : (S, A) float64
    action_mask : (S, A) bool
        True where an action may be taken; (0, 0) where all may.
    state : int
    """
    return largest_allowed(q, action_mask, state)[0]


@kernel
def greedy_value(agent: AgentArrays, state: int) -> float:
    """Return the largest value among the actions that may be taken, of the agent's own table."""
    return maximum(agent.maxima, agent, state)[0]


@kernel
def sum_of_values(agent: AgentArrays, state: int) -> tuple[float, int]:
    """Return the sum of the values among the actions that may be taken, of the own table, and their number."""
    total, other, n_actions = 0.0, 0.0, agent.q.shape[1]
    if agent.action_mask.size == 0:
        for pair in range(n_actions // 2):  # two sums, as each addition waits for the one before it
            total += agent.q[state, 2 * pair]
            other += agent.q[state, 2 * pair + 1]
        return total + other + (agent.q[state, n_actions - 1] if n_actions % 2 == 1 else 0.0), n_actions
    n_allowed = 0
    for action in range(n_actions):
        if agent.action_mask[state, action]:
            total += agent.q[state, action]
            n_allowed += 1
    return total, n_allowed


@kernel
def greedy_action(agent: AgentArrays, state: int) -> int:
    """Return an action of the largest value among those that may be taken."""
    best, first, ties = maximum(agent.maxima, agent, state)
    return _one_of(agent.q, agent, state, best, first, ties)


@kernel
def greedy_action_of(q: FloatArray, agent: AgentArrays, state: int) -> int:
    """Return an action of the largest value among those that the agent may take, of any table.

    Parameters
    ----------
    q : (S, A) float64
    agent : AgentArrays
    state : int
    """
    best, _, first, ties = largest_allowed(q, agent.action_mask, state)
    return _one_of(q, agent, state, best, first, ties)


@kernel
def _one_of(q: FloatArray, agent: AgentArrays, state: int, best: float, first: int, ties: int) -> int:
    """Return the first or, where ties are random, any of the actions whose value in `q` (S, A) is the best."""
    if ties <= 1 or not agent.settings.random_ties:
        return first
    skip = below(ties, agent.rng)
    action = first
    while skip > 0 and action < q.shape[1] - 1:
        action += 1
        skip -= q[state, action] == best and is_allowed(agent, state, action)
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
    best, n_best = greedy_value(agent, state), 0
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
