r"""The softmax, or Boltzmann, policy: better actions more often, by how much better they are.

.. math:: \pi(a \mid s) = \frac{e^{Q(s, a) / \tau}}{\sum_b e^{Q(s, b) / \tau}}

over the actions that may be taken, tau being the temperature. (Sutton and Barto 2018, section 2.8 and exercise 13.3.)
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import greedy_value, is_allowed
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray


class SoftmaxArrays(NamedTuple):
    """What kernels read of a softmax policy."""

    temperature: FloatArray  # (1,) in units of the returns, in the present episode


@kernel
def _weight(policy: SoftmaxArrays, agent: AgentArrays, state: int, action: int, best: float) -> float:
    """Return e^((Q - best) / temperature), from 0 to 1: 1 for the best, so that no sum leaves the range of floats."""
    if not is_allowed(agent, state, action):
        return 0.0
    value = agent.q[state, action]
    return 1.0 if value == best else math.exp((value - best) / policy.temperature[0])


@kernel
def choose(policy: SoftmaxArrays, agent: AgentArrays, state: int) -> int:
    """Draw an action by its weight, with one number from ``agent.rng`` (4,)."""
    best, total = greedy_value(agent, state), 0.0
    for action in range(agent.q.shape[1]):
        total += _weight(policy, agent, state, action, best)
    left, chosen = uniform(agent.rng) * total, -1
    for action in range(agent.q.shape[1]):
        weight = _weight(policy, agent, state, action, best)
        if weight > 0.0 and (chosen < 0 or left >= 0.0):  # by rounding, something may be left after the last
            chosen = action
        left -= weight
        if left < 0.0:
            break
    return chosen


@kernel
def probabilities(policy: SoftmaxArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,)."""
    best, total = greedy_value(agent, state), 0.0
    for action in range(out.size):
        out[action] = _weight(policy, agent, state, action, best)
        total += out[action]
    for action in range(out.size):
        out[action] /= total


register_policy(SoftmaxArrays, choose=choose, probabilities=probabilities)


class Softmax(Policy):
    """Draw actions by e^(Q / temperature): better ones more often, whatever their number.

    Parameters
    ----------
    temperature : float above 0, or Schedule
        How large a difference of values matters, in units of the returns: far above it the policy is greedy, far below
        it random. A schedule must stay above 0.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is not above 0, or of the wrong type.

    References
    ----------
    Sutton and Barto, Reinforcement Learning, 2nd edition, 2018, sections 2.8 and 13.1.

    Examples
    --------
    >>> import tuckerl
    >>> policy = tuckerl.Softmax(tuckerl.Exponential(5.0, decay=0.98, minimum=0.1))
    >>> agent = tuckerl.QLearning("Taxi-v4", policy=policy, seed=0).learn(episodes=5)
    """

    def __init__(self, temperature: float | Schedule) -> None:
        self._schedule = as_schedule("temperature", temperature, positive=True, highest=math.inf)
        self.temperature = as_number(temperature)

    def schedules(self) -> dict[str, Schedule]:
        """Return the temperature's schedule."""
        return {"temperature": self._schedule}

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> SoftmaxArrays:
        """Return what the kernels read."""
        return SoftmaxArrays(scheduled)

    def __repr__(self) -> str:
        return f"Softmax({self.temperature!r})"
