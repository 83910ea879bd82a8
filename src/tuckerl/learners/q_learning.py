r"""Q-learning, the paper's Figure 1; with a tensor step, its Figure 5.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma \max_b Q(s', b) - Q(s, a)]

where omega is 1 without a tensor step. (Watkins and Dayan 1992.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.learner import Learner
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.policies import best_value, epsilon_greedy


class QMethod(NamedTuple):
    """Q-learning keeps nothing but its table."""


@kernel
def update(agent: Agent, state: int, action: int, reward: float, discount: float, next_state: int) -> float:
    """Move Q(s, a) towards its target and return its new value."""
    q = agent.q
    delta = reward + discount * best_value(q, agent.action_mask, next_state) - q[state, action]
    q[state, action] += agent.step_sizes[action] * delta
    return q[state, action]


@kernel
def first(method: QMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose an episode's first action."""
    return epsilon_greedy(agent, state, epsilon)


@kernel
def turn(method: QMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Learn from a step and choose the next action."""
    record_change(agent.log, seen.state)
    value = update(agent, seen.state, seen.action, seen.reward, seen.discount, seen.next_state)
    if not np.isfinite(value):
        return NOT_FINITE
    return 0 if seen.ended else epsilon_greedy(agent, seen.next_state, epsilon)


algorithm(QMethod, first=first, turn=turn)


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

    def _method(self, table: int) -> QMethod:
        return QMethod()
