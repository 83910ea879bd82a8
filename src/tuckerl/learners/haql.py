r"""HAQL, heuristically accelerated Q-learning: Q-learning whose choice of actions a heuristic helps.

.. math::
    a = \arg\max_b [Q(s, b) + \xi H(s, b)], \qquad
    H(s, b) = \begin{cases} \max_c Q(s, c) - Q(s, b) + \eta & \text{if the heuristic suggests } b \\ 0 \end{cases}

where Q-learning takes the largest Q. The table is Q-learning's; the heuristic decides where its experience comes from,
and helps to play by it. (Bianchi, Ribeiro and Costa 2004 and 2008.)

Here a heuristic is a distance of each state from the goal, as in Dyna-H. It suggests the action that has led nearest to
the goal when it was last taken, if that is nearer than the state itself; where none is known, nothing.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.generalization.change_log import keep_row, record_change
from tuckerl.learners.heuristics import heuristic_for
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import best_value, is_allowed
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.greedy import Greedy
from tuckerl.training.policies.policy import Policy, choose
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import BoolArray, FloatArray, StateArray

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
    keep_row(agent.log, state)  # as it is: a policy that counts keeps it, too, but would keep what is held here for now
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


Table = Callable[[FloatArray, Mapping[str, Any], BoolArray], FloatArray]
"""From an agent's Q, declared arrays and action mask to Q + xi H, (S, A)."""


class HelpedGreedy(Greedy):
    """An action of the largest Q + xi H, which is what `helped` returns."""

    def __init__(self, helped: Table) -> None:
        self.helped = helped

    def table(self, q: FloatArray, declared: Mapping[str, Any], action_mask: BoolArray) -> FloatArray:
        """Return Q + xi H."""
        return self.helped(q, declared, action_mask)


class HelpedPolicy(Policy):
    """A policy that plays by Q + xi H, which is what `helped` returns; while it learns, `act` shows it that."""

    def __init__(self, policy: Policy, helped: Table) -> None:
        self.policy, self.helped = policy, helped

    def schedules(self) -> dict[str, Schedule]:
        """Return the policy's own."""
        return self.policy.schedules()

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the policy's own."""
        return self.policy.declare_state()

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> Any:
        """Return the policy's own, so that its kernels are the policy's."""
        return self.policy.arrays(scheduled, declared)

    def target(self) -> Policy:
        """Return the policy that is learned for, the greedy one as a rule, by Q + xi H."""
        target = self.policy.target()
        return HelpedGreedy(self.helped) if target is None else HelpedPolicy(target, self.helped)

    def preferences(self, q: FloatArray, declared: Mapping[str, Any]) -> FloatArray:
        """Return what the policy makes of the table that it is given."""
        return self.policy.preferences(q, declared)

    def table(self, q: FloatArray, declared: Mapping[str, Any], action_mask: BoolArray) -> FloatArray:
        """Return Q + xi H."""
        return self.helped(q, declared, action_mask)

    def __repr__(self) -> str:
        return f"{self.policy!r} of HAQL"


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
        instead = "; or use QLearning, which needs none"
        self.heuristic: FloatArray = heuristic_for("HAQL", self.problem, heuristic, instead)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return where actions led, which each agent keeps to itself."""
        return (DeclaredArray("led_to", "none", dtype=np.uint32, bounds=(0, self.problem.n_states)),)

    def algorithm_schedules(self) -> dict[str, Schedule]:
        """Return the schedule of the heuristic's weight."""
        return {"xi": self._xi}

    def constants(self) -> dict[str, Any]:
        """Return the heuristic, and by how much it is preferred."""
        return {"heuristic": self.heuristic, "eta": self.eta}

    def adapt_policy(self, policy: Policy) -> Policy:
        """Return the policy, which is played by Q + xi H in predictions, too."""
        return HelpedPolicy(policy, self.helped)

    def helped(self, q: FloatArray, declared: Mapping[str, Any], action_mask: BoolArray) -> FloatArray:
        """Return Q + xi H of an agent, as it is in the episode to come.

        Parameters
        ----------
        q : (S, A) float64
        declared : mapping
            The agent's declared arrays by name.
        action_mask : (S, A) or (0, 0) bool
        """
        xi = self._xi.values(self.episodes + 1)[-1]
        allowed = action_mask if action_mask.size else np.ones(q.shape, dtype=np.bool_)
        led_to = declared["led_to"].astype(np.int64)
        distance = np.where((led_to > 0) & allowed, self.heuristic[led_to - 1], np.inf)
        suggested = distance.argmin(axis=1)
        nearer = np.flatnonzero((distance.min(axis=1) < self.heuristic) & (xi > 0.0))
        pairs = nearer, suggested[nearer]
        best = np.where(allowed, q, -np.inf).max(axis=1)
        table = q.copy()
        table[pairs] += xi * (best[nearer] - q[pairs] + self.eta)
        return table
