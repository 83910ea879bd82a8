"""The policy of an algorithm that learns a distribution over actions, as WoLF-PHC does."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.checks import check_real, check_text, shown
from tuckerl.errors import ParameterError
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import is_allowed, random_action, share_among_allowed
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray


class OwnDistributionArrays(NamedTuple):
    """What kernels read of a learned distribution."""

    distribution: FloatArray  # (S, A) what the algorithm learns: each row at least 0
    epsilon: FloatArray  # (1,) the probability of a random action in the present episode


@kernel
def _allowed_sum(policy: OwnDistributionArrays, agent: AgentArrays, state: int) -> float:
    """Return what the allowed actions of a row of ``policy.distribution`` (S, A) have together."""
    total = 0.0
    for action in range(agent.q.shape[1]):
        if is_allowed(agent, state, action):
            total += policy.distribution[state, action]
    return total


@kernel
def choose(policy: OwnDistributionArrays, agent: AgentArrays, state: int) -> int:
    """Draw an action from a row of ``policy.distribution`` (S, A), or a random one with probability epsilon."""
    total = _allowed_sum(policy, agent, state)
    if uniform(agent.rng) < policy.epsilon[0] or not total > 0.0:  # also where it is not a number
        return random_action(agent, state)
    left, chosen = uniform(agent.rng) * total, -1
    for action in range(agent.q.shape[1]):
        if is_allowed(agent, state, action):
            share = policy.distribution[state, action]
            if share > 0.0 and (chosen < 0 or left >= 0.0):
                chosen = action
            left -= share
    return chosen


@kernel
def probabilities(policy: OwnDistributionArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,)."""
    out[:] = 0.0
    total = _allowed_sum(policy, agent, state)
    explored = policy.epsilon[0] if total > 0.0 else 1.0
    share_among_allowed(agent, state, explored, out)
    for action in range(out.size):
        if total > 0.0 and is_allowed(agent, state, action):
            out[action] += (1.0 - explored) * policy.distribution[state, action] / total


register_policy(OwnDistributionArrays, choose=choose, probabilities=probabilities)


class OwnDistribution(Policy):
    """Draw actions from a distribution that the algorithm keeps in one of its declared arrays.

    Parameters
    ----------
    name : str
        The array's name, (S, A), in the algorithm's `declare_state`.
    epsilon : float in [0, 1] or Schedule
        The probability of a random action instead, while learning.
    decay : float in [0, 1]
        Multiplies epsilon after each episode.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a number is out of its range, or one is of the wrong type.
    """

    def __init__(self, name: str, epsilon: float | Schedule = 0.0, decay: float = 1.0) -> None:
        self.decay = check_real("decay", decay, 0.0, 1.0)
        self._schedule = as_schedule("epsilon", epsilon, self.decay)
        self.name, self.epsilon = check_text("name", name), as_number(epsilon)

    def schedules(self) -> dict[str, Schedule]:
        """Return epsilon's schedule."""
        return {"epsilon": self._schedule}

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> OwnDistributionArrays:
        """Return what the kernels read."""
        return OwnDistributionArrays(self._distribution(declared), scheduled)

    def _distribution(self, declared: Mapping[str, Any]) -> FloatArray:
        if self.name not in declared:
            known = ", ".join(map(repr, declared)) or "nothing"
            raise ParameterError(f"{shown(self)} needs an array that the algorithm declares; it declares {known}")
        distribution: FloatArray = declared[self.name]
        return distribution

    def target(self) -> "OwnDistribution":
        """Return the distribution without exploration."""
        return OwnDistribution(self.name)

    def preferences(self, q: FloatArray, declared: Mapping[str, Any]) -> FloatArray:
        """Return the distribution: its largest entries are the most probable actions."""
        return self._distribution(declared)

    def __repr__(self) -> str:
        return f"OwnDistribution({self.name!r}, {self.epsilon!r}, {self.decay!r})"
