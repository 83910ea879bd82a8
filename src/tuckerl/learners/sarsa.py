r"""SARSA, the paper's equation 4, with an update weighted by omega where there is a tensor step.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma Q(s', a') - Q(s, a)]

where a' is the action that is taken in s'. (Rummery and Niranjan 1994; Sutton and Barto 2018, section 6.4.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.learner import Learner
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.policies import epsilon_greedy


class SarsaMethod(NamedTuple):
    """SARSA keeps nothing but its table."""


@kernel
def first(method: SarsaMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose an episode's first action."""
    return epsilon_greedy(agent, state, epsilon)


@kernel
def turn(method: SarsaMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Choose the next action and learn from it (after a truncation, too: its value is bootstrapped)."""
    q, state, action = agent.q, seen.state, seen.action
    next_action = epsilon_greedy(agent, seen.next_state, epsilon)
    record_change(agent.log, state)
    delta = seen.reward + seen.discount * q[seen.next_state, next_action] - q[state, action]
    q[state, action] += agent.step_sizes[action] * delta
    return next_action if np.isfinite(q[state, action]) else NOT_FINITE


algorithm(SarsaMethod, first=first, turn=turn)


class Sarsa(Learner):
    """SARSA for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.training.learner.Learner` for the parameters.

    References
    ----------
    Rummery and Niranjan, CUED/F-INFENG/TR 166, 1994; Sutton and Barto, *Reinforcement Learning*, 2018, section 6.4.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.Sarsa(tuckerl.sutton_maze(), seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    def _method(self, table: int) -> SarsaMethod:
        return SarsaMethod()
