"""Spaces as JSON: whatever changes what a member means changes the description, and the first change is named."""

import json
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Text, Tuple

from tuckerl.spaces.description import describe_numbers, describe_space, digest, first_difference, numbered

WALL = np.linspace(0, 1, 20, dtype=np.float32)

DIFFERENT = {
    "n": (Discrete(3), Discrete(4), "n was 3; got 4"),
    "start": (Discrete(3), Discrete(3, start=1), "start was 0; got 1"),
    "kind": (Discrete(2), MultiBinary(1), "kind was Discrete; got MultiBinary"),
    "nvec": (MultiDiscrete([2, 3]), MultiDiscrete([3, 2]), "nvec was 2, 3; got 3, 2"),
    "starts": (MultiDiscrete([2, 3]), MultiDiscrete([2, 3], start=[0, 1]), "start was 0; got 0, 1"),
    "shape": (
        MultiDiscrete(np.array([[2, 2]])),
        MultiDiscrete([2, 2]),
        "shape was 1, 2; got 2",
    ),
    "type": (MultiDiscrete([2, 3]), MultiDiscrete([2, 3], dtype=np.int32), "dtype was int64; got int32"),
    "bits": (MultiBinary(3), MultiBinary(4), "shape was 3; got 4"),
    "low": (Box(-1, 1, (2,)), Box(np.array([-1, -2]), 1, dtype=np.float32), r"low was -1.0; got -1.0, -2.0"),
    "high": (Box(-1, 1, (2,)), Box(-1, 1 + 1e-6, (2,)), "high was 1.0; got 1.00000"),
    "unbounded": (Box(0, np.inf, (2,)), Box(0, 9, (2,)), "high was inf; got 9.0"),
    "many": (Box(-WALL, WALL + 1), Box(-WALL, WALL + 2), r"high was sha256 \w{12}\.\.\.; got sha256 \w{12}\.\.\.$"),
    "precision": (Box(-1, 1, (2,)), Box(-1, 1, (2,), np.float64), "dtype was float32; got float64"),
    "parts": (Tuple([Discrete(2)]), Tuple([Discrete(2)] * 2), "parts was"),
    "order of parts": (
        Tuple([Discrete(2), Discrete(3)]),
        Tuple([Discrete(3), Discrete(2)]),
        "parts 0 n was 2; got 3",
    ),
    "keys": (Dict(a=Discrete(2)), Dict(b=Discrete(2)), "keys was a; got b"),
    "order of keys": (
        Dict([("a", Discrete(2)), ("b", Discrete(2))]),
        Dict([("b", Discrete(2)), ("a", Discrete(2))]),
        "keys was a, b; got b, a",
    ),
    "nested": (Dict(a=Tuple([Discrete(2)])), Dict(a=Tuple([Discrete(2, start=3)])), "parts a parts 0 start was 0; got"),
}


@pytest.mark.parametrize("what", DIFFERENT)
def test_the_first_difference_is_named(what: str) -> None:
    before, now, message = DIFFERENT[what]
    old, new = (json.loads(json.dumps(describe_space(space), sort_keys=True)) for space in (before, now))
    with pytest.raises(AssertionError, match=f"^action {message}"):
        raise AssertionError(first_difference(old, new, "action"))
    for space in (before, now):
        assert (
            first_difference(describe_space(space), json.loads(json.dumps(describe_space(space), sort_keys=True)))
            is None
        )


def test_numbers_are_text_without_loss() -> None:
    assert describe_numbers(np.array([0.1, np.nextafter(0.1, 1)])) == "0.1, 0.10000000000000002"
    assert describe_numbers([]) == ""
    assert describe_numbers(np.float64(1 / 3)) == "0.3333333333333333"
    assert digest(np.zeros(3)) != digest(np.zeros(4))
    assert digest(np.zeros(2, np.int64)) != digest(np.zeros(2))
    assert describe_numbers(np.arange(17)) == digest(np.arange(17))


@pytest.mark.parametrize(
    "space", [Text(3), Dict(a=Discrete(2)), Tuple([Discrete(2), Discrete(2, start=1)]), Discrete(4)]
)
def test_only_discretes_from_0_make_one_number(space: Any) -> None:
    assert numbered(describe_space(space)) == describe_space(space)
    assert numbered(describe_space(Tuple([Discrete(2), Discrete(5)]))) == describe_space(Discrete(10))
