r"""HAQL, heuristically accelerated Q-learning: Q-learning whose choice of actions a heuristic helps.

.. math::
    a = \arg\max_b [Q(s, b) + \xi H(s, b)], \qquad
    H(s, b) = \begin{cases} \max_c Q(s, c) - Q(s, b) + \eta & \text{if the heuristic suggests } b \\ 0 \end{cases}

where Q-learning takes the largest Q. What is learned is Q-learning's; the heuristic only decides where experience comes
from. (Bianchi, Ribeiro and Costa 2004 and 2008.)

Here a heuristic is a distance of each state from the goal, as in Dyna-H. It suggests the action that has led nearest to
the goal when it was last taken, if that is nearer than the state itself; where none is known, nothing.
"""

from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.errors import ProblemError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.problems.immutable import read_only
from tuckerl.problems.parts import check_heuristic
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import best_value, is_allowed
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.policy import choose
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray, StateArray

_NONE = -1


class HAQLState(NamedTuple):
    """Where each action has led, and how much that counts."""

    led_to: StateArray  # (S, A) from 1: the state after the pair when it was last taken; 0 where it never was
    heuristic: FloatArray  # (S,) distances from the goal
    eta: float
    scheduled: FloatArray  # (1,) xi in the present episode


@kernel
def suggested_action(algorithm: HAQLState, agent: AgentArrays, state: int) -> int:
    """Return the first of the actions that led nearest to the goal, if it is nearer than `state`; else `_NONE`."""
    nearest, suggested = algorithm.heuristic[state], _NONE
    for action in range(agent.q.shape[1]):
        then = algorithm.led_to[state, action]
        if then > 0 and algorithm.heuristic[then - 1] < nearest and is_allowed(agent, state, action):
            nearest, suggested = algorithm.heuristic[then - 1], action
    return suggested


@kernel
def act(algorithm: HAQLState, agent: AgentArrays, state: int) -> int:
    """Let the policy choose by Q + xi H; ``agent.q`` (S, A) holds that in one entry while it does."""
    xi, suggested = algorithm.scheduled[0], suggested_action(algorithm, agent, state)
    if xi == 0.0 or suggested == _NONE:
        return choose(agent.policy, agent, state)
    value = agent.q[state, suggested]
    heuristic = best_value(agent.q, agent.action_mask, state) - value + algorithm.eta
    agent.q[state, suggested] = value + xi * heuristic
    chosen = choose(agent.policy, agent, state)
    agent.q[state, suggested] = value
    return chosen


@kernel
def update(algorithm: HAQLState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step as Q-learning does, and remember where it led: ``agent.q`` (S, A) changes at its pair."""
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    algorithm.led_to[state, action] = next_state + 1
    return np.isfinite(move_towards_target(agent, state, action, reward, discount, next_state))


register_algorithm(HAQLState, act=act, update=update)


class HAQL(Learner):
    """Heuristically accelerated Q-learning for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    heuristic : (S,) float, optional
        Each state's distance from the goal: larger is farther. Default: the problem's own; a maze has its squared
        distance.
    xi : float in [0, 1] or Schedule
        How much the heuristic counts. 0 is Q-learning; at 1 a greedy choice always follows a suggestion; between, what
        is learned overrules it where it is worse than the best by more than xi eta / (1 - xi).
    eta : float
        By how much a suggested action is preferred to the best one at xi = 1, in units of returns; above 0.

    Raises
    ------
    ProblemError
        If there is no heuristic, or one of the wrong shape.

    References
    ----------
    Bianchi, Ribeiro and Costa, SBIA 2004, LNCS 3171; the same, Journal of Heuristics 14, 2008.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.HAQL(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = HAQLState

    def __init__(
        self,
        env: Environment,
        *,
        heuristic: ArrayLike | None = None,
        xi: float | Schedule = 0.5,
        eta: float = 1.0,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self._xi = as_schedule("xi", xi)
        self.xi = as_number(xi)
        self.eta = check_real("eta", eta, 0.0, low_open=True)
        super().__init__(env, **parameters)
        given = self.problem.heuristic if heuristic is None else heuristic
        if given is None:
            raise ProblemError(
                f"HAQL needs a heuristic and this problem has none of its own: pass heuristic=, "
                f"{self.problem.n_states} numbers, larger where the goal is farther; or use QLearning, which needs none"
            )
        self.heuristic: FloatArray = read_only(check_heuristic(given, self.problem.n_states))

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return where actions led, which each agent keeps to itself."""
        return (DeclaredArray("led_to", "none", dtype=np.uint32, bounds=(0, self.problem.n_states)),)

    def algorithm_schedules(self) -> dict[str, Schedule]:
        """Return the schedule of the heuristic's weight."""
        return {"xi": self._xi}

    def constants(self) -> dict[str, Any]:
        """Return the heuristic, and by how much it is preferred."""
        return {"heuristic": self.heuristic, "eta": self.eta}
