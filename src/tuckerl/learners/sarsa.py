r"""SARSA, the paper's equation 4, with an update weighted by omega where there is a tensor step.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma Q(s', a') - Q(s, a)]

where a' is the action that is taken in s'. (Rummery and Niranjan 1994; Sutton and Barto 2018, section 6.4.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.learner import Learner
from tuckerl.training.row_maxima import change_value


class SarsaState(NamedTuple):
    """SARSA keeps nothing but its Q-table."""


@kernel
def update(algorithm: SarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and the action after it: ``agent.q`` (S, A) changes at the transition's state and action."""
    q, state, action = agent.q, transition.state, transition.action
    record_change(agent.log, state)
    target = transition.reward + transition.discount * q[transition.next_state, next_action]
    value = q[state, action] + agent.step_sizes[action] * (target - q[state, action])
    change_value(agent, state, action, value)
    return np.isfinite(value)


register_algorithm(SarsaState, update=update, on_policy=True, keeps_maxima=True)


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

    state_type = SarsaState
