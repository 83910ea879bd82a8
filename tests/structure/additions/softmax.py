"""The softmax policy: better actions are likelier (Sutton and Barto 2018, section 2.8)."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import best_value, is_allowed
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.training.schedules import Schedule, as_schedule
from tuckerl.types import FloatArray


class SoftmaxArrays(NamedTuple):
    """What kernels read of a softmax policy."""

    temperature: FloatArray  # (1,)


@kernel
def _weight(policy: SoftmaxArrays, agent: AgentArrays, state: int, action: int, best: float) -> float:
    if not is_allowed(agent, state, action):
        return 0.0
    return math.exp((agent.q[state, action] - best) / policy.temperature[0])


@kernel
def choose(policy: SoftmaxArrays, agent: AgentArrays, state: int) -> int:
    """Draw an action by exp(Q / temperature); ``policy.temperature`` is (1,)."""
    best, total = best_value(agent.q, agent.action_mask, state), 0.0
    for action in range(agent.q.shape[1]):
        total += _weight(policy, agent, state, action, best)
    left, chosen = uniform(agent.rng) * total, -1
    for action in range(agent.q.shape[1]):
        weight = _weight(policy, agent, state, action, best)
        if weight > 0.0 and (chosen < 0 or left >= 0.0):
            chosen = action
        left -= weight
    return max(chosen, 0)


@kernel
def probabilities(policy: SoftmaxArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,)."""
    best, total = best_value(agent.q, agent.action_mask, state), 0.0
    for action in range(out.size):
        out[action] = _weight(policy, agent, state, action, best)
        total += out[action]
    for action in range(out.size):
        out[action] /= total


register_policy(SoftmaxArrays, choose=choose, probabilities=probabilities)


class Softmax(Policy):
    """Draw actions by exp(Q / temperature).

    Parameters
    ----------
    temperature : float in (0, 1] or Schedule
    """

    def __init__(self, temperature: float | Schedule) -> None:
        self.temperature = temperature
        self._schedule = as_schedule("temperature", temperature, positive=True)

    def schedules(self) -> dict[str, Schedule]:
        """Return the temperature's schedule."""
        return {"temperature": self._schedule}

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> SoftmaxArrays:
        """Return what the kernels read."""
        return SoftmaxArrays(scheduled)
