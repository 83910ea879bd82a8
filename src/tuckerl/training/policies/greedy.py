"""The greedy policy: an action of the largest value."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import greedy_action, greedy_value, share_among_greedy
from tuckerl.training.policies.policy import Policy, register_expected_value, register_policy
from tuckerl.types import FloatArray


class GreedyArrays(NamedTuple):
    """The greedy policy needs nothing but the Q-table."""


@kernel
def choose(policy: GreedyArrays, agent: AgentArrays, state: int) -> int:
    """Return an action of the largest value among those that are allowed."""
    return greedy_action(agent, state)


@kernel
def probabilities(policy: GreedyArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the actions into `out` (A,)."""
    out[:] = 0.0
    share_among_greedy(agent, state, 1.0, out)


@kernel
def expected_value(policy: GreedyArrays, agent: AgentArrays, state: int, room: FloatArray) -> float:
    """Return the largest value; `room` (A,) is not needed."""
    return greedy_value(agent, state)


register_policy(GreedyArrays, choose=choose, probabilities=probabilities)
register_expected_value(GreedyArrays, expected_value)


class Greedy(Policy):
    """Always take an action of the largest value; `ties` of the learner says which of several.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), policy=tuckerl.Greedy(), seed=0).learn(episodes=5)
    """

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> GreedyArrays:
        """Return what the kernels read."""
        return GreedyArrays()

    def __repr__(self) -> str:
        return "Greedy()"
