"""Checks of transitions that are given as arrays of outcomes."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.checks import check_int
from tuckerl.errors import ParameterTypeError, ProblemError, SavedFileError
from tuckerl.problems.parts import as_array, as_numbers
from tuckerl.saved_arrays import SavedArrays
from tuckerl.types import BoolArray, FloatArray, IntArray, StateArray

SUM_TOLERANCE = 1e-8
"""How far the sum of probabilities may be from 1, where they are float64."""

_KINDS = {"iu": "integers", "iuf": "numbers", "b": "booleans"}


def check_mask(action_mask: ArrayLike | None, shape: tuple[int, ...]) -> BoolArray:
    """Return where actions may be taken, (S, A); (0, 0) where they all may.

    Raises
    ------
    ProblemError, ParameterTypeError
        If `action_mask` has another shape or type.
    """
    if action_mask is None:
        return np.zeros((0, 0), dtype=np.bool_)
    allowed = as_array("action_mask", action_mask)
    if allowed.dtype.kind != "b":
        raise ParameterTypeError(f"action_mask must hold {_KINDS['b']}; got dtype {allowed.dtype}")
    if allowed.shape != shape:
        raise ProblemError(f"action_mask must have the shape (S, A), {shape}; got {allowed.shape}")
    mask: BoolArray = allowed | ~allowed.any(axis=1, keepdims=True)
    return np.zeros((0, 0), dtype=np.bool_) if mask.all() else mask


def check_outcomes(states: NDArray[Any], rewards: NDArray[Any], ends: NDArray[Any], *, with_probability: bool) -> None:
    """Check next states, rewards and ends: one shape, the right types, states in range, finite rewards.

    Raises
    ------
    ProblemError, ParameterTypeError
        If something is wrong with them.
    """
    if states.ndim != 2 + with_probability or 0 in states.shape:
        expected = "(S, A, K) as probability is given" if with_probability else "(S, A), or (S, A, K) with probability"
        raise ProblemError(f"next_state must have the shape {expected}, no axis empty; got {states.shape}")
    for name, array, kinds in (("next_state", states, "iu"), ("reward", rewards, "iuf"), ("terminated", ends, "b")):
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
        raise ProblemError(
            "reward must be finite everywhere; replace NaN and infinity by numbers, and say by action_mask which "
            "actions may not be taken"
        )


def sum_tolerance(dtype: np.dtype[Any], count: int) -> float:
    """Return how far the sum of `count` probabilities of a type may be from 1: by their own rounding."""
    return max(SUM_TOLERANCE, count * float(np.finfo(dtype).eps)) if dtype.kind == "f" else SUM_TOLERANCE


def normalised(name: str, given: ArrayLike, what: str) -> FloatArray:
    """Return probabilities, (..., K), as float64 that sum to 1 along the last axis.

    Those of float64 stay as they are, others are divided by their sum.

    Parameters
    ----------
    name, what : str
        What the array and the probabilities in it are called in messages.
    given : array_like

    Raises
    ------
    ProblemError
        If one is below 0 or the sum of some is not 1, but for the rounding of their own type; it says where.
    ParameterTypeError
        If they are not numbers.
    """
    p, dtype = as_numbers(name, given), as_array(name, given).dtype
    tolerance = sum_tolerance(dtype, p.shape[-1])
    possible = (p >= 0) & (p <= 1 + tolerance)
    sums = p.sum(axis=-1, where=possible, keepdims=True)
    right = possible.all(axis=-1) & (np.abs(sums[..., 0] - 1) <= tolerance)
    if not right.all():
        place = tuple(map(int, np.argwhere(~right)[0])) if right.ndim else ()
        wrong = p[place]
        total = f"{math.fsum(wrong):.12g}" if np.isfinite(wrong).all() else "not finite"
        raise ProblemError(
            f"{what} must be at least 0 and sum to 1; {f'those of (s, a) = {place} are' if place else 'got'} {wrong}, "
            f"their sum is {total} ({tolerance:.0e} is allowed for rounding): divide them by it, in float64"
        )
    return p / sums if dtype.kind == "f" and dtype.itemsize < p.itemsize else p


def joined_outcomes(states: NDArray[Any], probability: ArrayLike | None) -> tuple[BoolArray, IntArray, FloatArray]:
    """Return which outcomes are kept, where each pair's begin, and their summed probabilities.

    Raises
    ------
    ProblemError, ParameterTypeError
        If a pair's probabilities are none.
    """
    nothing = np.zeros(0, dtype=np.int64)
    if probability is None:
        return np.ones(states.shape, dtype=np.bool_), nothing, np.zeros(0)
    given = as_array("probability", probability)
    if given.shape != states.shape:
        raise ProblemError(f"probability must have the shape of next_state, {states.shape}; got {given.shape}")
    p = normalised("probability", given, "each pair's probabilities")
    kept = p > 0
    counts = kept.sum(axis=2).ravel()
    if (counts == 1).all():
        return kept, nothing, np.zeros(0)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return kept, offsets, np.cumsum(p, axis=2)[kept]


def check_start(start: int | ArrayLike, n_states: int) -> tuple[StateArray, FloatArray]:
    """Return the states in which episodes may begin, and their summed probabilities.

    Raises
    ------
    ProblemError, ParameterError, ParameterTypeError
        If `start` is neither a state nor a probability of each.
    """
    values = as_array("start", start)
    if values.ndim == 0:
        state = check_int("start", values.item(), 0, n_states - 1)
        return np.array([state], dtype=np.uint32), np.ones(1)
    if values.shape != (n_states,):
        raise ProblemError(f"start must be a state or {n_states} probabilities, one for each; got shape {values.shape}")
    p = normalised("start", values, "start's probabilities")
    states = np.flatnonzero(p > 0)
    return states.astype(np.uint32), np.cumsum(p[states])


def read_transitions(arrays: SavedArrays, n_states: int, n_actions: int) -> dict[str, Any]:
    """Return the arrays of a table of transitions that a file holds, checked as those that a user gives.

    Parameters
    ----------
    arrays : SavedArrays
        By the names of :class:`tuckerl.problems.mdp.MDPArrays`.
    n_states, n_actions : int
        As the file says.

    Raises
    ------
    SavedFileError
        If they are no such table.
    """
    pairs = check_int("n_states", n_states, 1) * check_int("n_actions", n_actions, 1)
    offsets = arrays.take("offsets", np.int64, (range(0, pairs + 2, pairs + 1),), 0)
    if offsets.size and (offsets[0] != 0 or (np.diff(offsets) < 1).any()):
        raise SavedFileError("offsets must rise from 0, as each pair has an outcome")
    n = int(offsets[-1]) if offsets.size else pairs
    cumulative = arrays.take("cumulative", np.float64, (n if offsets.size else 0,))
    if offsets.size:
        _check_cumulative("cumulative", cumulative, offsets)
    start_state = arrays.take("start_state", np.uint32, (range(1, n_states + 1),), 0, n_states - 1)
    start_cumulative = arrays.take("start_cumulative", np.float64, start_state.shape)
    _check_cumulative("start_cumulative", start_cumulative, np.array([0, start_state.size]))
    if (np.diff(start_state.astype(np.int64)) < 1).any():
        raise SavedFileError("start_state must hold each state once, in order")
    size = arrays.shape("action_mask")
    mask = arrays.take("action_mask", np.bool_, (0, 0) if size == (0, 0) else (n_states, n_actions))
    if mask.size and not mask.any(axis=1).all():
        raise SavedFileError("action_mask must allow an action in every state")
    return {
        "next_state": arrays.take("next_state", np.uint32, (n,), 0, n_states - 1),
        "reward": arrays.take("reward", np.float64, (n,), finite=True),
        "terminated": arrays.take("terminated", np.bool_, (n,)),
        "offsets": offsets,
        "cumulative": cumulative,
        "start_state": start_state,
        "start_cumulative": start_cumulative,
        "action_mask": mask,
    }


def _check_cumulative(name: str, cumulative: FloatArray, offsets: IntArray) -> None:
    """Refuse numbers that are not the summed probabilities of the outcomes between `offsets`."""
    first = np.zeros(cumulative.size, dtype=np.bool_)
    first[offsets[:-1]] = True
    before = np.where(first, 0.0, np.concatenate([[0.0], cumulative[:-1]]))
    last = cumulative[offsets[1:] - 1]
    # Probabilities too small to change the sum leave it as it is.
    if not ((cumulative >= before).all() and (cumulative > 0.0).all() and (np.abs(last - 1.0) <= SUM_TOLERANCE).all()):
        raise SavedFileError(f"{name} must rise to 1 over the outcomes of each pair")
