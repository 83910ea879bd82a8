"""Checks of what users pass in, one sentence each when it is wrong.

A check returns the value in the form that the code behind it works with (a plain ``float``, ``int``, ...).
"""

import difflib
import math
from collections.abc import Iterable
from numbers import Integral, Real

import numpy as np

from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError


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
    if isinstance(value, bool) or not isinstance(value, Real):
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
    if isinstance(value, bool) or not isinstance(value, Integral):
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
    except ValueError:  # Python writes no whole number of thousands of digits
        return f"about 10^{int(math.log10(abs(value)))}" if isinstance(value, int) else f"a {type(value).__name__}"
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 3]}..."


def refuse_mask(name: str, values: object) -> None:
    """Refuse a masked array, or lists with one in them: NumPy would take what lies under the mask.

    Raises
    ------
    ParameterTypeError
        If there is one.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise ParameterTypeError(
            f"{name} must have no mask, which says that some numbers are none; got a masked array: replace these "
            "first, with numpy.ma.filled(array, fill_value)"
        )
    if isinstance(values, (list, tuple)):
        for part in values:
            if not isinstance(part, (int, float, str)):
                refuse_mask(name, part)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the question which known name may have been meant; "" where none is close."""
    folded = {one.lower(): one for one in known}
    close = difflib.get_close_matches(name.lower(), folded, n=1)
    return f"did you mean {folded[close[0]]!r}?" if close else ""


_FEW = 12  # names that still make one readable sentence


def check_name(kind: str, value: object, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` names; otherwise say which one may have been meant.

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
        return value
    others = f"use one of {', '.join(names)}" if len(names) <= _FEW else f"none of the {len(names)} known is close"
    raise UnknownNameError(f"unknown {kind} {shown(value)}: {did_you_mean(value, names) or others}")
