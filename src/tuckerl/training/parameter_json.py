"""A learner's parameters as JSON, so that what is read is what was written, to the type: (1, 2) is no list."""

import math
from typing import Any

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.training.policies import POLICIES, policy_class
from tuckerl.training.policies.policy import Policy
from tuckerl.training.schedules import SCHEDULES, as_json, from_json

_PLAIN = (bool, int, str, type(None))


def to_json(name: str, value: Any) -> Any:
    """Return a parameter's value as JSON that `of_json` reads.

    Raises
    ------
    ParameterError
        If a file cannot hold it.
    """
    if isinstance(value, np.generic) and value.dtype.kind in "biuf":
        value = value.item()
    if type(value) is float:
        return value if math.isfinite(value) else {"float": str(value)}
    if type(value) in _PLAIN:
        return value
    if type(value) in SCHEDULES.values():
        return as_json(value)
    if isinstance(value, Policy):
        return _policy_to_json(value)
    if type(value) is list:
        return [to_json(name, entry) for entry in value]
    if type(value) is tuple:
        return {"tuple": [to_json(name, entry) for entry in value]}
    if type(value) is dict and all(type(key) is str for key in value):
        return {"dict": {key: to_json(name, entry) for key, entry in value.items()}}
    raise ParameterError(
        "a file holds numbers, text, None, schedules, tuckerl's own policies, arrays of numbers, and lists, tuples and "
        f"dicts (by text) of these but arrays; the parameter {name} has {value!r:.80} in it: keep it in such a form"
    )


def in_words(value: Any) -> Any:
    """Return a parameter as people and comparisons read it: schedules and policies by name and numbers."""
    return _policy_to_json(value) if isinstance(value, Policy) else as_json(value)


def of_json(value: Any) -> Any:
    """Return the value that `to_json` was given.

    Raises
    ------
    SavedFileError
        If it was given none.
    """
    if isinstance(value, list):
        return [of_json(entry) for entry in value]
    if not isinstance(value, dict):
        return value
    if "schedule" in value:
        return from_json(value)
    if "policy" in value:
        kind = policy_class(value["policy"])
        return kind(**{name: of_json(entry) for name, entry in value.items() if name != "policy"})
    ((form, held),) = value.items() if len(value) == 1 else ((None, None),)
    if form == "float" and held in ("nan", "inf", "-inf"):
        return float(held)
    if form == "tuple" and isinstance(held, list):
        return tuple(of_json(held))
    if form == "dict" and isinstance(held, dict):
        return {key: of_json(entry) for key, entry in held.items()}
    raise SavedFileError(f"it has a parameter of an unknown form, {', '.join(value)!r:.60}")


def _policy_to_json(policy: Policy) -> dict[str, Any]:
    """Return a registered policy by its class and its constructor's parameters, which it keeps as attributes."""
    kind = type(policy).__name__
    if kind not in POLICIES or policy_class(kind) is not type(policy):
        raise ParameterError(f"only tuckerl's own policies can be saved in a file; {shown(policy)} is none of them")
    return {"policy": kind} | {name: to_json(name, getattr(policy, name)) for name in policy.parameters()}


def check_array(name: str, array: np.ndarray) -> None:
    """Refuse a parameter that is an array which a file cannot hold.

    Raises
    ------
    ParameterError
        If that is so.
    """
    if type(array) is not np.ndarray or array.dtype.hasobject or array.dtype.itemsize == 0:
        raise ParameterError(
            f"a file holds plain arrays of numbers; the parameter {name} is a {type(array).__name__} of {array.dtype}: "
            "keep it as an array of numbers"
        )
