"""What environments return from `reset` and `step`, read so that what is none of it is named, with the way out.

Reading is on the way of every step: callers unpack and look up first, and ask the functions here where that fails.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import ProblemError
from tuckerl.problems.dynamics import TERMINATED, TRUNCATED

_OLDER = (
    "Gym's older API does: return what Gymnasium asks for, or make it by shimmy's "
    "gymnasium.make('GymV21Environment-v0', env=env)"
)

#: How an episode ended, by (terminated, truncated), whatever of Python's or NumPy's these are that equals 0 or 1.
ENDS = {(a, b): (TERMINATED if a else 0) | (TRUNCATED if b else 0) for a in (False, True) for b in (False, True)}


def ends_of(terminated: Any, truncated: Any) -> int:
    """Return how an episode ended, by `ENDS` where it says so; 0-d arrays, too, are True or False.

    Raises
    ------
    ProblemError
        If one is neither.
    """
    try:
        return ENDS[terminated, truncated]
    except (KeyError, TypeError):
        return ENDS[as_flag("terminated", terminated), as_flag("truncated", truncated)]


def as_flag(name: str, value: Any) -> bool:
    """Return a flag that an environment returned.

    Raises
    ------
    ProblemError
        If it is neither True nor False, 1 nor 0.
    """
    if type(value) is bool:
        return value
    array = np.asarray(value) if isinstance(value, (bool, int, float, np.generic, np.ndarray)) else np.empty(2)
    if array.size == 1 and array.dtype.kind in "biuf" and array.item() in (0, 1):
        return bool(array.item())
    raise ProblemError(f"`{name}` must be True or False; the environment returned {shown(value)}")


def step_result(result: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Return the five parts of what a parallel environment's step returned.

    Raises
    ------
    ProblemError
        If there are not five.
    """
    _check_five(result)
    observation, reward, terminated, truncated, info = result
    return observation, reward, terminated, truncated, info


def check_step(result: Any) -> None:
    """Refuse what no step returns: another number of values, or a reward that is no number.

    Raises
    ------
    ProblemError
        If it is that.
    """
    _check_five(result)
    check_reward(result[1])


def _check_five(result: Any) -> None:
    expected = "step must return (observation, reward, terminated, truncated, info)"
    if not isinstance(result, (tuple, list)) or len(result) != 5:
        is_old = isinstance(result, tuple) and len(result) == 4
        got = f"four values, as {_OLDER}" if is_old else f"{shown(result)}: return these five values"
        raise ProblemError(f"{expected}; it returned {got}")


def check_reward(reward: Any) -> None:
    """Refuse a reward that is no number.

    Raises
    ------
    ProblemError
        If it is that.
    """
    if type(reward) is float:  # as most are: NumPy would take as long as many an environment
        return
    try:
        is_number = np.ndim(reward) == 0 and not isinstance(reward, (str, bytes))
        float(reward)
    except (TypeError, ValueError):
        is_number = False
    if not is_number:
        raise ProblemError(
            f"a reward must be one number; the environment paid {shown(reward)}: where it pays several, make one of "
            "them, for example with gymnasium.wrappers.TransformReward(env, sum) or "
            "mo_gymnasium.wrappers.LinearReward(env, weight)"
        )


def reset_result(result: Any) -> tuple[Any, Any]:
    """Return the observation and the info that `reset` returned.

    Raises
    ------
    ProblemError
        If it returned anything else.
    """
    if isinstance(result, (tuple, list)) and len(result) == 2 and isinstance(result[1], Mapping):
        return result[0], result[1]
    raise ProblemError(
        f"reset must return (observation, info), info being a dict; it returned {shown(result)}; a bare observation is "
        f"what {_OLDER}"
    )
