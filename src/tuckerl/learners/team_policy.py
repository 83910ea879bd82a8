"""Epsilon-greedy for the agents of a team, each of which explores on its own."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.rng import below, uniform
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import greedy_action, share_among_greedy
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy
from tuckerl.training.policies.policy import register_policy
from tuckerl.types import FloatArray, IntArray


class TeamEpsilonGreedyArrays(NamedTuple):
    """What kernels read of a team of M agents that explore independently."""

    epsilon: FloatArray  # (1,) each agent's probability of a random action in the present episode
    sizes: IntArray  # (M,) how many actions each agent has
    parts: IntArray  # (M,) room for the agents' parts of a joint action
    greedy: FloatArray  # (A,) room for the probabilities of the greedy joint actions


@kernel
def choose(policy: TeamEpsilonGreedyArrays, agent: AgentArrays, state: int) -> int:
    """Return a joint action: each agent's part is random with probability epsilon, else that of the greedy one.

    Parameters
    ----------
    policy : TeamEpsilonGreedyArrays
        Its `parts` (M,) are overwritten.
    agent : AgentArrays
    state : int
    """
    sizes, parts, n_exploring, place = policy.sizes, policy.parts, 0, agent.q.shape[1]
    for i in range(sizes.size):
        parts[i] = -1
        place //= sizes[i]
        if uniform(agent.rng) < policy.epsilon[0]:
            parts[i] = _random_part(agent, state, sizes[i], place)
            n_exploring += 1
    joint = greedy_action(agent, state) if n_exploring < sizes.size else 0
    action, place = 0, 1
    for i in range(sizes.size - 1, -1, -1):  # C order: the last agent's part counts ones
        part = parts[i] if parts[i] >= 0 else joint % sizes[i]
        joint //= sizes[i]
        action += part * place
        place *= sizes[i]
    return action


@kernel
def _random_part(agent: AgentArrays, state: int, size: int, place: int) -> int:
    """Draw what one of the team's agents may do; its part counts `place` in a joint action.

    The agents' masks are independent of each other: a part may be taken where any joint action with it may.
    """
    if agent.action_mask.size == 0:
        return below(size, agent.rng)
    n_allowed = _count_allowed_parts(agent, state, size, place)
    skip = below(n_allowed, agent.rng)
    part = 0
    while skip > 0 or not _part_is_allowed(agent, state, part, size, place):
        skip -= _part_is_allowed(agent, state, part, size, place)
        part += 1
    return part


@kernel
def _count_allowed_parts(agent: AgentArrays, state: int, size: int, place: int) -> int:
    n_allowed = 0
    for part in range(size):
        n_allowed += _part_is_allowed(agent, state, part, size, place)
    return n_allowed


@kernel
def _part_is_allowed(agent: AgentArrays, state: int, part: int, size: int, place: int) -> bool:
    """Return whether ``agent.action_mask`` (S, A), or (0, 0), allows a joint action with this part."""
    if agent.action_mask.size == 0:
        return True
    for action in range(agent.q.shape[1]):
        if action // place % size == part and agent.action_mask[state, action]:
            return True
    return False


@kernel
def probabilities(policy: TeamEpsilonGreedyArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write the probabilities of the joint actions into `out` (A,); ``policy.greedy`` (A,) is overwritten.

    Given the greedy joint action, the agents' parts are independent: each is greedy or random.
    """
    policy.greedy[:] = 0.0
    share_among_greedy(agent, state, 1.0, policy.greedy)
    out[:] = 0.0
    for joint in range(out.size):
        if policy.greedy[joint] > 0.0:
            for action in range(out.size):
                out[action] += policy.greedy[joint] * _given_greedy(policy, agent, state, joint, action)


@kernel
def _given_greedy(policy: TeamEpsilonGreedyArrays, agent: AgentArrays, state: int, joint: int, action: int) -> float:
    """Return the probability of a joint action where `joint` is the greedy one."""
    probability, place = 1.0, agent.q.shape[1]
    for i in range(policy.sizes.size):
        size = policy.sizes[i]
        place //= size
        part = action // place % size
        own = 0.0
        if _part_is_allowed(agent, state, part, size, place):
            own = policy.epsilon[0] / _count_allowed_parts(agent, state, size, place)
        if part == joint // place % size:
            own += 1.0 - policy.epsilon[0]
        probability *= own
    return probability


register_policy(TeamEpsilonGreedyArrays, choose=choose, probabilities=probabilities)


class TeamEpsilonGreedy(EpsilonGreedy):
    """Each agent of a team explores on its own, or else plays its part of the greedy joint action.

    Parameters
    ----------
    policy : EpsilonGreedy
        Each agent's.
    sizes : tuple of int
        How many actions each of M agents has.
    """

    def __init__(self, policy: EpsilonGreedy, sizes: tuple[int, ...]) -> None:
        super().__init__(policy.epsilon, policy.decay)
        self.sizes = sizes

    def __repr__(self) -> str:
        return f"TeamEpsilonGreedy({super().__repr__()}, {self.sizes})"

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> Any:
        """Return what the kernels read."""
        sizes = np.array(self.sizes, dtype=np.int64)
        return TeamEpsilonGreedyArrays(scheduled, sizes, np.zeros_like(sizes), np.zeros(int(np.prod(sizes))))
