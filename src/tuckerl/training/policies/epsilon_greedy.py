"""The epsilon-greedy policy: mostly greedy, now and then a random action (Sutton and Barto 2018, section 2.2)."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import (
    greedy_action,
    greedy_value,
    random_action,
    share_among_allowed,
    share_among_greedy,
    sum_of_values,
)
from tuckerl.training.policies.policy import Policy, register_expected_value, register_policy
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray


class EpsilonGreedyArrays(NamedTuple):
    """What kernels read of an epsilon-greedy policy."""

    epsilon: FloatArray  # (1,) the probability of a random action in the present episode


@kernel
def choose(policy: EpsilonGreedyArrays, agent: AgentArrays, state: int) -> int:
    """Return a random action with probability ``policy.epsilon`` (1,), else a greedy one."""
    if uniform(agent.rng) < policy.epsilon[0]:
        return random_action(agent, state)
    return greedy_action(agent, state)


@kernel
def probabilities(policy: EpsilonGreedyArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,); the greedy ones share what exploring leaves."""
    out[:] = 0.0
    share_among_allowed(agent, state, policy.epsilon[0], out)
    share_among_greedy(agent, state, 1.0 - policy.epsilon[0], out)


@kernel
def expected_value(policy: EpsilonGreedyArrays, agent: AgentArrays, state: int, room: FloatArray) -> float:
    """Return epsilon times the mean value plus what is left of it times the largest; `room` (A,) is not needed."""
    epsilon, (total, n_allowed) = policy.epsilon[0], sum_of_values(agent, state)
    return epsilon / n_allowed * total + (1.0 - epsilon) * greedy_value(agent, state)


register_policy(EpsilonGreedyArrays, choose=choose, probabilities=probabilities)
register_expected_value(EpsilonGreedyArrays, expected_value)


class EpsilonGreedy(Policy):
    """Take a random action with probability epsilon, else a greedy one: the default of all learners.

    Parameters
    ----------
    epsilon : float in [0, 1] or Schedule
    decay : float in [0, 1]
        Multiplies epsilon after each episode.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a number is outside [0, 1], or a schedule is to decay as well.

    Examples
    --------
    >>> import tuckerl
    >>> policy = tuckerl.EpsilonGreedy(tuckerl.Linear(1.0, 0.1, episodes=50))
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), policy=policy, seed=0).learn(episodes=5)
    """

    def __init__(self, epsilon: float | Schedule = 0.1, decay: float = 1.0) -> None:
        self._schedule = as_schedule("epsilon", epsilon, decay)
        self.epsilon, self.decay = as_number(epsilon), float(decay)

    def schedules(self) -> dict[str, Schedule]:
        """Return epsilon's schedule."""
        return {"epsilon": self._schedule}

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> EpsilonGreedyArrays:
        """Return what the kernels read."""
        return EpsilonGreedyArrays(scheduled)

    def __repr__(self) -> str:
        return (
            f"EpsilonGreedy({self.epsilon!r})"
            if self.decay == 1.0
            else f"EpsilonGreedy({self.epsilon!r}, {self.decay!r})"
        )
