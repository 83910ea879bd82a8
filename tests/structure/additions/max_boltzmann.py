"""Max-Boltzmann exploration: softmax with probability epsilon, else greedy (Wiering 1999, section 4.3)."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import greedy_action, share_among_greedy
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.training.policies.softmax import SoftmaxArrays
from tuckerl.training.policies.softmax import choose as choose_softly
from tuckerl.training.policies.softmax import probabilities as soft_probabilities
from tuckerl.training.schedules import Schedule, as_schedule
from tuckerl.types import FloatArray


class MaxBoltzmannArrays(NamedTuple):
    """What kernels read of max-Boltzmann exploration."""

    epsilon: FloatArray  # (1,)
    softmax: SoftmaxArrays


@kernel
def choose(policy: MaxBoltzmannArrays, agent: AgentArrays, state: int) -> int:
    """Explore by softmax with probability ``policy.epsilon`` (1,)."""
    if uniform(agent.rng) < policy.epsilon[0]:
        return choose_softly(policy.softmax, agent, state)
    return greedy_action(agent, state)


@kernel
def probabilities(policy: MaxBoltzmannArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,)."""
    soft_probabilities(policy.softmax, agent, state, out)
    for action in range(out.size):
        out[action] *= policy.epsilon[0]
    share_among_greedy(agent, state, 1.0 - policy.epsilon[0], out)


register_policy(MaxBoltzmannArrays, choose=choose, probabilities=probabilities)


class MaxBoltzmann(Policy):
    """Draw actions by exp(Q / temperature) with probability epsilon, else take a greedy one.

    Parameters
    ----------
    epsilon : float in [0, 1] or Schedule
    temperature : float above 0, or Schedule
    """

    def __init__(self, epsilon: float | Schedule, temperature: float | Schedule) -> None:
        self.epsilon, self.temperature = epsilon, temperature
        self._schedules = {
            "epsilon": as_schedule("epsilon", epsilon),
            "temperature": as_schedule("temperature", temperature, positive=True, highest=math.inf),
        }

    def schedules(self) -> dict[str, Schedule]:
        """Return both schedules."""
        return dict(self._schedules)

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> MaxBoltzmannArrays:
        """Return what the kernels read."""
        return MaxBoltzmannArrays(scheduled[:1], SoftmaxArrays(scheduled[1:]))
