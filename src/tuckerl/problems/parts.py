"""Checks of the parts that problems of all kinds have: limits, names, sizes, arrays of numbers."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, NotRequired, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.checks import NO_ARRAY, array_of_kinds, check_int, check_sequence, refuse_mask, shown
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.types import FloatArray

NO_LIMIT = np.iinfo(np.int64).max
"""The time limit that kernels read where there is none."""

STEP_CAP = 100_000
"""Steps after which learners cut off an episode where neither the problem nor the user has set a limit."""

Layout = tuple[int, int]
"""(rows, columns) of a grid whose cells are the states, row by row."""


class StateFactor(NamedTuple):
    """One of the digits that a state's number is made of; the last factor changes fastest."""

    name: str
    size: int


class StoredSimulator(TypedDict):
    """What a file holds of a simulator; format 1 holds no more than its sizes."""

    simulator: tuple[int, int, int | None]
    source: NotRequired[str | None]
    description: NotRequired[dict[str, Any]]


def check_limit(max_episode_steps: int | None) -> int | None:
    """Return a time limit, None for one that no episode reaches.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is not a whole number of at least 1.
    """
    if max_episode_steps is None or check_int("max_episode_steps", max_episode_steps, 1) >= NO_LIMIT:
        return None
    return int(max_episode_steps)


def check_heuristic(heuristic: ArrayLike, n_states: int) -> FloatArray:
    """Return `heuristic` as a (S,) float64 array.

    Raises
    ------
    ProblemError
        If it has another shape or a value that is not finite.
    """
    values = as_numbers("heuristic", heuristic)
    expected = f"heuristic must be {n_states} finite numbers, one for each state"
    if values.shape != (n_states,):
        raise ProblemError(f"{expected}; got an array of shape {values.shape}")
    if not np.isfinite(values).all():
        raise ProblemError(f"{expected}; got values that are not finite")
    return values


def check_parameters(parameters: ArrayLike) -> FloatArray:
    """Return `parameters` as a (P,) float64 array.

    Raises
    ------
    ProblemError
        If they are not finite numbers.
    """
    numbers = as_numbers("parameters", parameters).reshape(-1)
    if not np.isfinite(numbers).all():
        raise ProblemError(f"parameters must be finite numbers; got {numbers}")
    return numbers


def check_layout(layout: Layout | None, n_states: int) -> Layout | None:
    """Return `layout` as (rows, columns) of a grid of `n_states` cells, or None.

    Raises
    ------
    ProblemError
        If it has another number of cells.
    """
    if layout is None:
        return None
    sizes = check_sequence("layout", layout, "(rows, columns)", 2)
    rows, columns = (check_int("each of layout", size, 1) for size in sizes)
    if rows * columns != n_states:
        raise ProblemError(f"layout must be (rows, columns) of {n_states} cells; got ({shown(rows)}, {shown(columns)})")
    return rows, columns


def check_action_names(names: Sequence[str] | None, n_actions: int) -> tuple[str, ...] | None:
    """Return `names` as one string for each action, or None.

    Raises
    ------
    ProblemError
        If there is another number of them, or one cannot be written.
    """
    if names is None:
        return None
    expected = f"{n_actions} names, one for each action"
    listed = list(names) if isinstance(names, str) else check_sequence("action_names", names, expected)
    if len(listed) != n_actions:
        raise ProblemError(f"action_names must be {expected}; got {len(listed)}")
    try:
        return tuple(map(str, listed))
    except ValueError as error:  # Python writes no integer of thousands of digits
        raise ProblemError(f"action_names must be {expected}; one of them cannot be written ({error})") from error


def as_array(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return `values` as one array.

    Raises
    ------
    ProblemError
        If they are rows of several lengths.
    ParameterTypeError
        If there is a masked array in them.
    """
    refuse_mask(name, values)
    try:
        return np.asarray(values)
    except NO_ARRAY as error:
        raise ProblemError(f"{name} must be one array; {error}") from error


def as_numbers(name: str, values: ArrayLike) -> FloatArray:
    """Return `values` as a float64 array.

    Raises
    ------
    ParameterTypeError
        If they are not numbers.
    """
    array = as_array(name, values)
    if array.dtype.kind not in "iuf":
        raise ParameterTypeError(f"{name} must hold numbers; got dtype {array.dtype}")
    return array.astype(np.float64, copy=False)


def check_action_sizes(sizes: object, n_actions: int) -> tuple[int, ...]:
    """Return how many actions each agent has; their product is `n_actions`.

    Raises
    ------
    ProblemError, ParameterError, ParameterTypeError
        If they are not such numbers.
    """
    if sizes is None:
        return (n_actions,)
    if not isinstance(sizes, (tuple, list)):
        raise ParameterTypeError(f"action_sizes must be one whole number for each agent; got {shown(sizes)}")
    checked = tuple(check_int("each of action_sizes", size, 1) for size in sizes)
    if math.prod(checked) != n_actions:
        raise ProblemError(f"action_sizes must multiply to the number of actions, {n_actions}; got {checked}")
    return checked


def check_state_factors(factors: Sequence[tuple[str, int]] | None, n_states: int) -> tuple[StateFactor, ...] | None:
    """Return the digits of a state's number, or None; their sizes multiply to `n_states`.

    Raises
    ------
    ProblemError, ParameterError, ParameterTypeError
        If they do not.
    """
    if factors is None:
        return None
    expected = "pairs (name, size)"
    listed = check_sequence("state_factors", factors, expected)
    pairs = [check_sequence("each of state_factors", pair, expected, 2) for pair in listed]
    checked = tuple(StateFactor(str(name), check_int("each size of state_factors", size, 1)) for name, size in pairs)
    if math.prod(factor.size for factor in checked) != n_states:
        raise ProblemError(
            f"the sizes of state_factors must multiply to the number of states, {n_states}; got {shown(factors)}"
        )
    return checked


def check_states(observation: Any, n_states: int) -> NDArray[Any]:
    """Return a state's number, or several, as an array of integers.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is no such number.
    """
    states = array_of_kinds("an observation", observation, "iu")
    if states is None:
        hint = ""
        if isinstance(observation, Mapping):  # of agents whose joint transitions were extracted
            hint = ": pass the joint state's, such as env.state(), or learn with compiled=False to pass what agents "
            hint += "observe"
        raise ParameterTypeError(f"an observation must be a state's number; got {shown(observation)}{hint}")
    if states.size and (states.min() < 0 or states.max() >= n_states):
        raise ParameterError(f"an observation must be a state from 0 to {n_states - 1}; got {shown(observation)}")
    return states


def joint_names(names_by_agent: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the names of joint actions, in C order over the agents.

    Examples
    --------
    >>> joint_names([("left", "right"), ("up", "down")])
    ('left, up', 'left, down', 'right, up', 'right, down')
    """
    return tuple(map(", ".join, itertools.product(*names_by_agent)))
