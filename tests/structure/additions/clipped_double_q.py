"""Clipped double Q-learning (Fujimoto, van Hoof and Meger, ICML 2018), tabular: the smaller of two tables' values."""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.greedy_actions import greedy_action_of
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray


class ClippedDoubleQState(NamedTuple):
    """Two tables; the Q-table, by which the agent acts, is their mean."""

    first: FloatArray  # (S, A)
    second: FloatArray  # (S, A)


@kernel
def update(algorithm: ClippedDoubleQState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Move one of the tables (S, A), drawn evenly, towards the smaller value of the best next action of their mean."""
    state, action, next_state = transition.state, transition.action, transition.next_state
    first, second = algorithm.first, algorithm.second
    best = greedy_action_of(agent.q, agent, next_state)
    target = transition.reward + transition.discount * min(first[next_state, best], second[next_state, best])
    record_change(agent.log, state)
    learning = first if uniform(agent.rng) < 0.5 else second
    learning[state, action] += agent.step_sizes[action] * (target - learning[state, action])
    agent.q[state, action] = 0.5 * (first[state, action] + second[state, action])
    return np.isfinite(agent.q[state, action])


register_algorithm(ClippedDoubleQState, update=update)


class ClippedDoubleQ(Learner):
    """Clipped double Q-learning for one agent or several."""

    state_type = ClippedDoubleQState

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the two tables, which are shared as the Q-table is."""
        return (DeclaredArray("first", "by_entry", initial=None), DeclaredArray("second", "by_entry", initial=None))
