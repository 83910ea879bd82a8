r"""Double Q-learning: of two tables, one chooses the next action and the other one says what it is worth.

.. math::
    Q_1(s, a) \leftarrow Q_1(s, a) + \alpha\,\omega(a)
    \bigl[r + \gamma\,Q_2(s', \arg\max_b Q_1(s', b)) - Q_1(s, a)\bigr]

or the same with the tables exchanged, as a fair coin falls at every step. The largest of several estimates is too large
in the mean; an estimate by numbers that did not choose it is not. The agent acts by the mean of the two: that is its
Q-table, which the tensor step reads. (Van Hasselt 2010; Sutton and Barto 2018, section 6.7.)
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.rng import uniform
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import greedy_action_of
from tuckerl.training.learner import Learner
from tuckerl.training.row_maxima import change_value
from tuckerl.types import FloatArray


class DoubleQLearningState(NamedTuple):
    """The two tables; the agent's Q-table is their mean."""

    first: FloatArray  # (S, A)
    second: FloatArray  # (S, A)


@kernel
def update(algorithm: DoubleQLearningState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step: one of the tables (S, A), drawn evenly, changes at a pair, and so does ``agent.q`` (S, A)."""
    state, action, reward, discount, next_state, _ = transition
    learning, valuing = algorithm.first, algorithm.second
    if uniform(agent.rng) < 0.5:
        learning, valuing = valuing, learning
    best = greedy_action_of(learning, agent, next_state)
    record_change(agent.log, state)
    value = learning[state, action]
    value += agent.step_sizes[action] * (reward + discount * valuing[next_state, best] - value)
    learning[state, action] = value
    mean = 0.5 * value + 0.5 * valuing[state, action]
    change_value(agent, state, action, mean)
    return np.isfinite(mean)


register_algorithm(DoubleQLearningState, update=update, keeps_maxima=True)


class DoubleQLearning(Learner):
    """Double Q-learning for one agent or several, each in its own copy of the problem.

    Both tables begin as `initial_q`. Actions are chosen by their mean, which is `q`, and enters the tensor of a tensor
    step; where agents share, both tables are shared as the mean is.
    See :class:`~tuckerl.training.learner.Learner` for the parameters.

    References
    ----------
    Van Hasselt, *Double Q-learning*, NeurIPS 2010; Sutton and Barto, *Reinforcement Learning*, 2018, section 6.7.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.DoubleQLearning(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=50)
    >>> tables = agent.declared[0]
    >>> bool((agent.q[0] == 0.5 * tables["first"] + 0.5 * tables["second"]).all())
    True
    """

    state_type = DoubleQLearningState

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the two tables, which are shared as their mean is."""
        return (DeclaredArray("first", "by_entry", initial=None), DeclaredArray("second", "by_entry", initial=None))
