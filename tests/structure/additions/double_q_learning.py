"""Double Q-learning (van Hasselt, NeurIPS 2010): one table chooses the next action, the other one values it."""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.greedy_actions import best_value, is_allowed
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray


class DoubleQLearningState(NamedTuple):
    """Two tables; the Q-table, by which the agent acts, is their mean."""

    first: FloatArray  # (S, A)
    second: FloatArray  # (S, A)


@kernel
def update(algorithm: DoubleQLearningState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Move one of the tables (S, A), drawn evenly, towards the other's value of its own best next action."""
    state, action, next_state = transition.state, transition.action, transition.next_state
    learning, valuing = algorithm.first, algorithm.second
    if uniform(agent.rng) < 0.5:
        learning, valuing = valuing, learning
    best, best_action = best_value(learning, agent.action_mask, next_state), 0
    while learning[next_state, best_action] != best or not is_allowed(agent, next_state, best_action):
        best_action += 1
    delta = transition.reward + transition.discount * valuing[next_state, best_action] - learning[state, action]
    record_change(agent.log, state)
    learning[state, action] += agent.step_sizes[action] * delta
    agent.q[state, action] = 0.5 * (learning[state, action] + valuing[state, action])
    return np.isfinite(agent.q[state, action])


register_algorithm(DoubleQLearningState, update=update)


class DoubleQLearning(Learner):
    """Double Q-learning for one agent or several."""

    state_type = DoubleQLearningState

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the two tables, which are shared as the Q-table is."""
        return (DeclaredArray("first", "by_entry", initial=None), DeclaredArray("second", "by_entry", initial=None))
