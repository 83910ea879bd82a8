"""Checks of what users pass in, one sentence each when it is wrong.

A check returns the value in the form that the code behind it works with (a plain ``float``, ``int``, ...).
"""

import difflib
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from inspect import isfunction, signature
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError

_NO_NUMBERS = (bool, np.timedelta64)  # though Python takes the one, and NumPy the other, for whole numbers


def check_real(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    low_open: bool = False,
    high_open: bool = False,
) -> float:
    """Return `value` as a float inside the interval from `low` to `high`.

    Raises
    ------
    ParameterTypeError
        If it is not a real number.
    ParameterError
        If it is NaN, infinite or outside the interval.
    """
    left, right = "(" if low_open else "[", ")" if high_open else "]"
    expected = f"{name} must be a finite number"
    if math.isfinite(low) and math.isfinite(high):
        expected = f"{name} must be a number in {left}{low:g}, {high:g}{right}"
    elif math.isfinite(low):
        expected += f" {'above' if low_open else 'of at least'} {low:g}"
    elif math.isfinite(high):
        expected += f" {'below' if high_open else 'of at most'} {high:g}"
    if isinstance(value, _NO_NUMBERS) or not isinstance(value, Real):
        raise ParameterTypeError(f"{expected}; got {shown(value)} of type {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    below = number <= low if low_open else number < low
    above = number >= high if high_open else number > high
    if not math.isfinite(number) or below or above:
        raise ParameterError(f"{expected}; got {number!r}")
    return number


def check_int(name: str, value: object, low: int | None = None, high: int | None = None) -> int:
    """Return `value` as an int of at least `low` and at most `high`.

    Raises
    ------
    ParameterTypeError
        If it is not a whole number.
    ParameterError
        If it is outside the bounds.
    """
    bounds = {
        (False, False): "",
        (True, False): f" of at least {low}",
        (False, True): f" of at most {high}",
        (True, True): f" from {low} to {high}",
    }[(low is not None, high is not None)]
    expected = f"{name} must be a whole number{bounds}"
    if isinstance(value, _NO_NUMBERS) or not isinstance(value, Integral):
        raise ParameterTypeError(f"{expected}; got {shown(value)} of type {type(value).__name__}")
    number = int(value)
    if (low is not None and number < low) or (high is not None and number > high):
        raise ParameterError(f"{expected}; got {shown(number)}")
    return number


def check_flag(name: str, value: object) -> bool:
    """Return `value` if it is True or False.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise ParameterTypeError(f"{name} must be True or False; got {shown(value)}")


MOST_SHOWN = 120
"""Characters of a value that a message shows."""


def shown(value: object) -> str:
    """Return how Python writes a value, in one line, cut where it would fill the screen."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # noqa: BLE001  # a user's own; and Python writes no lists of thousands of levels or digits
        return f"about 10^{int(math.log10(abs(value)))}" if isinstance(value, int) else f"a {type(value).__name__}"
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 3]}..."


def refuse_mask(name: str, values: object) -> None:
    """Refuse a masked array, or lists with one in them: NumPy would take what lies under the mask.

    Raises
    ------
    ParameterTypeError
        If there is one.
    """
    parts, seen = [values], set()  # of lists, one of which may be in itself
    while parts:
        part = parts.pop()
        if isinstance(part, np.ma.MaskedArray):
            raise ParameterTypeError(
                f"{name} must have no mask, which says that some numbers are none; got a masked array: replace these "
                "first, with numpy.ma.filled(array, fill_value)"
            )
        if isinstance(part, (list, tuple)) and id(part) not in seen:
            seen.add(id(part))
            parts.extend(one for one in part if not isinstance(one, (int, float, str)))


NO_ARRAY = (ValueError, TypeError, OverflowError, RecursionError, MemoryError)
"""What NumPy raises where it makes no array of something, such as of lists of several lengths."""


def to_array(name: str, values: object, expected: str) -> NDArray[Any]:
    """Return what a user gave as one array, of whatever type and shape.

    Parameters
    ----------
    name : str
    values
    expected : str
        What messages say that it must be.

    Raises
    ------
    ParameterTypeError
        If NumPy makes no array of it, such as of rows of several lengths, or there is a masked array in it.
    """
    refuse_mask(name, values)
    try:
        return np.asarray(values)
    except NO_ARRAY as error:
        raise ParameterTypeError(f"{name} must be {expected}; got {shown(values)}: {error}") from error


def array_of_kinds(name: str, values: object, kinds: str) -> NDArray[Any] | None:
    """Return what a user gave as an array, None where it is none or of another kind.

    Parameters
    ----------
    name : str
    values
    kinds : str
        NumPy's letters of the types that it may have, such as "biuf" for booleans and real numbers.

    Raises
    ------
    ParameterTypeError
        If there is a masked array in it.
    """
    refuse_mask(name, values)
    try:
        array = np.asarray(values)
    except NO_ARRAY:
        return None
    return array if array.dtype.kind in kinds else None


def check_sequence(name: str, value: object, expected: str, length: int | None = None) -> tuple[Any, ...]:
    """Return the entries of a sequence: a list, a tuple, a range, an array, ...

    Parameters
    ----------
    name : str
    value
    expected : str
        What messages say that it must be.
    length : int, optional
        How many entries it must have.

    Raises
    ------
    ParameterTypeError
        If it is something else, text or a masked array.
    ParameterError
        If it has another length.
    """
    refuse_mask(name, value)
    is_array = isinstance(value, np.ndarray) and value.ndim > 0
    if isinstance(value, range):
        value = value[: _MOST_ENTRIES if length is None else length + 1]
    if not is_array and (not isinstance(value, Sequence) or isinstance(value, (str, bytes, bytearray, memoryview))):
        raise ParameterTypeError(f"{name} must be {expected}; got {shown(value)} of type {type(value).__name__}")
    sequence: Sequence[Any] = value  # type: ignore[assignment]  # an array is one, too
    if length not in (None, len(sequence)):  # before entries of large views are made
        raise ParameterError(f"{name} must be {expected}; got {len(sequence)}: {shown(value)}")
    return tuple(sequence)


_MOST_ENTRIES = 10**6  # of a range, which may have more than any memory


def check_text(name: str, value: object) -> str:
    """Return `value` if it is text.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if isinstance(value, str):
        return str(value)
    raise ParameterTypeError(f"{name} must be text; got {shown(value)} of type {type(value).__name__}")


def check_path(name: str, value: object) -> Path:
    """Return a file's or a folder's path.

    Raises
    ------
    ParameterTypeError
        If it is no text and no path.
    ParameterError
        If no system has such a path.
    """
    text = os.fspath(value) if isinstance(value, os.PathLike) else value
    if not isinstance(text, str):
        raise ParameterTypeError(f"{name} must be a path, text or a pathlib.Path; got {shown(value)}")
    try:
        encoded = os.fsencode(text)
    except UnicodeEncodeError as error:
        raise ParameterError(f"{name} must be a path that can be written; got {text!a:.120}") from error
    if b"\0" in encoded:
        raise ParameterError(f"{name} must have no null character in it; got {shown(text)}")
    return Path(text)


def check_function(name: str, function: object, arguments: str) -> None:
    """Refuse what cannot be called with so many arguments by position.

    Parameters
    ----------
    name : str
    function
    arguments : str
        Their names, with commas between them.

    Raises
    ------
    ParameterTypeError
        If it is no function.
    ParameterError
        If it takes others.
    """
    if not callable(function):
        raise ParameterTypeError(f"{name} must be a function of ({arguments}); got {shown(function)}")
    try:
        taken = signature(function)
    except (ValueError, TypeError):  # of some built-in ones nobody knows
        return
    try:
        taken.bind(*filter(None, arguments.split(",")))
    except TypeError as error:
        raise ParameterError(f"{name} must take ({arguments}); got {shown(function)}, of {taken}: {error}") from error


def check_actions(actions: object, agents: Sequence[str]) -> None:
    """Refuse actions that are not a mapping from each of the agents.

    Raises
    ------
    ParameterError
        If that is so.
    """
    if not isinstance(actions, Mapping) or set(actions) != set(agents):
        raise ParameterError(f"actions must name {' and '.join(agents)}; got {shown(actions)}")


def check_python_function(name: str, function: object) -> None:
    """Refuse what is no function written in Python, whether its user has compiled it or not.

    Raises
    ------
    ParameterTypeError
        If it is something else.
    """
    if not isfunction(getattr(function, "py_func", function)):
        raise ParameterTypeError(f"{name} must be a Python function; got {shown(function)}")


_FEWEST_LETTERS = 2  # that tell a name by its beginning


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the question which known name may have been meant; "" where none is close.

    A name that begins as the given one comes first, the shortest of them, then one that is spelt alike, then one that
    has it inside.
    """
    folded, given = {one.lower(): one for one in known}, name.lower()
    by_length = sorted(sorted(folded, reverse=True), key=len)  # of versions, the latest first
    begins = [one for one in by_length if len(given) >= _FEWEST_LETTERS and one.startswith(given)]
    alike = difflib.get_close_matches(given, folded, n=1)
    has = [one for one in by_length if len(given) > _FEWEST_LETTERS and given in one]
    close = [*begins, *alike, *has]
    return f"did you mean {folded[close[0]]!r}?" if close else ""


_FEW = 12  # names that still make one readable sentence


def check_name(kind: str, value: object, known: Iterable[str], more: str = "") -> str:
    """Return `value` if it is one of the `known` names; otherwise say which one may have been meant.

    `more` says where all are shown, for where they are too many to be named and none is close.

    Raises
    ------
    ParameterTypeError
        If it is not a string.
    UnknownNameError
        If it is not known.
    """
    names = sorted(known)
    if not isinstance(value, str):
        raise ParameterTypeError(f"{kind} must be one of {', '.join(names)}; got {shown(value)}")
    if value in names:
        return names[names.index(value)]  # plain text, also where a subclass of it came, which no file could hold
    others = (
        f"use one of {', '.join(names)}" if len(names) <= _FEW else f"none of the {len(names)} known is close{more}"
    )
    raise UnknownNameError(f"unknown {kind} {shown(value)}: {did_you_mean(value, names) or others}")
