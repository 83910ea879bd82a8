"""A right learner outside of the package, and wrong ones: all have one method, so that loops are compiled once."""

from typing import Any, NamedTuple

import numpy as np

import tuckerl
from tuckerl.generalization.change_log import record_change
from tuckerl.rng import below
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.learner import Learner
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.policies import epsilon_greedy, row_max
from tuckerl.types import FloatArray

RIGHT, UNMARKED, MARKED_LATE, BOOTSTRAPS_ENDS, DROPS_TRUNCATED, TAKES_ANY, BELIEVES_ANY, IGNORES_INFINITY, UNSEEDED = (
    range(9)
)
ASCENDS, COUNTS, DETERMINED = range(9, 12)


class Method(NamedTuple):
    """What is wrong, and how often the table was updated."""

    fault: int
    updates: FloatArray  # (1,)


@tuckerl.kernel
def expected(agent: Agent, fault: int, state: int, epsilon: float) -> float:
    """The mean value of what may be done next."""
    q, masked = agent.q, agent.action_mask.size > 0 and fault != BELIEVES_ANY
    n_allowed, total, best = 0, 0.0, -np.inf
    for action in range(q.shape[1]):
        if not masked or agent.action_mask[state, action]:
            n_allowed += 1
            total += q[state, action]
            best = max(best, q[state, action])
    return epsilon * total / n_allowed + (1.0 - epsilon) * best


@tuckerl.kernel
def choose(method: Method, agent: Agent, state: int, epsilon: float) -> int:
    """An action, chosen as the fault wants it."""
    if method.fault == TAKES_ANY:
        return below(agent.q.shape[1], agent.rng)
    if method.fault == UNSEEDED:
        return int(np.random.random() * agent.q.shape[1]) if agent.action_mask.size == 0 else 1  # noqa: NPY002  # that is the fault
    if method.fault == DETERMINED:
        return int(state % 2 % agent.q.shape[1])
    return epsilon_greedy(agent, state, epsilon)


@tuckerl.kernel
def turn(method: Method, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Learn from a step."""
    fault, q = method.fault, agent.q
    state, action, reward, discount, next_state, ended = seen
    if fault not in (UNMARKED, MARKED_LATE) or (fault == MARKED_LATE and ended):
        record_change(agent.log, state)
    if fault == BOOTSTRAPS_ENDS:
        discount = agent.settings.gamma
    if fault == DROPS_TRUNCATED and ended:
        discount = 0.0
    delta = reward + discount * expected(agent, fault, next_state, epsilon) - q[state, action]
    rate = agent.step_sizes[action]
    if fault == ASCENDS:
        delta = -reward + discount * row_max(q, next_state) - q[state, action]
    if fault == COUNTS:
        method.updates[0] += 1.0
        rate *= 0.5 + 0.5 / method.updates[0]
    q[state, action] += rate * delta
    if not np.isfinite(q[state, action]) and fault != IGNORES_INFINITY:
        return NOT_FINITE
    return 0 if ended else choose(method, agent, next_state, epsilon)


algorithm(Method, first=choose, turn=turn)


class ExpectedSarsa(Learner):
    """Expected SARSA, right."""

    fault = RIGHT

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        self._counts = np.zeros((self.n_tables, 1))

    def _method(self, table: int) -> Method:
        return Method(self.fault, self._counts[table])


def wrong(fault: int) -> type[Learner]:
    """Expected SARSA with a fault."""
    return type("Wrong", (ExpectedSarsa,), {"fault": fault})
