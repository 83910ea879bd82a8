"""What a space is, as JSON, and what differs between two descriptions.

Gymnasium's own comparison allows Boxes to differ by rounding, and text leaves out types and the middle of long bounds.
"""

import hashlib
import math
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple
from numpy.typing import ArrayLike

Description = dict[str, Any]
"""JSON in which equal entries stand for equal things. Files sort its keys: where order matters, a list holds it."""

_KINDS = (Discrete, MultiDiscrete, MultiBinary, Box, Tuple, Dict)
_LISTED = 16  # more numbers are described by their digest
_LONGEST = 80  # characters of a value in a message
_DIGEST = "sha256 "


def describe_space(space: gymnasium.Space[Any]) -> Description:
    """Return all of a space that decides what its members mean: kind, shape, type, bounds, parts and their order.

    Examples
    --------
    >>> describe_space(Discrete(3, start=1))
    {'kind': 'Discrete', 'n': 3, 'start': 1, 'dtype': 'int64'}
    """
    kind = next((kind.__name__ for kind in _KINDS if isinstance(space, kind)), type(space).__name__)
    if isinstance(space, Tuple):
        return {"kind": kind, "parts": [describe_space(part) for part in space.spaces]}
    if isinstance(space, Dict):
        parts = {str(key): describe_space(part) for key, part in space.spaces.items()}
        return {"kind": kind, "keys": list(parts), "parts": parts}
    described: Description = {"kind": kind}
    if isinstance(space, Discrete):
        described |= {"n": int(space.n), "start": int(space.start)}
    else:
        described["shape"] = None if space.shape is None else list(space.shape)
    if isinstance(space, MultiDiscrete):
        described |= {"nvec": describe_numbers(space.nvec), "start": describe_numbers(space.start)}
    elif isinstance(space, Box):
        described |= {"low": describe_numbers(space.low), "high": describe_numbers(space.high)}
    return described | {"dtype": str(space.dtype)}


def describe_numbers(values: ArrayLike) -> str:
    """Return numbers as text: one where all are equal, a few one by one, more by their digest.

    Examples
    --------
    >>> describe_numbers([0.5, 2.0]), describe_numbers([[3, 3], [3, 3]])
    ('0.5, 2.0', '3')
    """
    array = np.asarray(values)
    if array.size and (array == array.flat[0]).all():
        return str(array.flat[0])
    return ", ".join(map(str, array.flat)) if array.size <= _LISTED else digest(array)


def digest(*arrays: ArrayLike) -> str:
    """Return the SHA-256 of arrays, their types and shapes."""
    hashed = hashlib.sha256()
    for values in arrays:
        array = np.asarray(values)
        hashed.update(f"{array.dtype.str} {array.shape} ".encode() + array.tobytes())
    return _DIGEST + hashed.hexdigest()


def numbered(described: Description) -> Description:
    """Return a Tuple of Discretes from 0 as the Discrete that C order makes of it; another space as it is."""
    parts = described["parts"] if described["kind"] == "Tuple" else []
    if not parts or any(part["kind"] != "Discrete" or part["start"] for part in parts):
        return described
    return {**parts[0], "n": math.prod(part["n"] for part in parts)}


def first_difference(before: Any, now: Any, name: str = "") -> str | None:
    """Return the first entry in which two descriptions differ, and both its values; None where they are equal.

    Examples
    --------
    >>> first_difference(describe_space(Discrete(3)), describe_space(Discrete(3, start=1)), "action")
    'action start was 0; got 1'
    """
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        if before.get("kind") != now.get("kind"):
            return f"{name} kind was {before.get('kind')}; got {now.get('kind')}".strip()
        missing = next((key for key in (*now, *before) if key not in before or key not in now), None)
        if missing is not None:
            return f"{name} {missing} was {_short(before.get(missing))}; got {_short(now.get(missing))}".strip()
        pairs: Any = [(str(key), before[key], now[key]) for key in now]
    elif _is_nested(before) and _is_nested(now) and len(before) == len(now):
        pairs = [(str(place), old, new) for place, (old, new) in enumerate(zip(before, now, strict=True))]
    else:
        return None if before == now else f"{name} was {_short(before)}; got {_short(now)}"
    differences = (first_difference(old, new, f"{name} {key}".strip()) for key, old, new in pairs)
    return next((difference for difference in differences if difference), None)


def difference_of_spaces(before: gymnasium.Space[Any], now: gymnasium.Space[Any], name: str) -> str | None:
    """Return the first thing in which two spaces differ; None where none does."""
    return None if before is now else first_difference(describe_space(before), describe_space(now), name)


def _is_nested(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(part, (dict, list)) for part in value)


def _short(value: Any) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    longest = len(_DIGEST) + 12 if text.startswith(_DIGEST) else _LONGEST
    return text if len(text) <= longest else f"{text[:longest]}..."
