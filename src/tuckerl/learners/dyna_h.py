r"""Dyna-H, the paper's Figure 6; with a tensor step, DYNA-HT, its Figure 7.

After each real step the agent plans: it repeats Q-learning's update on transitions that it remembers, choosing in each
state the modelled action that leads FARTHEST from the goal by a heuristic H, so that bad plans are unlearned without
being walked. (Santos, Martin H. and Lopez 2011, arXiv:1101.4003.)
"""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any, Literal, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int, check_name
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.heuristics import heuristic_for
from tuckerl.learners.latest_outcomes import OUTCOME, check_outcomes, keep_outcome, revised_discounts
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays, Settings, Transition, must_stop
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.row_maxima import largest_entries
from tuckerl.types import FloatArray, IntArray, StateArray, Stream


class SearchControl(IntEnum):
    """Where each planning step begins."""

    TRAJECTORY = 0  # at the current state, then where the last planned step led
    RESTART = 1  # at the current state every time
    RANDOM = 2  # at a random observed state every time


class DynaHState(NamedTuple):
    """What Dyna-H keeps for one agent: a model of the world, and how to plan with it."""

    outcome: NDArray[np.void]  # (S, A) of OUTCOME
    distance: FloatArray  # (S, A) H of the next state, -inf where nothing is modelled; unset for unobserved states
    # What every planning step asks for, kept because it changes with the model only:
    farthest: StateArray  # (S,) the first modelled action of largest distance
    n_farthest: StateArray  # (S,) how many modelled actions share that distance, 0: the state is unobserved
    observed: StateArray  # (S,) the observed states in order
    n_observed: IntArray  # (1,)
    n_steps: int  # planned updates after each real step
    search_control: int
    heuristic: FloatArray  # (S,)


@kernel
def remember(model: DynaHState, transition: Transition) -> None:
    """Put a transition into the model in place of the pair's last one.

    Parameters
    ----------
    model : DynaHState
        Its `outcome` and `distance`, (S, A), change at the transition's state and action; `farthest` and `n_farthest`,
        (S,), at its state; `observed` (S,) and `n_observed` (1,) grow by a state that is new.
    transition : Transition
    """
    state, action, next_state = transition.state, transition.action, transition.next_state
    if model.n_farthest[state] == 0:
        model.observed[model.n_observed[0]] = state
        model.n_observed[0] += 1
        for other in range(model.distance.shape[1]):
            model.distance[state, other] = -np.inf
    keep_outcome(model.outcome, transition)
    if model.distance[state, action] != model.heuristic[next_state]:
        model.distance[state, action] = model.heuristic[next_state]
        _, _, model.farthest[state], model.n_farthest[state] = largest_entries(model.distance, state)


@kernel
def farthest_action(model: DynaHState, state: int, rng: Stream) -> int:
    """Draw one of the modelled actions of the largest distance; `rng` (4,) uint64 moves on where there are several."""
    action = model.farthest[state]
    if model.n_farthest[state] == 1:
        return action
    distance, skip = model.distance[state, action], below(model.n_farthest[state], rng)
    while skip > 0:
        action += 1
        skip -= model.distance[state, action] == distance
    return action


@kernel
def modelled_action(model: DynaHState, state: int, rng: Stream) -> int:
    """Draw one of the state's modelled actions, those of a finite ``model.distance`` (S, A); `rng` is (4,) uint64."""
    n_modelled = 0
    for action in range(model.distance.shape[1]):
        n_modelled += model.distance[state, action] > -np.inf
    skip = below(n_modelled, rng)
    action = 0
    while skip > 0 or model.distance[state, action] == -np.inf:
        skip -= model.distance[state, action] > -np.inf
        action += 1
    return action


@kernel
def plan(model: DynaHState, agent: AgentArrays, start: int) -> float:
    """Do the planning steps that follow a real one, which change ``agent.q`` (S, A).

    Returns
    -------
    float
        The sum of the new values: not finite if one of them is not.
    """
    state, total, rng = start, 0.0, agent.rng
    for number in range(model.n_steps):
        if must_stop(agent.record, number):
            break
        if model.search_control == SearchControl.RESTART:
            state = start
        elif model.search_control == SearchControl.RANDOM:
            state = model.observed[below(model.n_observed[0], rng)]
        if model.n_farthest[state] > 0:
            chosen = farthest_action(model, state, rng)
        else:
            state = model.observed[below(model.n_observed[0], rng)]
            chosen = modelled_action(model, state, rng)
        action: Any = np.uint32(chosen)  # unsigned, as states are: a tenth of the time
        outcome = model.outcome[state, action]
        reward, discount, next_state = outcome["reward"], outcome["discount"], outcome["next_state"]
        record_change(agent.log, state)
        total += move_towards_target(agent, state, action, reward, discount, next_state)
        state = next_state
    return total


@kernel
def update(algorithm: DynaHState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and plan: ``agent.q`` (S, A) and the model change."""
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    value = move_towards_target(agent, state, action, reward, discount, next_state)
    remember(algorithm, transition)
    return np.isfinite(value + plan(algorithm, agent, state))


register_algorithm(DynaHState, update=update)


class DynaH(Learner):
    """Dyna-H for one agent or several, each with its own model and its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    planning_steps : int
        Planned updates after each real step.
    heuristic : (S,) float, optional
        H: larger is farther from the goal. Default: the problem's own; a maze has its squared distance.
    search_control : str
        Where a planning step begins (Sutton and Barto 2018, section 8.6): ``"trajectory"``, where the last one led (the
        first: at the current state); ``"restart"``, at the current state; ``"random"``, at a random observed state.

    Raises
    ------
    ProblemError
        If there is no heuristic, or one of the wrong shape.

    References
    ----------
    Santos, Martin H. and Lopez, arXiv:1101.4003, 2011; the paper's Figures 6 and 7.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.DynaH(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=100)
    >>> int(agent.steps.min())
    14
    """

    state_type = DynaHState

    def __init__(
        self,
        env: Environment,
        *,
        planning_steps: int = 10,
        heuristic: ArrayLike | None = None,
        search_control: Literal["trajectory", "restart", "random"] = "trajectory",
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.planning_steps = check_int("planning_steps", planning_steps, 0, np.iinfo(np.int64).max)
        self.search_control = check_name("search_control", search_control, (c.name.lower() for c in SearchControl))
        super().__init__(env, **parameters)
        self.heuristic: FloatArray = heuristic_for("DynaH", self.problem, heuristic)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the model, which each agent keeps to itself."""
        states = ("states",)
        return (
            DeclaredArray("model.outcome", "none", dtype=OUTCOME),
            DeclaredArray("model.distance", "none"),
            DeclaredArray("model.farthest", "none", states, np.uint32, bounds="actions"),
            DeclaredArray("model.n_farthest", "none", states, np.uint32, bounds=(0, self.problem.n_actions)),
            DeclaredArray("model.observed", "none", states, np.uint32, bounds="states"),
            DeclaredArray("model.n_observed", "none", (1,), np.int64, bounds=(0, self.problem.n_states)),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a model of a file whose parts contradict each other: planning uses them as indices."""
        count, n = declared["model.n_farthest"], int(declared["model.n_observed"][0])
        states = declared["model.observed"][:n]
        if np.unique(states).size < n or not np.array_equal(np.sort(states), np.flatnonzero(count)):
            raise SavedFileError("the observed states of a model must be those of which it has actions, each once")
        distance, outcome = declared["model.distance"][states], declared["model.outcome"][states]
        modelled = distance > -np.inf
        farthest = distance.max(axis=1, keepdims=True) == distance
        known = outcome[modelled]
        check_outcomes(known, self.problem.n_states)
        is_sound = (
            not np.isnan(distance).any()
            and np.array_equal(farthest.sum(axis=1), count[states])
            and np.array_equal(farthest.argmax(axis=1), declared["model.farthest"][states])
            and modelled.any(axis=1).all()
        )
        if not is_sound or not np.array_equal(distance[modelled], self.heuristic[known["next_state"]]):
            raise SavedFileError("the farthest actions of a model must be those of its outcomes")

    def revise_state(self, before: Settings, now: Settings) -> None:
        """Give what the models hold the discounts and distances of now.

        Raises
        ------
        ImmutableError
            If ends must be told from other steps, which a model with one discount for both cannot do.
        """
        known = [held["model.observed"][: held["model.n_observed"][0]] for held in self.declared]
        outcomes = [held["model.outcome"][states] for held, states in zip(self.declared, known, strict=True)]
        discounts = [revised_discounts(outcome["discount"], before, now) for outcome in outcomes]
        for held, states, outcome, revised in zip(self.declared, known, outcomes, discounts, strict=True):
            distance = held["model.distance"]
            modelled = distance[states] > -np.inf
            held["model.outcome"]["discount"][states] = np.where(modelled, revised, 0.0)
            distance[states] = np.where(modelled, self.heuristic[outcome["next_state"]], -np.inf)
            farthest = distance[states].max(axis=1, keepdims=True)
            held["model.farthest"][states] = distance[states].argmax(axis=1)
            held["model.n_farthest"][states] = (distance[states] == farthest).sum(axis=1)

    def constants(self) -> dict[str, Any]:
        """Return how to plan."""
        control = int(SearchControl[self.search_control.upper()])
        return {"n_steps": self.planning_steps, "search_control": control, "heuristic": self.heuristic}
