"""Checks: what passes comes back plain, what does not is told in one sentence."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from tuckerl.checks import check_int, check_name, check_real
from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError


@pytest.mark.parametrize("value", [1, 1.0, np.float32(1), np.int8(1), Fraction(1)])
def test_real_numbers_become_floats(value: Any) -> None:
    number = check_real("x", value, 0, 1)
    assert type(number) is float
    assert number == 1.0


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (math.nan, ParameterError),
        (math.inf, ParameterError),
        (-math.inf, ParameterError),
        (True, ParameterTypeError),
        ("1", ParameterTypeError),
        (None, ParameterTypeError),
        (1j, ParameterTypeError),
        ([1.0], ParameterTypeError),
    ],
)
def test_what_is_no_finite_number(value: Any, error: type[Exception]) -> None:
    with pytest.raises(error, match="x must be a finite number; got"):
        check_real("x", value)


def test_open_and_closed_ends() -> None:
    assert check_real("x", 0, 0, 1) == 0
    assert check_real("x", 1, 0, 1) == 1
    assert check_real("x", 5, 0) == 5
    with pytest.raises(ParameterError, match=r"x must be a number in \(0, 1\]; got 0\.0"):
        check_real("x", 0, 0, 1, low_open=True)
    with pytest.raises(ParameterError, match=r"x must be a number in \[0, 1\); got 1\.0"):
        check_real("x", 1, 0, 1, high_open=True)
    with pytest.raises(ParameterError, match=r"\[0, 1\]; got -5e-324"):
        check_real("x", -5e-324, 0, 1)


def test_whole_numbers_become_ints() -> None:
    for value in (3, np.int64(3), np.uint8(3)):
        number = check_int("n", value, 3, 3)
        assert type(number) is int
        assert number == 3


@pytest.mark.parametrize(
    ("bounds", "value", "message"),
    [
        ((None, None), 1.0, r"n must be a whole number; got 1\.0 of type float"),
        ((1, None), 0, "n must be a whole number of at least 1; got 0"),
        ((None, 4), 5, "n must be a whole number of at most 4; got 5"),
        ((1, 4), 5, "n must be a whole number from 1 to 4; got 5"),
        ((1, 4), True, "from 1 to 4; got True of type bool"),
        ((1, 4), "2", "from 1 to 4; got '2' of type str"),
    ],
)
def test_wrong_whole_numbers(bounds: tuple[int | None, int | None], value: Any, message: str) -> None:
    error = ParameterError if type(value) is int else ParameterTypeError
    with pytest.raises(error, match=message):
        check_int("n", value, *bounds)


def test_names() -> None:
    assert check_name("colour", "red", ["red", "green"]) == "red"
    with pytest.raises(UnknownNameError, match=r"unknown colour 'gren': did you mean 'green'\?"):
        check_name("colour", "gren", ["red", "green"])
    with pytest.raises(UnknownNameError, match=r"unknown colour 'RED': did you mean 'red'\?"):
        check_name("colour", "RED", ["red", "green"])
    with pytest.raises(UnknownNameError, match="unknown colour 'x': use one of green, red"):
        check_name("colour", "x", iter(["red", "green"]))
    with pytest.raises(ParameterTypeError, match="colour must be one of green, red; got 3"):
        check_name("colour", 3, ["red", "green"])
