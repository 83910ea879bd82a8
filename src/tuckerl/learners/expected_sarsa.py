r"""Expected SARSA: SARSA that moves towards the mean over what the policy may do next, in the place of what it does.

.. math::
    Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) \Bigl[r + \gamma \sum_b \pi(b \mid s')\, Q(s', b) - Q(s, a)\Bigr]

where pi is the policy that the agent acts by, whichever it is: with the greedy one this is Q-learning. (Van Seijen et
al. 2009; Sutton and Barto 2018, section 6.6.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import expected_value
from tuckerl.training.row_maxima import change_value
from tuckerl.types import FloatArray


class ExpectedSarsaState(NamedTuple):
    """Room for the policy's probabilities."""

    probabilities: FloatArray  # (A,) overwritten at every step


@kernel
def update(algorithm: ExpectedSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and all that may follow: ``agent.q`` (S, A) changes at the transition's state and action."""
    state, action, reward, discount, next_state, _ = transition
    target = reward + discount * expected_value(agent.policy, agent, next_state, algorithm.probabilities)
    record_change(agent.log, state)
    value = agent.q[state, action]
    value += agent.step_sizes[action] * (target - value)
    change_value(agent, state, action, value)
    return np.isfinite(value)


register_algorithm(ExpectedSarsaState, update=update, keeps_maxima=True)


class ExpectedSarsa(Learner):
    """Expected SARSA for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.training.learner.Learner` for the parameters.

    References
    ----------
    Van Seijen, van Hasselt, Whiteson and Wiering, ADPRL 2009; Sutton and Barto, *Reinforcement Learning*, 2018,
    section 6.6.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.ExpectedSarsa(tuckerl.sutton_maze(), alpha=1.0, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = ExpectedSarsaState

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the room, which nobody shares."""
        return (DeclaredArray("probabilities", "none", ("actions",)),)
