r"""Q-learning, the paper's Figure 1; with a tensor step, its Figure 5.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma \max_b Q(s', b) - Q(s, a)]

where omega is 1 without a tensor step. (Watkins and Dayan 1992.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.greedy_actions import greedy_value
from tuckerl.training.learner import Learner
from tuckerl.training.row_maxima import change_value


class QLearningState(NamedTuple):
    """Q-learning keeps nothing but its Q-table."""


@kernel
def move_towards_target(
    agent: AgentArrays, state: int, action: int, reward: float, discount: float, next_state: int
) -> float:
    """Move Q(s, a) towards r + discount max_b Q(s', b) and return its new value.

    Parameters
    ----------
    agent : AgentArrays
        Its `q` (S, A) is changed at (state, action).
    """
    value = agent.q[state, action]
    value += agent.step_sizes[action] * (reward + discount * greedy_value(agent, next_state) - value)
    change_value(agent, state, action, value)
    return value


@kernel
def update(algorithm: QLearningState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step: ``agent.q`` (S, A) changes at the transition's state and action."""
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    return np.isfinite(move_towards_target(agent, state, action, reward, discount, next_state))


register_algorithm(QLearningState, update=update, keeps_maxima=True)


class QLearning(Learner):
    """Q-learning for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.training.learner.Learner` for the parameters.

    References
    ----------
    Watkins and Dayan, Machine Learning 8, 1992; the paper's Figures 1 and 5.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = QLearningState
