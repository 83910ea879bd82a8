"""WoLF-PHC (Bowling and Veloso, Artificial Intelligence 136, 2002, Table 6): policy hill-climbing at two speeds."""

from typing import Any, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.greedy_actions import best_value, is_allowed
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.own_distribution import OwnDistribution
from tuckerl.training.policies.policy import Policy
from tuckerl.training.schedules import Schedule, as_schedule
from tuckerl.types import FloatArray, IntArray

WIN, LOSE = 0, 1


class WolfPhcState(NamedTuple):
    """A distribution over actions in each state, its average, and how often each state was visited."""

    distribution: FloatArray  # (S, A) pi
    average: FloatArray  # (S, A) the mean of pi so far
    visits: IntArray  # (S,)
    scheduled: FloatArray  # (2,) the step sizes of pi: WIN, LOSE


@kernel
def _value(table: FloatArray, q: FloatArray, state: int) -> float:
    """Return the mean of a row of `q` (S, A) by the distribution in a row of `table` (S, A)."""
    total = 0.0
    for action in range(q.shape[1]):
        if table[state, action] > 0.0:
            total += table[state, action] * q[state, action]
    return total


@kernel
def update(algorithm: WolfPhcState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn Q from a step; then move the state's distribution towards the best action, slowly while it wins.

    Changed are ``agent.q``, ``distribution`` and ``average``, (S, A), and ``visits`` (S,), all at the state.
    """
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    value = move_towards_target(agent, state, action, reward, discount, next_state)
    pi, average, n_actions = algorithm.distribution, algorithm.average, agent.q.shape[1]
    algorithm.visits[state] += 1
    for other in range(n_actions):
        average[state, other] += (pi[state, other] - average[state, other]) / algorithm.visits[state]
    wins = _value(pi, agent.q, state) > _value(average, agent.q, state)
    best = best_value(agent.q, agent.action_mask, state)
    best_action = 0
    while agent.q[state, best_action] != best or not is_allowed(agent, state, best_action):
        if best != best or best == -np.inf:  # not a number: there is no best action
            return False
        best_action += 1
    moved = 0.0
    for other in range(n_actions):
        if other != best_action:
            part = min(pi[state, other], algorithm.scheduled[WIN if wins else LOSE] / max(n_actions - 1, 1))
            pi[state, other] -= part
            moved += part
    pi[state, best_action] += moved
    return np.isfinite(value)


register_algorithm(WolfPhcState, update=update)


class WolfPhc(Learner):
    """WoLF-PHC for one agent or several; what it plays is its own distribution.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    delta_win, delta_lose : float in (0, 1] or Schedule
        How far the distribution moves at a step, while its value is above that of the average one, and else.
    """

    state_type = WolfPhcState

    def __init__(
        self,
        env: Environment,
        *,
        delta_win: float | Schedule = 0.05,
        delta_lose: float | Schedule = 0.2,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.delta_win, self.delta_lose = delta_win, delta_lose
        super().__init__(env, **parameters)

    def algorithm_schedules(self) -> dict[str, Schedule]:
        """Return the step sizes of the distribution."""
        win, lose = (as_schedule(name, getattr(self, name), positive=True) for name in ("delta_win", "delta_lose"))
        return {"delta_win": win, "delta_lose": lose}

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the distributions, which stay such when they are mixed, and the visits, of the heaviest agent."""
        uniform = 1.0 / self.problem.n_actions
        return (
            DeclaredArray("distribution", "by_row", initial=uniform),
            DeclaredArray("average", "by_row", initial=uniform),
            DeclaredArray("visits", "heaviest", ("states",), np.int64),
        )

    def default_policy(self, policy: Policy) -> Policy:
        """Return the policy that draws from the distribution, and explores as the default policy does."""
        given: Any = policy
        return OwnDistribution("distribution", given.epsilon, given.decay)
