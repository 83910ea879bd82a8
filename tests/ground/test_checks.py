"""Checks: what passes comes back plain, what does not is told in one sentence."""

import math
from collections import deque
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.calls.values import in_itself, nested
from tuckerl.checks import (
    check_function,
    check_int,
    check_name,
    check_path,
    check_real,
    check_sequence,
    check_text,
    refuse_mask,
    shown,
    to_array,
)
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
        (np.timedelta64(1), ParameterTypeError),
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
        ((1, 4), np.timedelta64(2), "from 1 to 4; got .* of type timedelta64"),
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


class Text(str):
    """Text of a kind that no file could hold."""

    __slots__ = ()


def test_text_becomes_plain() -> None:
    assert type(check_name("colour", Text("red"), ["red"])) is str
    assert type(check_text("title", Text("red"))) is str
    with pytest.raises(ParameterTypeError, match=r"title must be text; got b'x' of type bytes"):
        check_text("title", b"x")


@pytest.mark.parametrize("value", [[1, 2], (1, 2), range(1, 3), np.array([1, 2]), deque([1, 2])])
def test_sequences_become_tuples(value: Any) -> None:
    assert check_sequence("ranks", value, "numbers") == check_sequence("ranks", value, "numbers", 2) == (1, 2)


@pytest.mark.parametrize("value", [3, "ab", b"ab", None, {1: 2}, {1, 2}, iter([1, 2]), np.array(2), memoryview(b"ab")])
def test_what_is_no_sequence(value: Any) -> None:
    with pytest.raises(ParameterTypeError, match=r"ranks must be two numbers; got .* of type"):
        check_sequence("ranks", value, "two numbers", 2)


@pytest.mark.parametrize("value", [[1], (1, 2, 3), range(10**30), np.zeros((4, 2))])
def test_sequences_of_other_lengths(value: Any) -> None:
    with pytest.raises(ParameterError, match=r"ranks must be two numbers; got [134]: "):
        check_sequence("ranks", value, "two numbers", 2)


def test_paths() -> None:
    assert check_path("path", "a/b") == check_path("path", Path("a", "b")) == Path("a/b")
    for value in (3, b"a", None, ["a"]):
        with pytest.raises(ParameterTypeError, match=r"path must be a path, text or a pathlib\.Path; got"):
            check_path("path", value)
    with pytest.raises(ParameterError, match="path must have no null character in it; got"):
        check_path("path", "a\0b")
    with pytest.raises(ParameterError, match=r"path must be a path that can be written; got '\\ud800'"):
        check_path("path", "\ud800")


def test_functions() -> None:
    for right in (lambda a, b: 0, lambda *a: 0, lambda a, b, c=1: 0, print, dict):
        check_function("share", right, "context, rng")
    with pytest.raises(ParameterTypeError, match=r"share must be a function of \(context\); got 3"):
        check_function("share", 3, "context")
    for wrong in (lambda: 0, lambda a, b: 0, lambda a, *, b: 0):
        with pytest.raises(ParameterError, match=r"share must take \(context\); got <function"):
            check_function("share", wrong, "context")


class Without:
    """An object that cannot be shown."""

    def __repr__(self) -> str:
        raise OSError


@pytest.mark.parametrize(
    "values", [[[1], [1, 2]], in_itself(), nested(100_000), range(10**18), [np.ones(2), np.ones(3)]]
)
def test_what_numpy_makes_no_array_of(values: Any) -> None:
    with pytest.raises(ParameterTypeError, match="X must be an array; got"):
        to_array("X", values, "an array")


def test_masks_are_found_in_lists_within_themselves() -> None:
    refuse_mask("X", nested(100_000))
    values = in_itself()
    refuse_mask("X", values)
    values.append(np.ma.masked_array([1.0], [True]))
    with pytest.raises(ParameterTypeError, match="X must have no mask"):
        refuse_mask("X", values)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (10**5000, "about 10^5000"),
        ([10**5000], "a list"),
        (nested(100_000), "a list"),
        (Without(), "a Without"),
        ("a" * 500, f"'{'a' * 116}..."),
        ("a\n b", r"'a\n b'"),
    ],
    ids=["digits", "digits in a list", "levels", "no repr", "long", "lines"],
)
def test_every_value_can_be_shown(value: Any, text: str) -> None:
    assert shown(value) == text
