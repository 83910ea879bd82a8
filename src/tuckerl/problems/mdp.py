"""A finite Markov decision process as arrays: the form in which every table of transitions reaches a kernel.

States and actions are numbered from 0. A pair (s, a) has one outcome or several; outcome ``k`` leads to
``next_state[k]``, pays ``reward[k]`` and, where ``terminated[k]``, ends the return: nothing is bootstrapped from its
next state. (Puterman, *Markov Decision Processes*, 1994; Sutton and Barto, *Reinforcement Learning*, 2018, 3.1.)
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.checks import check_int
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.worlds import World
from tuckerl.types import BoolArray, FloatArray, IntArray, StateArray

NO_LIMIT = np.iinfo(np.int64).max
SUM_TOLERANCE = 1e-8

Layout = tuple[int, int]
"""(rows, columns) of a grid whose cells are the states, row by row."""


class MDPArrays(NamedTuple):
    """What kernels read of an MDP with S states, A actions and M outcomes in all.

    Where every pair has exactly one outcome, that of (s, a) is ``s * A + a`` and `offsets` and `cumulative` are empty;
    otherwise its outcomes are ``offsets[s * A + a]`` up to ``offsets[s * A + a + 1]``, and `cumulative` holds their
    summed probabilities.
    """

    next_state: StateArray  # (M,)
    reward: FloatArray  # (M,)
    terminated: BoolArray  # (M,)
    offsets: IntArray  # (S * A + 1,) or (0,)
    cumulative: FloatArray  # (M,) or (0,)
    start_state: StateArray  # (K,)
    start_cumulative: FloatArray  # (K,)
    action_mask: BoolArray  # (S, A) True where an action may be taken, or (0, 0) where all may
    n_actions: int
    max_episode_steps: int  # NO_LIMIT where there is none


class TabularMDP:
    """A finite MDP, checked once and kept as read-only arrays.

    Parameters
    ----------
    next_state : (S, A) or (S, A, K) int
        The state that each outcome leads to.
    reward : the same shape, float
    terminated : the same shape, bool
        True where the outcome ends the episode.
    probability : (S, A, K) float, optional
        Needed with K outcomes; each pair's sum to 1. Outcomes of probability 0 are dropped.
    start : int or (S,) float, optional
        The first state, or the probability of each. Default 0.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; default: never.
    heuristic : (S,) float, optional
        What ``DynaH`` uses by default: larger is farther from the goal.
    action_sizes : tuple of int, optional
        Where an action is a joint one: how many actions each agent has. Joint actions are numbered by C-order
        ``ravel_multi_index`` over the agents. Default: one agent, ``(A,)``.
    action_mask : (S, A) bool, optional
        True where an action may be taken: learners choose among those only. A state in which none may is one in which
        all may. Default: all.
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row: how pictures show them.

    Raises
    ------
    ProblemError
        If shapes differ, a state is out of range, a number is not finite, probabilities do not sum to 1, the
        sizes' product is not A or the layout's is not S.

    Examples
    --------
    >>> chain = TabularMDP([[0, 1], [0, 1]], [[0, 1], [0, 0]], [[False, True], [True, True]])
    >>> chain.n_states, chain.n_actions
    (2, 2)
    """

    def __init__(
        self,
        next_state: ArrayLike,
        reward: ArrayLike,
        terminated: ArrayLike,
        probability: ArrayLike | None = None,
        *,
        start: int | ArrayLike = 0,
        max_episode_steps: int | None = None,
        heuristic: ArrayLike | None = None,
        action_sizes: Sequence[int] | None = None,
        action_mask: ArrayLike | None = None,
        layout: Layout | None = None,
    ) -> None:
        states, rewards, ends = (
            _array("next_state", next_state),
            _array("reward", reward),
            _array("terminated", terminated),
        )
        _check_outcomes(states, rewards, ends, with_probability=probability is not None)
        self.n_states, self.n_actions = int(states.shape[0]), int(states.shape[1])
        self.action_sizes = _action_sizes(action_sizes, self.n_actions)
        start_state, start_cumulative = _start(start, self.n_states)
        limit = _limit(max_episode_steps)
        self.max_episode_steps = None if limit == NO_LIMIT else limit
        self.heuristic = None if heuristic is None else check_heuristic(heuristic, self.n_states)
        self.layout = check_layout(layout, self.n_states)
        kept, offsets, cumulative = _outcomes(states, probability)
        arrays = MDPArrays(
            next_state=states[kept].astype(np.uint32),
            reward=rewards[kept].astype(np.float64),
            terminated=ends[kept].astype(np.bool_),
            offsets=offsets,
            cumulative=cumulative,
            start_state=start_state,
            start_cumulative=start_cumulative,
            action_mask=_checked_mask(action_mask, states.shape[:2]),
            n_actions=self.n_actions,
            max_episode_steps=limit,
        )
        self.arrays = _read_only(arrays)

    @classmethod
    def from_arrays(
        cls,
        arrays: MDPArrays,
        n_states: int,
        heuristic: FloatArray | None = None,
        action_sizes: Sequence[int] | None = None,
        layout: Layout | None = None,
    ) -> "TabularMDP":
        """Return the MDP whose `arrays` were taken from another one (they are not checked again)."""
        mdp = cls.__new__(cls)
        mdp.n_states, mdp.n_actions = n_states, arrays.n_actions
        mdp.action_sizes = _action_sizes(action_sizes, arrays.n_actions)
        limit = arrays.max_episode_steps
        mdp.max_episode_steps = None if limit == NO_LIMIT else limit
        mdp.heuristic, mdp.layout = heuristic, layout
        mdp.arrays = _read_only(arrays)
        return mdp

    shares_world = False
    is_capped = False  # whether the time limit is ours, as there was none
    source: str | None = None
    """What the environment is called that carried it; None where there was none."""

    def world(self) -> World:
        """Return a world for one agent; all may read the same arrays."""
        return World(self.arrays, (self.arrays.action_mask,))

    def with_time_limit(self, max_episode_steps: int | None) -> "TabularMDP":
        """Return the same MDP (sharing its arrays) with another limit on an episode's steps."""
        arrays = self.arrays._replace(max_episode_steps=_limit(max_episode_steps))
        limited = TabularMDP.from_arrays(arrays, self.n_states, self.heuristic, self.action_sizes, self.layout)
        limited.source = self.source
        return limited

    def __repr__(self) -> str:
        return (
            f"TabularMDP({self.n_states} states, {self.n_actions} actions, {self.arrays.next_state.size} outcomes, "
            f"max_episode_steps={self.max_episode_steps})"
        )


def check_heuristic(heuristic: ArrayLike, n_states: int) -> FloatArray:
    """Return `heuristic` as a read-only (S,) float64 array.

    Raises
    ------
    ProblemError
        If it has another shape or a value that is not finite.
    """
    values = _numbers("heuristic", heuristic).copy()
    if values.shape != (n_states,) or not np.isfinite(values).all():
        raise ProblemError(
            f"heuristic must be {n_states} finite numbers, one for each state; got an array of shape {values.shape}"
            f"{'' if np.isfinite(values).all() else ' with values that are not finite'}"
        )
    values.flags.writeable = False
    return values


def check_layout(layout: Layout | None, n_states: int) -> Layout | None:
    """Return `layout` as (rows, columns) of a grid of `n_states` cells, or None.

    Raises
    ------
    ProblemError
        If it has another number of cells.
    """
    if layout is None:
        return None
    rows, columns = (check_int("each of layout", size, 1) for size in layout)
    if rows * columns != n_states:
        raise ProblemError(f"layout must be (rows, columns) of {n_states} cells; got {layout}")
    return rows, columns


def _checked_mask(action_mask: ArrayLike | None, shape: tuple[int, ...]) -> BoolArray:
    """Return where actions may be taken; (0, 0) where they all may."""
    if action_mask is None:
        return np.zeros((0, 0), dtype=np.bool_)
    allowed = _array("action_mask", action_mask)
    if allowed.dtype.kind != "b":
        raise ParameterTypeError(f"action_mask must hold {_KINDS['b']}; got dtype {allowed.dtype}")
    if allowed.shape != shape:
        raise ProblemError(f"action_mask must have the shape (S, A), {shape}; got {allowed.shape}")
    mask: BoolArray = allowed | ~allowed.any(axis=1, keepdims=True)
    return np.zeros((0, 0), dtype=np.bool_) if mask.all() else mask


def _array(name: str, values: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError as error:  # rows of several lengths
        raise ProblemError(f"{name} must be one array; {error}") from error


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    array = _array(name, values)
    if array.dtype.kind not in "iuf":
        raise ParameterTypeError(f"{name} must hold {_KINDS['iuf']}; got dtype {array.dtype}")
    return array.astype(np.float64, copy=False)


def _limit(max_episode_steps: int | None) -> int:
    """Return what kernels compare an episode's steps with."""
    if max_episode_steps is None:
        return NO_LIMIT
    return min(check_int("max_episode_steps", max_episode_steps, 1), NO_LIMIT)


def _action_sizes(sizes: object, n_actions: int) -> tuple[int, ...]:
    """Return how many actions each agent has."""
    if sizes is None:
        return (n_actions,)
    if not isinstance(sizes, (tuple, list)):
        raise ParameterTypeError(f"action_sizes must be one whole number for each agent; got {sizes!r}")
    checked = tuple(check_int("each of action_sizes", size, 1) for size in sizes)
    if math.prod(checked) != n_actions:
        raise ProblemError(f"action_sizes must multiply to the number of actions, {n_actions}; got {checked}")
    return checked


def _check_outcomes(
    states: NDArray[Any],
    rewards: NDArray[Any],
    ends: NDArray[Any],
    *,
    with_probability: bool,
) -> None:
    if states.ndim != 2 + with_probability or 0 in states.shape:
        expected = "(S, A, K) as probability is given" if with_probability else "(S, A), or (S, A, K) with probability"
        raise ProblemError(f"next_state must have the shape {expected}, no axis empty; got {states.shape}")
    for name, array, kinds in (
        ("next_state", states, "iu"),
        ("reward", rewards, "iuf"),
        ("terminated", ends, "b"),
    ):
        if array.shape != states.shape:
            raise ProblemError(f"{name} must have the shape of next_state, {states.shape}; got {array.shape}")
        if array.dtype.kind not in kinds:
            raise ParameterTypeError(f"{name} must hold {_KINDS[kinds]}; got dtype {array.dtype}")
    if states.min() < 0 or states.max() >= states.shape[0]:
        where = np.argwhere((states < 0) | (states >= states.shape[0]))[0]
        raise ProblemError(
            f"next_state must lie from 0 to {states.shape[0] - 1}; got {states[tuple(where)]} for (s, a) = "
            f"({where[0]}, {where[1]})"
        )
    if not np.isfinite(rewards.astype(np.float64)).all():
        raise ProblemError("reward must be finite everywhere; replace NaN and infinity by numbers")


_KINDS = {"iu": "integers", "iuf": "numbers", "b": "booleans"}


def _outcomes(states: NDArray[Any], probability: ArrayLike | None) -> tuple[BoolArray, IntArray, FloatArray]:
    """Return which outcomes are kept, where each pair's begin, and their summed probabilities."""
    nothing = np.zeros(0, dtype=np.int64)
    if probability is None:
        return np.ones(states.shape, dtype=np.bool_), nothing, np.zeros(0)
    p = _numbers("probability", probability)
    if p.shape != states.shape:
        raise ProblemError(f"probability must have the shape of next_state, {states.shape}; got {p.shape}")
    possible = (p >= 0) & (p <= 1 + SUM_TOLERANCE)
    right = possible.all(axis=2) & (np.abs(p.sum(axis=2, where=possible) - 1) <= SUM_TOLERANCE)
    if not right.all():
        s, a = np.argwhere(~right)[0]
        raise ProblemError(
            f"each pair's probabilities must be at least 0 and sum to 1; those of (s, a) = ({s}, {a}) are {p[s, a]}"
        )
    kept = p > 0
    counts = kept.sum(axis=2).ravel()
    if (counts == 1).all():
        return kept, nothing, np.zeros(0)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return kept, offsets, np.cumsum(p, axis=2)[kept]


def _start(start: int | ArrayLike, n_states: int) -> tuple[StateArray, FloatArray]:
    values = _array("start", start)
    if values.ndim == 0:
        state = check_int("start", values.item(), 0, n_states - 1)
        return np.array([state], dtype=np.uint32), np.ones(1)
    p = _numbers("start", values)
    if p.shape != (n_states,):
        raise ProblemError(f"start must be a state or {n_states} probabilities, one for each; got shape {p.shape}")
    if not ((p >= 0) & (p <= 1 + SUM_TOLERANCE)).all() or abs(p.sum() - 1) > SUM_TOLERANCE:
        raise ProblemError(f"start's probabilities must be at least 0 and sum to 1; got {p}")
    states = np.flatnonzero(p > 0)
    return states.astype(np.uint32), np.cumsum(p[states])


def _read_only(arrays: MDPArrays) -> MDPArrays:
    for array in arrays:
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return arrays
