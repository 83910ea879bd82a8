"""What there is to look into, as plain data: it can come from a live learner, a saved one or a user's own tensor."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tuckerl.errors import ProblemError
from tuckerl.generalization.step import TensorStepHistory
from tuckerl.problems.parts import Layout, check_layout
from tuckerl.types import BoolArray, FloatArray, IntArray

STATES, ACTIONS, EPISODES, AGENTS = range(4)


class Loadings(NamedTuple):
    """A Tucker decomposition of the tables of E episodes and N agents.

    A state that `states` does not name has no row in `factors[0]`: its row of the tables did not change.
    """

    states: IntArray  # (n,) the states that the rows of the state factor stand for, each once
    factors: tuple[FloatArray, ...]  # (n, r_0), (A, r_1), (E, r_2), (N, r_3)
    core: FloatArray  # (r_0, r_1, r_2, r_3)
    fit: float = math.nan  # NaN where it is not known
    first_episode: int = 1  # of the E episodes, counted from 1

    def energies(self, mode: int) -> FloatArray:
        """Return the part of the core's sum of squares that belongs to each column of a factor, (r,); 0 of zeros."""
        squares: FloatArray = np.square(self.core).sum(axis=tuple(axis for axis in range(4) if axis != mode))
        whole = squares.sum()
        return squares / whole if whole > 0 else squares


class Inspection(NamedTuple):
    """What a learner of N agents, S states and A actions holds after some episodes."""

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
    def walls(self) -> BoolArray:
        """Where nobody can stand, (S,)."""
        return np.zeros(self.n_states, dtype=np.bool_) if self.blocked is None else self.blocked

    @property
    def allowed(self) -> BoolArray:
        """Where an action may be taken, (N, S, A); not to be changed."""
        return np.broadcast_to(np.True_, self.q.shape) if self.action_mask is None else self.action_mask


def check_inspection(inside: Inspection) -> None:
    """Raise an error if the parts do not belong together.

    Raises
    ------
    ProblemError
        If a shape contradicts that of the tables.
    """
    if inside.q.ndim != 3 or 0 in inside.q.shape:
        raise ProblemError(f"q must have the shape (N, S, A), no axis empty; got {inside.q.shape}")
    n_agents, n_states, n_actions = inside.q.shape
    check_layout(inside.layout, n_states)
    wanted = {
        "blocked": (inside.walls.shape, (n_states,)),
        "action_mask": (inside.allowed.shape, inside.q.shape),
        "action_names": ((len(inside.action_names),), (n_actions,)),
        "history.weights": (inside.history.weights.shape, (inside.history.episode.size, n_actions)),
        "steps": (inside.steps.shape[1:], (n_agents,)),
        "returns": (inside.returns.shape, inside.steps.shape),
    }
    if inside.loadings is not None:
        states, factors, core, *_ = inside.loadings
        shapes = tuple(factor.shape for factor in factors)
        sizes = (states.size, n_actions, factors[EPISODES].shape[0] if len(factors) == 4 else 0, n_agents)
        wanted["loadings.factors"] = (shapes, tuple(zip(sizes, core.shape, strict=False)))
        inner = states.size == 0 or (states.min() >= 0 and states.max() < n_states)
        wanted["loadings.states"] = ((np.unique(states).size, inner), (states.size, True))
    for name, (shape, expected) in wanted.items():
        if shape != expected:
            raise ProblemError(f"{name} must fit tables of shape (N, S, A) = {inside.q.shape}; got {shape}")
