r"""Dyna-H, the paper's Figure 6; with a tensor step, DYNA-HT, its Figure 7.

After each real step the agent plans: it repeats Q-learning's update on transitions that it remembers, choosing in each
state the modelled action that leads FARTHEST from the goal by a heuristic H, so that bad plans are unlearned without
being walked. (Santos, Martin H. and Lopez 2011, arXiv:1101.4003.)
"""

from enum import IntEnum
from typing import Any, Literal, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int, check_name
from tuckerl.errors import ProblemError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.q_learning import update
from tuckerl.problems.parts import check_heuristic
from tuckerl.rng import below
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.learner import Learner
from tuckerl.training.learner_file import Arrays, of_prefix, with_prefix
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies import epsilon_greedy, maxima, random_maximum
from tuckerl.types import FloatArray, IntArray, StateArray, Stream


class SearchControl(IntEnum):
    """Where each planning step begins."""

    TRAJECTORY = 0  # at the current state, then where the last planned step led
    RESTART = 1  # at the current state every time
    RANDOM = 2  # at a random observed state every time


class Planning(NamedTuple):
    """How to plan."""

    n_steps: int
    search_control: int
    heuristic: FloatArray  # (S,)


# The latest outcome of a pair; the discount is 0 where the return ended. One record instead of three arrays: a planning
# step then finds its place in memory once, which is a third of its time.
OUTCOME = np.dtype([("reward", np.float64), ("discount", np.float64), ("next_state", np.uint32)], align=True)


class Model(NamedTuple):
    """What one agent remembers of the world."""

    outcome: NDArray[np.void]  # (S, A) of OUTCOME
    distance: FloatArray  # (S, A) H of the next state, -inf where nothing is modelled; unset for unobserved states
    # What every planning step asks for, kept because it changes with the model only:
    farthest: StateArray  # (S,) the first modelled action of largest distance
    n_farthest: StateArray  # (S,) how many modelled actions share that distance, 0: the state is unobserved
    observed: StateArray  # (S,) the observed states in order
    n_observed: IntArray  # (1,)


def empty_model(n_states: int, n_actions: int) -> Model:
    """Return the model of an agent that has seen nothing."""
    shape = (n_states, n_actions)
    return Model(
        outcome=np.zeros(shape, dtype=OUTCOME),
        distance=np.zeros(shape),
        farthest=np.zeros(n_states, dtype=np.uint32),
        n_farthest=np.zeros(n_states, dtype=np.uint32),
        observed=np.zeros(n_states, dtype=np.uint32),
        n_observed=np.zeros(1, dtype=np.int64),
    )


@kernel
def remember(model: Model, heuristic: FloatArray, seen: Transition) -> None:
    """Put a transition into the model in place of the pair's last one."""
    state, action, next_state = seen.state, seen.action, seen.next_state
    if model.n_farthest[state] == 0:
        model.observed[model.n_observed[0]] = state
        model.n_observed[0] += 1
        for other in range(model.distance.shape[1]):
            model.distance[state, other] = -np.inf
    outcome = model.outcome[state, action]  # by name in brackets, so that it works uncompiled, too
    outcome["reward"], outcome["discount"], outcome["next_state"] = seen.reward, seen.discount, next_state
    if model.distance[state, action] != heuristic[next_state]:
        model.distance[state, action] = heuristic[next_state]
        model.farthest[state], model.n_farthest[state] = maxima(model.distance, state)


@kernel
def modelled_action(model: Model, state: int, rng: Stream) -> int:
    """Draw one of the state's modelled actions."""
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
def plan(model: Model, planning: Planning, agent: Agent, start: int) -> float:
    """Do the planning steps that follow a real one; return the sum of the new values (not finite if one is not)."""
    state, total, rng = start, 0.0, agent.rng
    for _ in range(planning.n_steps):
        if planning.search_control == SearchControl.RESTART:
            state = start
        elif planning.search_control == SearchControl.RANDOM:
            state = model.observed[below(model.n_observed[0], rng)]
        if model.n_farthest[state] > 0:
            chosen = random_maximum(model.distance, state, model.farthest[state], model.n_farthest[state], rng)
        else:
            state = model.observed[below(model.n_observed[0], rng)]
            chosen = modelled_action(model, state, rng)
        action: Any = np.uint32(chosen)  # unsigned, as states are: a tenth of the time
        outcome = model.outcome[state, action]
        reward, discount, next_state = outcome["reward"], outcome["discount"], outcome["next_state"]
        record_change(agent.log, state)
        total += update(agent, state, action, reward, discount, next_state)
        state = next_state
    return total


class DynaMethod(NamedTuple):
    """Dyna-H keeps a model and plans with it."""

    model: Model
    planning: Planning


@kernel
def first(method: DynaMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose an episode's first action."""
    return epsilon_greedy(agent, state, epsilon)


@kernel
def turn(method: DynaMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Learn from a step, plan, and choose the next action."""
    record_change(agent.log, seen.state)
    value = update(agent, seen.state, seen.action, seen.reward, seen.discount, seen.next_state)
    remember(method.model, method.planning.heuristic, seen)
    if not np.isfinite(value + plan(method.model, method.planning, agent, seen.state)):
        return NOT_FINITE
    return 0 if seen.ended else epsilon_greedy(agent, seen.next_state, epsilon)


algorithm(DynaMethod, first=first, turn=turn)


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
        Where a planning step begins: ``"trajectory"``, where the last one led (the first: at the current state);
        ``"restart"``, at the current state; ``"random"``, at a random observed state.

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

    def __init__(
        self,
        env: Environment,
        *,
        planning_steps: int = 10,
        heuristic: ArrayLike | None = None,
        search_control: Literal["trajectory", "restart", "random"] = "trajectory",
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        super().__init__(env, **parameters)
        n_states, n_actions = self.problem.n_states, self.problem.n_actions
        if heuristic is None:
            heuristic = self.problem.heuristic
        if heuristic is None:
            raise ProblemError(
                f"DynaH needs a heuristic and this problem has none of its own: pass heuristic=, {n_states} numbers, "
                "larger where the goal is farther"
            )
        control = check_name("search_control", search_control, (known.name.lower() for known in SearchControl))
        self.planning_steps = check_int("planning_steps", planning_steps, 0)
        self._planning = Planning(
            self.planning_steps, int(SearchControl[control.upper()]), check_heuristic(heuristic, n_states)
        )
        self._models = tuple(empty_model(n_states, n_actions) for _ in range(self.n_tables))

    def _method(self, table: int) -> DynaMethod:
        return DynaMethod(self._models[table], self._planning)

    def _parameters(self) -> dict[str, Any]:
        control = SearchControl(self._planning.search_control).name.lower()
        return super()._parameters() | {"planning_steps": self.planning_steps, "search_control": control}

    @classmethod
    def _array_parameters(cls, arrays: Arrays) -> dict[str, Any]:
        return super()._array_parameters(arrays) | {"heuristic": arrays["heuristic"]}

    def _saved_arrays(self) -> Arrays:
        saved = super()._saved_arrays() | {"heuristic": self._planning.heuristic}
        for table, model in enumerate(self._models):
            saved |= with_prefix(f"model{table}", model._asdict())
        return saved

    def _restore_arrays(self, arrays: Arrays) -> None:
        super()._restore_arrays(arrays)
        models = [Model(**of_prefix(f"model{table}", arrays)) for table in range(self.n_tables)]
        # A file does not say that a record is aligned; without that, the kernel would be compiled a second time.
        self._models = tuple(model._replace(outcome=model.outcome.view(OUTCOME)) for model in models)
