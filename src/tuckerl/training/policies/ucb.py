r"""Upper confidence bounds: the action that could be the best, as far as is known.

.. math:: a = \arg\max_a \Bigl[ Q(s, a) + c \sqrt{\frac{\ln t(s)}{n(s, a)}} \Bigr]

where n(s, a) is how often a was chosen in s, and t(s) the number of choices there, this one included. Actions that were
never chosen come first. (Auer, Cesa-Bianchi and Fischer 2002; Sutton and Barto 2018, section 2.7, of bandits: here
every state is one.)
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, keep_row
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.greedy_actions import is_allowed
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray, IntArray

_CHOICES = "ucb.choices"
_MOST = 2**53  # as floats count


class UCBArrays(NamedTuple):
    """What kernels read of upper confidence bounds."""

    choices: IntArray  # (S, A) how often each action was chosen, changed by `choose`
    c: FloatArray  # (1,) how wide the bounds are, in the present episode


@kernel
def _log_time(policy: UCBArrays, agent: AgentArrays, state: int) -> float:
    """Return ln t(s), of the choices of actions that may be taken now."""
    total = 1
    for action in range(agent.q.shape[1]):
        if is_allowed(agent, state, action):
            total += policy.choices[state, action]
    return math.log(total)


@kernel
def _bound(policy: UCBArrays, agent: AgentArrays, state: int, action: int, log_time: float) -> float:
    """Return how good an action may be: infinitely, if it was never chosen; not at all, if it may not be taken."""
    if not is_allowed(agent, state, action):
        return -np.inf
    count = policy.choices[state, action]
    if count == 0:
        return np.inf
    return agent.q[state, action] + policy.c[0] * math.sqrt(log_time / count)


@kernel
def _best(policy: UCBArrays, agent: AgentArrays, state: int, log_time: float) -> tuple[float, int, int]:
    """Return the largest bound, the first allowed action that has it, and how many have it."""
    best, first, ties = -np.inf, -1, 0
    for action in range(agent.q.shape[1]):
        if is_allowed(agent, state, action):
            bound = _bound(policy, agent, state, action, log_time)
            if first < 0 or bound > best:
                best, first, ties = bound, action, 1
            else:
                ties += bound == best
    return best, first, ties


@kernel
def choose(policy: UCBArrays, agent: AgentArrays, state: int) -> int:
    """Return an action of the largest bound, and count it in ``policy.choices`` (S, A)."""
    log_time = _log_time(policy, agent, state)
    best, action, ties = _best(policy, agent, state, log_time)
    skip = below(ties, agent.rng) if ties > 1 and agent.settings.random_ties else 0
    while skip > 0:
        action += 1
        skip -= is_allowed(agent, state, action) and _bound(policy, agent, state, action, log_time) == best
    _count(policy, agent.log, state, action)
    return action


@kernel
def _count(policy: UCBArrays, log: ChangeLog, state: int, action: int) -> None:
    keep_row(log, state)  # for an episode that is broken off; a choice alone changes no row of Q
    policy.choices[state, action] += 1


@kernel
def probabilities(policy: UCBArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,); where ties are random, they share."""
    log_time = _log_time(policy, agent, state)
    best, first, ties = _best(policy, agent, state, log_time)
    for action in range(out.size):
        is_best = is_allowed(agent, state, action) and _bound(policy, agent, state, action, log_time) == best
        out[action] = 1.0 / ties if is_best and agent.settings.random_ties else 0.0
    if not agent.settings.random_ties:
        out[first] = 1.0


register_policy(UCBArrays, choose=choose, probabilities=probabilities)


class UCB(Policy):
    """Take the action of the largest upper confidence bound, counting in each state how often each was chosen.

    Parameters
    ----------
    c : float from 0, or Schedule
        How wide the bounds are, in units of the returns; with 0 the policy is greedy once everything was tried.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is negative, or of the wrong type.

    Notes
    -----
    The counts are saved with the learner, and go along where agents share their tables: with a copy, the copied
    agent's; with a mixture, those of the agent of the largest weight.

    References
    ----------
    Auer, Cesa-Bianchi and Fischer, Machine Learning 47, 2002; Sutton and Barto, Reinforcement Learning, 2nd edition,
    2018, section 2.7.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), policy=tuckerl.UCB(c=0.1), seed=0).learn(episodes=50)
    """

    def __init__(self, c: float | Schedule = 1.0) -> None:
        self._schedule = as_schedule("c", c, highest=math.inf)
        self.c = as_number(c)

    def schedules(self) -> dict[str, Schedule]:
        """Return the schedule of `c`."""
        return {"c": self._schedule}

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the counts of choices."""
        return (DeclaredArray(_CHOICES, "heaviest", dtype=np.int64, bounds=(0, _MOST)),)

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> UCBArrays:
        """Return what the kernels read."""
        return UCBArrays(declared[_CHOICES], scheduled)

    def __repr__(self) -> str:
        return f"UCB({self.c!r})"
