"""A right learner outside of the package, and wrong ones: all have one state type, so that loops are compiled once."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

import tuckerl
from tuckerl.generalization.change_log import record_change
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import choose, write_probabilities
from tuckerl.training.row_maxima import largest_entries
from tuckerl.types import FloatArray

RIGHT, UNMARKED, MARKED_LATE, BOOTSTRAPS_ENDS, DROPS_TRUNCATED, TAKES_ANY, BELIEVES_ANY, IGNORES_INFINITY, UNSEEDED = (
    range(9)
)
ASCENDS, COUNTS, DETERMINED = range(9, 12)


class ExpectedSarsaState(NamedTuple):
    """What is wrong, and how often the table was updated."""

    fault: int
    updates: FloatArray  # (1,)
    room: FloatArray  # (A,) for the probabilities of the next actions


@tuckerl.kernel
def expected(algorithm: ExpectedSarsaState, agent: AgentArrays, state: int) -> float:
    """The mean value of what may be done next."""
    if algorithm.fault == BELIEVES_ANY:
        return largest_entries(agent.q, state)[0]
    write_probabilities(agent.policy, agent, state, algorithm.room)
    total = 0.0
    for action in range(agent.q.shape[1]):
        if algorithm.room[action] > 0.0:
            total += algorithm.room[action] * agent.q[state, action]
    return total


@tuckerl.kernel
def act(algorithm: ExpectedSarsaState, agent: AgentArrays, state: int) -> int:
    """An action, chosen as the fault wants it."""
    if algorithm.fault == TAKES_ANY:
        return below(agent.q.shape[1], agent.rng)
    if algorithm.fault == UNSEEDED:
        return int(np.random.random() * agent.q.shape[1]) if agent.action_mask.size == 0 else 1  # noqa: NPY002  # that is the fault
    if algorithm.fault == DETERMINED:
        return int(state % 2 % agent.q.shape[1])
    return choose(agent.policy, agent, state)


@tuckerl.kernel
def update(algorithm: ExpectedSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step."""
    fault, q = algorithm.fault, agent.q
    state, action, reward, discount, next_state, ended = transition
    if fault not in (UNMARKED, MARKED_LATE) or (fault == MARKED_LATE and ended):
        record_change(agent.log, state)
    if fault == BOOTSTRAPS_ENDS:
        discount = agent.settings.gamma
    if fault == DROPS_TRUNCATED and ended:
        discount = 0.0
    delta = reward + discount * expected(algorithm, agent, next_state) - q[state, action]
    step_size = agent.step_sizes[action]
    if fault == ASCENDS:
        delta = -reward + discount * largest_entries(q, next_state)[0] - q[state, action]
    algorithm.updates[0] += 1.0
    if fault == COUNTS:
        step_size *= 0.5 + 0.5 / algorithm.updates[0]
    q[state, action] += step_size * delta
    return fault == IGNORES_INFINITY or np.isfinite(q[state, action])


register_algorithm(ExpectedSarsaState, act=act, update=update)


class ExpectedSarsa(Learner):
    """Expected SARSA, right."""

    state_type = ExpectedSarsaState
    fault = RIGHT

    def declare_state(self) -> tuple[Declaration, ...]:
        return (DeclaredArray("updates", "none", (1,)),)

    def constants(self) -> dict[str, Any]:
        return {"fault": self.fault, "room": np.zeros(self.problem.n_actions)}


class Undeclared(ExpectedSarsa):
    """Keeps what it counts where no file finds it."""

    fault = COUNTS

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        self._counts = np.zeros((self.n_agents, 1))

    def declare_state(self) -> tuple[Declaration, ...]:
        return ()

    def algorithm_state(self, declared: Mapping[str, Any], scheduled: FloatArray) -> Any:
        agent = next(i for i, own in enumerate(self.declared) if own is declared)
        return ExpectedSarsaState(updates=self._counts[agent], **self.constants())


class MadeAnew(ExpectedSarsa):
    """Forgets between two calls of learn, and two windows, what it keeps."""

    fault = COUNTS

    def declare_state(self) -> tuple[Declaration, ...]:
        return ()

    def constants(self) -> dict[str, Any]:
        return super().constants() | {"updates": np.zeros(1)}


class OneForAll(ExpectedSarsa):
    """Its agents share what each should have."""

    fault = COUNTS

    def algorithm_state(self, declared: Mapping[str, Any], scheduled: FloatArray) -> Any:
        return super().algorithm_state(self.declared[0], scheduled)


def wrong(fault: int) -> type[Learner]:
    """Expected SARSA with a fault."""
    return type("Wrong", (ExpectedSarsa,), {"fault": fault})
