r"""Monte Carlo control: after each episode, every pair of it learns from the return that followed.

.. math::
    G \leftarrow r + \gamma\,G, \qquad Q(s, a) \leftarrow Q(s, a) + \frac{1}{n(s, a)} [G - Q(s, a)]

from the last step back to the first, where n counts the returns of a pair, so that Q is their mean; or with alpha
omega(a) in the place of 1 / n. Nothing is bootstrapped from but where a time limit cuts an episode off. (Sutton and
Barto 2018, sections 5.3 and 5.4.)
"""

from typing import Any, Literal, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_name
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.recent_steps import MOST_STEPS, PLACE, RecentSteps, keep_step, no_steps
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.policy import expected_value
from tuckerl.training.row_maxima import change_value
from tuckerl.training.schedules import Schedule
from tuckerl.types import FloatArray, IntArray


class MonteCarloState(NamedTuple):
    """The episode so far, and how many returns each pair has had."""

    steps: RecentSteps  # (N,) all of the episode, in order
    n_returns: IntArray  # (S, A) below 0, while an episode is learned from, of pairs that it has been learned for
    probabilities: FloatArray  # (A,) overwritten
    first_only: bool  # whether a pair learns from its first visit of an episode alone
    averages: bool  # whether a value is the mean of its returns; otherwise it moves by the step size


@kernel
def update(algorithm: MonteCarloState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Keep a step; at an end, or where there is no room for another, learn from all: ``agent.q`` (S, A) changes."""
    steps, n_steps = algorithm.steps, keep_step(algorithm.steps, transition) + 1
    steps.cursor[PLACE] = n_steps
    if not transition.ended and n_steps < steps.ring.size:
        return True
    steps.cursor[PLACE] = 0
    later = transition.reward
    later += transition.discount * expected_value(agent.policy, agent, transition.next_state, algorithm.probabilities)
    last = steps.ring[n_steps - 1]
    last["reward"] = later
    for number in range(n_steps - 2, -1, -1):  # rewards become returns
        step = steps.ring[number]
        later = step["reward"] + agent.settings.gamma * later
        step["reward"] = later
    return _learn_first(algorithm, agent, n_steps) if algorithm.first_only else _learn_all(algorithm, agent, n_steps)


@kernel
def _learn_all(algorithm: MonteCarloState, agent: AgentArrays, n_steps: int) -> bool:
    """Learn from the return of each step in ``algorithm.steps``, the last one first."""
    total = 0.0
    for number in range(n_steps - 1, -1, -1):
        step = algorithm.steps.ring[number]
        total += _move(algorithm, agent, step["state"], step["action"], step["reward"])
    return np.isfinite(total)


@kernel
def _learn_first(algorithm: MonteCarloState, agent: AgentArrays, n_steps: int) -> bool:
    """Learn from the return of each pair's first step in ``algorithm.steps``."""
    ring, n_returns, total = algorithm.steps.ring, algorithm.n_returns, 0.0
    for number in range(n_steps):
        step = ring[number]
        state, action = step["state"], step["action"]
        if n_returns[state, action] >= 0:
            total += _move(algorithm, agent, state, action, step["reward"])
            n_returns[state, action] = -n_returns[state, action]
    for number in range(n_steps):
        step = ring[number]
        state, action = step["state"], step["action"]
        n_returns[state, action] = abs(n_returns[state, action])
    return np.isfinite(total)


@kernel
def _move(algorithm: MonteCarloState, agent: AgentArrays, state: int, action: int, later: float) -> float:
    """Move the value of a pair in ``agent.q`` (S, A) towards a return, and return it."""
    record_change(agent.log, state)
    algorithm.n_returns[state, action] += 1
    value = agent.q[state, action]
    rate = 1.0 / algorithm.n_returns[state, action] if algorithm.averages else agent.step_sizes[action]
    value += rate * (later - value)
    change_value(agent, state, action, value)
    return value


register_algorithm(MonteCarloState, update=update, keeps_maxima=True)


class MonteCarlo(Learner):
    """On-policy Monte Carlo control for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    visits : "first" or "every"
        Whether a pair learns from what followed its first visit of an episode, or each of its visits.
    alpha : float in (0, 1] or Schedule, optional
        None, the default: values are means of returns, and a tensor step has nothing to weight. A number is a step
        size, by which old returns are forgotten.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If `visits` is no such name, or a tensor step is to weight means.

    References
    ----------
    Sutton and Barto, *Reinforcement Learning*, 2018, sections 5.3 and 5.4; Singh and Sutton, Machine Learning 22, 1996,
    for first and every visits.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.MonteCarlo(tuckerl.sutton_maze(), seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = MonteCarloState

    def __init__(  # type: ignore[misc]  # alpha is one of the parameters of all learners, where it may not be None
        self,
        env: Environment,
        *,
        visits: Literal["first", "every"] = "first",
        alpha: float | Schedule | None = None,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.visits = check_name("visits", visits, ("first", "every"))
        self._averages = alpha is None
        super().__init__(env, alpha=1.0 if alpha is None else alpha, **parameters)
        if alpha is None:
            self.alpha = None

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the steps of an episode, of which none is left between two, the counts of returns, and room."""
        capacity = min(self.problem.max_episode_steps or MOST_STEPS, MOST_STEPS)
        return (
            DeclaredRecord("steps", "none", lambda n_states, n_actions: no_steps(capacity)),
            DeclaredArray("n_returns", "heaviest", dtype=np.int64, bounds=(0, 2**62)),
            DeclaredArray("probabilities", "none", ("actions",)),
        )

    def constants(self) -> dict[str, Any]:
        """Return what is learned from a return, and how."""
        return {"first_only": self.visits == "first", "averages": self._averages}

    def why_no_weights(self) -> str | None:
        """Return why means are not weighted."""
        if not self._averages:
            return None
        return "values that are means of returns have no step size that it could weight (alpha=0.1 would be one)"
