"""Regret: how far what a learner has learned falls short of the best that can be done, exactly.

Over the first states s of episodes, which the problem draws with probability d(s),

    regret = sum over s of d(s) (V*(s) - V_pi(s)),

where pi takes the actions of ``predict(states, deterministic=True)`` (agent 0's greedy actions; of a learner that has
a distribution of its own, the most probable ones), V_pi is its value and V* the optimal value, both discounted by the
learner's gamma and without a time limit. It is 0 exactly if pi is optimal from where episodes begin.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import NoTableError, ParameterTypeError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.solving.policy_value import policy_value
from tuckerl.solving.solve import solve
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray


class Regret(NamedTuple):
    """By how much a learned policy is worth less than an optimal one, where episodes begin."""

    regret: float  # best - reached
    best: float  # V* over the first states
    reached: float  # the value of the learned policy over them


@lru_cache(maxsize=4)  # many learners are judged on the same problem
def _optimal_values(problem: TabularMDP, gamma: float) -> FloatArray:
    return solve(problem, gamma).v


def regret(learner: Learner) -> Regret:
    """Return the regret of what agent 0 of a learner has learned: the mean over first states of V* - V_pi.

    V_pi is the value of the policy that takes the actions of ``predict(states, deterministic=True)``, V* the optimal
    value, both exact, with the learner's gamma and without the time limit. Nothing is played, so there is no interval.

    Parameters
    ----------
    learner : Learner
        Of a problem whose transitions it knows: one with an extracted transition table.

    Raises
    ------
    NoTableError
        If it learned on a simulator or on an environment that is stepped.
    ProblemError
        If gamma is 1, and the learned policy does not end: it says where. Or if there is no best value; see
        :func:`tuckerl.solve`.
    ParameterTypeError
        If it is no learner.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=300)
    >>> tuckerl.regret(agent).regret < 1e-8
    True
    """
    if not isinstance(learner, Learner):
        raise ParameterTypeError(f"learner must be one of tuckerl's learners; got {shown(learner)}")
    problem = learner.problem
    if not isinstance(problem, TabularMDP):
        raise NoTableError(
            f"regret needs the transitions of {problem}, and none are known: it is played by code",
            ". evaluate() judges by the returns of episodes instead",
        )
    gamma = float(learner.gamma)
    actions, _ = learner.predict(np.arange(problem.n_states), deterministic=True)
    states, probabilities = problem.start_distribution()
    best = float(probabilities @ _optimal_values(problem, gamma)[states])
    reached = float(probabilities @ policy_value(problem, actions, gamma)[states])
    return Regret(best - reached, best, reached)
