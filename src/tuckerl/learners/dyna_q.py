r"""Dyna-Q: Q-learning that repeats its update on transitions that it remembers.

After each real step, n times: draw an observed state and one of the actions tried in it, and repeat

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma \max_b Q(s', b) - Q(s, a)]

with the pair's latest outcome. (Sutton 1990; Sutton and Barto 2018, section 8.2, "Tabular Dyna-Q".)
"""

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import is_rare, kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import ChangeLog, record_change
from tuckerl.learners.latest_outcomes import OUTCOME, check_outcomes, keep_outcome, list_state, revised_discounts
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays, Settings, Transition, must_stop
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.types import BoolArray, IntArray, StateArray


class DynaQState(NamedTuple):
    """What Dyna-Q keeps for one agent: a model of the world, and how much to plan with it."""

    outcome: NDArray[np.void]  # (S, A) of OUTCOME
    tried: StateArray  # (S, A) the actions that were tried in each state, in order
    n_tried: StateArray  # (S,) how many these are
    observed: StateArray  # (S,) the states in which an action was tried, in order
    n_observed: IntArray  # (1,)
    n_steps: int  # planned updates after each real step


@kernel
def remember(model: Any, log: ChangeLog, transition: Transition) -> None:
    """Put a transition into the model in place of the pair's last one.

    Parameters
    ----------
    model : DynaQState or another with the same arrays
        Its `outcome`, (S, A), changes at the transition's state and action; the lists `tried`, (S, A), and `observed`,
        (S,), grow by what is new.
    log : ChangeLog
        Where rows are kept that change; that of the transition's state is kept already.
    transition : Transition
    """
    state, action = transition.state, transition.action
    keep_outcome(model.outcome, transition)
    n_tried = model.n_tried[state]
    for place in range(n_tried):
        if model.tried[state, place] == action:
            return
    if is_rare(n_tried == 0):
        list_state(model, log, state)
    model.tried[state, n_tried] = action
    model.n_tried[state] += 1


@kernel
def plan(model: DynaQState, agent: AgentArrays) -> float:
    """Do the planning steps that follow a real one, which change ``agent.q`` (S, A).

    Returns
    -------
    float
        The sum of the new values: not finite if one of them is not.
    """
    total, rng = 0.0, agent.rng
    for number in range(model.n_steps):
        if must_stop(agent.record, number):
            break
        state_place: Any = np.uint32(below(model.n_observed[0], rng))  # unsigned: a tenth of the time
        state = model.observed[state_place]
        action_place: Any = np.uint32(below(model.n_tried[state], rng))
        action = model.tried[state, action_place]
        outcome = model.outcome[state, action]
        reward, discount, next_state = outcome["reward"], outcome["discount"], outcome["next_state"]
        record_change(agent.log, state)
        total += move_towards_target(agent, state, action, reward, discount, next_state)
    return total


@kernel
def update(algorithm: DynaQState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and plan: ``agent.q`` (S, A) and the model change."""
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    value = move_towards_target(agent, state, action, reward, discount, next_state)
    remember(algorithm, agent.log, transition)
    return np.isfinite(value + plan(algorithm, agent))


register_algorithm(DynaQState, update=update, keeps_maxima=True)


class DynaQ(Learner):
    """Dyna-Q for one agent or several, each with its own model and its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    planning_steps : int
        Planned updates after each real step; 0 is Q-learning.

    References
    ----------
    Sutton, *Integrated architectures for learning, planning, and reacting*, ICML 1990; Sutton and Barto, *Reinforcement
    Learning*, 2018, section 8.2.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.DynaQ(tuckerl.sutton_maze(), planning_steps=50, seed=0).learn(episodes=50)
    >>> int(agent.steps.min())
    14
    """

    state_type: ClassVar[type] = DynaQState

    def __init__(self, env: Environment, *, planning_steps: int = 10, **parameters: Unpack[LearnerParameters]) -> None:
        self.planning_steps = check_int("planning_steps", planning_steps, 0, np.iinfo(np.int64).max)
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the model, which each agent keeps to itself."""
        states, sizes = ("states",), (self.problem.n_states, self.problem.n_actions)
        return (
            DeclaredArray("model.outcome", "none", dtype=OUTCOME),
            DeclaredArray("model.tried", "none", dtype=np.uint32, bounds="actions"),
            DeclaredArray("model.n_tried", "none", states, np.uint32, bounds=(0, sizes[1])),
            DeclaredArray("model.observed", "none", states, np.uint32, bounds="states"),
            DeclaredArray("model.n_observed", "none", (1,), np.int64, bounds=(0, sizes[0])),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a model of a file whose parts contradict each other: planning uses them as indices."""
        n_tried, n = declared["model.n_tried"], int(declared["model.n_observed"][0])
        states = declared["model.observed"][:n]
        if np.unique(states).size < n or not np.array_equal(np.sort(states), np.flatnonzero(n_tried)):
            raise SavedFileError("the observed states of a model must be those in which an action was tried, each once")
        known = known_pairs(declared)
        if np.count_nonzero(known) != n_tried.sum():
            raise SavedFileError("the actions that a model has of a state must be different ones")
        check_outcomes(declared["model.outcome"][known], self.problem.n_states)

    def revise_state(self, before: Settings, now: Settings) -> None:
        """Give what the models hold the discounts of now.

        Raises
        ------
        ImmutableError
            If ends must be told from other steps, which a model with one discount for both cannot do.
        """
        known = [known_pairs(held) for held in self.declared]
        discounts = [held["model.outcome"]["discount"] for held in self.declared]
        revised = [revised_discounts(d[k], before, now) for d, k in zip(discounts, known, strict=True)]
        for held, where, values in zip(discounts, known, revised, strict=True):
            held[where] = values

    def constants(self) -> dict[str, Any]:
        """Return how much to plan."""
        return {"n_steps": self.planning_steps}


def known_pairs(declared: Mapping[str, Any]) -> BoolArray:
    """Return which pairs a model holds an outcome of, (S, A)."""
    tried, n_tried = declared["model.tried"], declared["model.n_tried"]
    known = np.zeros(tried.shape, dtype=np.bool_)
    states, places = np.nonzero(np.arange(tried.shape[1]) < n_tried[:, None])
    known[states, tried[states, places]] = True
    return known
