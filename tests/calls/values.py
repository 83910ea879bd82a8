"""Arguments that nobody should pass, and some that look odd and are right."""

import io
import itertools
import math
import threading
from collections.abc import Callable, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import polars as pl
import scipy.sparse
from gymnasium import spaces

import tuckerl

Rng = np.random.Generator
Make = Callable[[], Any]


class OwnError(Exception):
    """What a user's own object raises: it may come through as it is."""


class Raising:
    """An object of which one method raises."""


def _raising(name: str) -> Make:
    def method(self: object, *arguments: Any, **keywords: Any) -> Any:
        raise OwnError(name)

    return type("Raising", (Raising,), {name: method})


class _Text(str):
    __slots__ = ()


class _Number(int):
    pass


class _Odd:
    """An object with a length and entries, and no sequence."""

    def __len__(self) -> int:
        return 2

    def __getitem__(self, place: int) -> int:
        if place > 1:
            raise IndexError
        return place


def _closed() -> Any:
    file = io.BytesIO(b"tuckerl")
    file.close()
    return file


def in_itself() -> list[Any]:
    """Return a list that is one of its own entries."""
    values: list[Any] = [1]
    values.append(values)
    return values


def nested(depth: int) -> Any:
    """Return lists within lists."""
    values: Any = 1
    for _ in range(depth):
        values = [values]
    return values


def _failing_as_own(function: Any) -> Any:
    """Return a function whose errors are recognised as those of the user's own."""

    def call(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            raise OwnError from error

    return call


def mdp(limit: int | None = 8) -> tuckerl.TabularMDP:
    """Return a corridor of four states with two actions."""
    return tuckerl.TabularMDP(
        [[0, 1], [0, 2], [1, 3], [3, 3]],
        [[-1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [0.0, 0.0]],
        [[False, False], [False, False], [False, True], [True, True]],
        heuristic=[3.0, 2.0, 1.0, 0.0],
        max_episode_steps=limit,
        layout=(2, 2),
    )


def learner() -> tuckerl.QLearning:
    """Return a learner that has learned a little."""
    step = tuckerl.TensorStep(every=2, ranks=(1, 1, 1, 1))
    return tuckerl.QLearning(mdp(), n_agents=2, seed=0, tensor_step=step).learn(4)


def these(*values: Any) -> list[Make]:
    """Return functions that return immutable values."""
    return [lambda value=value: value for value in values]  # type: ignore[misc]  # mypy infers no default's type


def sound(result: Any) -> None:
    """Refuse numbers that are not finite, wherever they are."""
    if isinstance(result, (float, np.floating)):
        assert math.isfinite(result), result
    elif isinstance(result, np.ndarray) and result.dtype.kind == "f":
        assert np.isfinite(result).all(), result
    elif isinstance(result, np.ndarray):
        assert result.dtype.kind in "biu", result.dtype
    elif isinstance(result, dict):
        sound(list(result.values()))
    elif isinstance(result, (tuple, list)):
        for part in result:
            sound(part)


_NUMBERS = these(
    *(True, False, -1, 0, 1, 2, 3, 7, 2**31, 2**53, 2**63, 2**64, 10**30, -(10**30), 10**400, 10**5000),
    *(float("nan"), float("inf"), -float("inf"), 0.5, 1.0, 1.5, -0.5, -0.0, 1e308, -1e308, 5e-324, 1e-300, 1e16),
    *(
        np.True_,
        np.int8(3),
        np.uint64(2**64 - 1),
        np.float32(0.1),
        np.float64("nan"),
        np.longdouble(0.5),
        np.float16(2),
    ),
    *(1j, np.complex64(1), Fraction(1, 3), Fraction(10**400, 3), Decimal("0.1"), Decimal("NaN"), Decimal("1e999999")),
    *(np.datetime64("2020"), np.datetime64("NaT"), np.timedelta64(1), _Number(3), np.ma.masked),
)
_ARRAYS: list[Make] = [
    *(
        lambda: np.array(1),
        lambda: np.array(0.5),
        lambda: np.array(True),
        lambda: np.array("x"),
        lambda: np.array(None),
    ),
    *(lambda: np.array([]), lambda: np.zeros((0, 4)), lambda: np.zeros((4, 0)), lambda: np.zeros((2, 3))),
    *(lambda: np.zeros((4, 2)), lambda: np.zeros((2, 2, 2, 2)), lambda: np.ones(4), lambda: np.arange(4)),
    *(
        lambda: np.array([None, 1]),
        lambda: np.array(["a", "b"]),
        lambda: np.array([1 + 2j, 0]),
        lambda: np.array([b"a"]),
    ),
    *(lambda: np.array([np.nan] * 4), lambda: np.full((4, 2), np.inf), lambda: np.full((2, 2), 1e308)),
    *(lambda: np.array([0, 1], dtype="datetime64[s]"), lambda: np.zeros(3, dtype=[("a", int), ("b", float)])),
    *(lambda: np.ma.masked_array([1.0, 2.0], [True, False]), lambda: [np.ma.masked_array([1, 2], [True, False])]),
    *(lambda: np.array([10**30, 1]), lambda: np.array([2**63], dtype=np.uint64), lambda: np.ones((1,) * 40)),
    *(lambda: np.array([[1, 2], [3, 4]], dtype=object), lambda: np.array([lambda: 0], dtype=object)),
    *(lambda: scipy.sparse.eye(4), lambda: pl.DataFrame({"a": [1, 2]}), lambda: pl.Series([1.0, None])),
    *(lambda: memoryview(b"abcd"), lambda: np.matrix([[1, 2], [3, 4]]), lambda: np.broadcast_to(0.5, (10**6, 10**6))),
]
_TEXTS: list[Make] = [
    *these(
        "", "x", "\0", "a\0b", "\ud800", "a" * 10_000, "0.1", "paper", "max", "nan", "observation", "QLearning", "é"
    ),
    *these(b"x", b"", b"\xff", _Text("random"), "../..", "/", ".", "missing/agent", "FrozenLake-v1", "os:path", "%s{}"),
    *these("FrozenLake-v1:x", "good.tuckerl", "bad.tuckerl", "/dev/null/x", "/proc/1/mem", "a" * 300, "~", "-1"),
    *(lambda: bytearray(b"x"), lambda: Path("missing") / "agent", lambda: Path(), lambda: Path("good.tuckerl")),
]
_LISTS: list[Make] = [
    *(list, lambda: [[]], lambda: [1, 2], lambda: [[1], [1, 2]], lambda: [None], lambda: ["a", 1], lambda: [[[1]]]),
    *(in_itself, lambda: nested(50), lambda: nested(5000), lambda: [[1, 2], 3], lambda: [float("nan")]),
    *these(
        (), (1,), (1, 2), (0, 0), (1, 2, 3), (1, 1, 1, 1), (2, 2, 2, 2), (-1, 2), (0.5, 0.5), (1, 10**30), ("a", "b")
    ),
    *these((None, None), frozenset(), frozenset({1, 2}), range(5), range(10**18), ((1, 2), (3,))),
    *(dict, lambda: {"a": 1}, lambda: {0: 1}, lambda: {1: {2: 3}}, lambda: {1, 2}, lambda: iter([1, 2])),
    *(lambda: (i for i in range(3)), lambda: itertools.repeat(1, 3), lambda: {"a": [1]}.items(), _Odd),
]
_FUNCTIONS: list[Make] = these(
    *(
        lambda: 0,
        lambda x: x,
        lambda *a: None,
        lambda a, b, c, d, e: 0,
        print,
        *map(_failing_as_own, (len, int, float, np.mean, dict)),
    ),
    *(tuckerl.QLearning, tuckerl.TabularMDP, gymnasium.Env, type, lambda: "x", lambda x: float("nan"), lambda x: "x"),
    *(lambda *a, key: 0, lambda x: [x, [x]], lambda *a: 10**30, lambda *a: float("inf"), lambda *a: np.ones(3)),
)
_OBJECTS: list[Make] = [
    *these(None, Ellipsis, NotImplemented, np, object(), ValueError("x"), np.random.SeedSequence(1)),
    *(object, lambda: np.random.default_rng(0), _closed, io.StringIO, threading.Lock, lambda: slice(1)),
    *map(
        _raising,
        (
            *("__array__", "__len__", "__iter__", "__getitem__", "__float__", "__index__", "__call__", "__fspath__"),
            *("__bool__", "__str__", "__hash__", "__eq__", "__int__", "__array_interface__", "reset", "__contains__"),
        ),
    ),
    *(mdp, learner, tuckerl.sutton_maze, lambda: tuckerl.TensorStep(2, (1, 1, 1, 1)), tuckerl.Greedy),
    *(lambda: tuckerl.EpsilonGreedy(0.2), lambda: tuckerl.Linear(1.0, 0.0, 5), lambda: tuckerl.Harmonic(0.5, 1e-300)),
    *(lambda: tuckerl.Exponential(1.0, 0.0), lambda: tuckerl.OwnDistribution("x"), tuckerl.Callback),
    *(
        lambda: spaces.Discrete(3),
        lambda: spaces.Box(0, 1, (2,)),
        lambda: spaces.Text(3),
        lambda: spaces.Discrete(2, start=-5),
    ),
    *(
        lambda: spaces.MultiDiscrete([2, 2]),
        lambda: spaces.Tuple(()),
        lambda: spaces.Dict({}),
        lambda: spaces.MultiBinary(70),
    ),
    *(lambda: spaces.Box(-np.inf, np.inf, ()), lambda: spaces.Sequence(spaces.Discrete(2))),
    *(
        lambda: gymnasium.make("FrozenLake-v1"),
        lambda: gymnasium.make("CartPole-v1"),
        lambda: tuckerl.sutton_maze().to_mdp(),
    ),
]
_POOLS = (_NUMBERS, _NUMBERS, _ARRAYS, _TEXTS, _LISTS, _FUNCTIONS, _OBJECTS)


def odd(right: Any, rng: Rng) -> Any:
    """Return something out of the pool, or what comes of altering a right value."""
    if rng.random() < 0.4:
        return _altered(right, rng)
    pool = _POOLS[rng.integers(len(_POOLS))]
    return pool[rng.integers(len(pool))]()


def _chosen(values: Sequence[Any], rng: Rng) -> Any:
    return values[int(rng.integers(len(values)))]


def _altered(right: Any, rng: Rng) -> Any:
    if isinstance(right, np.ndarray):
        return _altered_array(right, rng)
    if isinstance(right, (bool, int, float)):
        kinds: tuple[Callable[[Any], Any], ...] = (
            *(
                np.int16,
                np.float32,
                np.array,
                str,
                complex,
                Fraction,
                float,
                lambda n: -n,
                lambda n: [n],
                lambda n: n + 1,
            ),
            *(
                lambda n: n - 1,
                lambda n: (n, n),
                lambda n: np.array([n]),
                lambda n: n * 10**6,
                lambda n: lambda: n,
                bool,
            ),
        )
        return _chosen(kinds, rng)(right)
    if isinstance(right, str):
        near = (right.upper(), right[:-1], f"{right} ", right.encode(), [right], f"{right}x", Path(right), _Text(right))
        return _chosen(near, rng)
    if isinstance(right, (list, tuple)):
        return _altered_list(right, rng)
    if isinstance(right, dict):
        copy = dict(right)
        key = _chosen(list(copy), rng) if copy else "a"
        what = rng.integers(3)
        if what == 0:
            copy.pop(key, None)
        else:
            copy[key if what == 1 else "other"] = odd(right.get(key), rng)
        return copy
    return _chosen((lambda: right, [right], (right, right), {"a": right}, str(right), type(right)), rng)


def _altered_list(right: Sequence[Any], rng: Rng) -> Any:
    values = list(right)
    what = rng.integers(8)
    if what < 3 and values:
        place = rng.integers(len(values))
        values[place] = odd(values[place], rng)
    elif what == 3:
        values = values[:-1]
    elif what == 4:
        values = values + values[:1]
    else:
        return (
            (lambda: np.array(values, dtype=object)),
            (lambda: iter(values)),
            (lambda: dict(enumerate(values))),
        )[what % 3]()
    return tuple(values) if isinstance(right, tuple) else values


def _altered_array(right: np.ndarray, rng: Rng) -> Any:
    copy = right.copy()
    what = rng.integers(14)
    if what < 3 and copy.size and copy.dtype.kind == "f":
        copy.flat[rng.integers(copy.size)] = _chosen((np.nan, np.inf, -np.inf, 1e308, -1.0, 5e-324, 2.0, 1e-9), rng)
        return copy
    if what < 3 and copy.size and copy.dtype.kind in "iu":
        value = _chosen((-1, 0, 100, 4, 2**31 - 1, 1), rng)
        copy.flat[rng.integers(copy.size)] = np.array(value).astype(copy.dtype)  # wraps around in small types
        return copy
    with np.errstate(all="ignore"):
        forms: tuple[Make, ...] = (
            *(
                lambda: copy.tolist(),
                lambda: copy.astype(object),
                lambda: copy.astype(str),
                lambda: copy.astype(complex),
            ),
            *(lambda: copy.T, lambda: copy[..., np.newaxis], lambda: copy.ravel(), lambda: copy[:-1], lambda: copy[:0]),
            *(
                lambda: np.ma.masked_array(copy, np.arange(copy.size).reshape(copy.shape) == 0),
                lambda: -copy.astype(float),
            ),
            *(lambda: copy.astype(np.float16), lambda: copy.astype(bool), lambda: copy[::-1].astype(">f8")),
            *(lambda: copy.astype(np.longdouble), lambda: tuple(map(tuple, copy.reshape(len(copy), -1)))),
            *(lambda: np.asfortranarray(copy), lambda: copy.astype(float) * 1e308, lambda: [copy.tolist(), 1]),
        )
        return _chosen(forms, rng)()
