"""What is inspected, as plain data: it can come from a live learner, a saved one or a user's own tensor."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.generalization.loadings import EPISODES, Loadings
from tuckerl.generalization.step_history import TensorStepHistory
from tuckerl.problems.parts import Layout, StateFactor, check_layout
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, greedy, values
from tuckerl.reports.text import joined
from tuckerl.types import BoolArray, FloatArray, IntArray


class StatePath(NamedTuple):
    """A way through the states, of every agent one."""

    name: str
    states: tuple[IntArray, ...]  # N times (steps + 1,)
    words: str = ""  # what is said of agent 0's


class Inspection(NamedTuple):
    """The content of a learner of N agents, S states and A actions after some episodes."""

    title: str
    q: FloatArray  # (N, S, A)
    layout: Layout | None  # (rows, columns) of a grid whose cells are the states, row by row
    blocked: BoolArray | None  # (S,) where nobody can stand
    action_names: Sequence[str]  # (A,)
    history: TensorStepHistory
    loadings: Loadings | None  # of the latest window
    steps: IntArray  # (episodes, N)
    returns: FloatArray  # (episodes, N)
    action_mask: BoolArray | None = None  # (N, S, A) where an action may be taken; None where all may
    optimal: FloatArray | None = None  # (S,) the optimal values; None where they are not known
    paths: Sequence[StatePath] = ()  # over the layout; the greedy one first
    state_factors: Sequence[StateFactor] = ()  # the digits of a state's number, the last changes fastest; () for one

    @property
    def n_agents(self) -> int:
        """Number of agents."""
        return int(self.q.shape[0])

    @property
    def n_states(self) -> int:
        """Number of states."""
        return int(self.q.shape[1])

    @property
    def n_actions(self) -> int:
        """Number of actions."""
        return int(self.q.shape[2])

    @property
    def n_windows(self) -> int:
        """Number of windows on record."""
        return int(self.history.episode.size)

    @property
    def walls(self) -> BoolArray:
        """Where nobody can stand, (S,)."""
        return np.zeros(self.n_states, dtype=np.bool_) if self.blocked is None else self.blocked

    @property
    def allowed(self) -> BoolArray:
        """Where an action may be taken, (N, S, A); not to be changed."""
        return np.broadcast_to(np.True_, self.q.shape) if self.action_mask is None else self.action_mask

    @property
    def best(self) -> IntArray:
        """The agents' greedy actions, (N, S); NO_PREFERENCE where an agent prefers none or nobody can stand."""
        return np.where(self.walls, NO_PREFERENCE, greedy(self.q, self.allowed))

    @property
    def known(self) -> FloatArray:
        """The agents' state values, (N, S); NaN where an agent prefers nothing or nobody can stand."""
        return np.where(self.walls, np.nan, values(self.q, self.allowed))

    @property
    def optimum(self) -> FloatArray:
        """The optimal values, (S,), NaN where nobody can stand; for figures that need them."""
        if self.optimal is None:
            raise ValueError("the optimal values are not known")
        return np.where(self.walls, np.nan, self.optimal)

    @property
    def counts(self) -> IntArray:
        """In how many states each action is agent 0's greedy one, (A,)."""
        return np.bincount(self.best[0][self.best[0] != NO_PREFERENCE], minlength=self.n_actions)

    def commonest(self, most: int) -> str:
        """Return in words in how many states agent 0's commonest greedy actions are greedy."""
        order = np.argsort(-self.counts, kind="stable")[:most]
        return joined(f"{self.action_names[one]} in {self.counts[one]:,}" for one in order if self.counts[one])

    @property
    def decomposed(self) -> Loadings:
        """The loadings, where there are any."""
        if self.loadings is None:
            raise ValueError("there are no loadings to draw")
        return self.loadings

    @property
    def grid(self) -> Layout:
        """The layout, where there is one."""
        if self.layout is None:
            raise ValueError("only states with a layout can be drawn as a grid")
        return self.layout


def check_inspection(inspection: Inspection) -> None:
    """Raise an error if the parts do not belong together.

    Raises
    ------
    ParameterTypeError
        If it is no inspection.
    ProblemError
        If a shape contradicts that of the tables.
    """
    if not isinstance(inspection, Inspection):
        raise ParameterTypeError(f"inspection must be what inspect_learner returns; got {shown(inspection)}")
    if inspection.q.ndim != 3 or 0 in inspection.q.shape:
        raise ProblemError(f"q must have the shape (N, S, A), no axis empty; got {inspection.q.shape}")
    n_agents, n_states, n_actions = inspection.q.shape
    check_layout(inspection.layout, n_states)
    wanted = {
        "blocked": (inspection.walls.shape, (n_states,)),
        "action_mask": (inspection.allowed.shape, inspection.q.shape),
        "action_names": ((len(inspection.action_names),), (n_actions,)),
        "history.weights": (inspection.history.weights.shape, (inspection.history.episode.size, n_actions)),
        "steps": (inspection.steps.shape[1:], (n_agents,)),
        "returns": (inspection.returns.shape, inspection.steps.shape),
    }
    if inspection.optimal is not None:
        wanted["optimal"] = (inspection.optimal.shape, (n_states,))
    if inspection.loadings is not None:
        states, factors, core, *_ = inspection.loadings
        shapes = tuple(factor.shape for factor in factors)
        sizes = (states.size, n_actions, factors[EPISODES].shape[0] if len(factors) == 4 else 0, n_agents)
        wanted["loadings.factors"] = (shapes, tuple(zip(sizes, core.shape, strict=False)))
        inner = states.size == 0 or (states.min() >= 0 and states.max() < n_states)
        wanted["loadings.states"] = ((np.unique(states).size, inner), (states.size, True))
    for name, (shape, expected) in wanted.items():
        if shape != expected:
            raise ProblemError(f"{name} must fit tables of shape (N, S, A) = {inspection.q.shape}; got {shape}")
