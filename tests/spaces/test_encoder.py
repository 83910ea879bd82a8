"""Numbers for the members of Gymnasium's spaces: NumPy's own, both ways, one by one and in batches."""

import copy
import math
import pickle
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import suppress
from enum import IntEnum
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Graph, MultiBinary, MultiDiscrete, OneOf, Text, Tuple
from gymnasium.vector.utils import batch_space
from hypothesis import given, settings
from hypothesis import strategies as st

from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError, SpaceError
from tuckerl.spaces.encoder import SpaceEncoder, space_encoder, space_encoder_of_edges

GRID = Dict(agent=Box(0, 3, (2,), np.int64), target=Box(1, 3, (2,), np.int64))
SMALL: dict[str, tuple[gymnasium.Space[Any], Any]] = {
    "discrete": (Discrete(5), None),
    "discrete from -2": (Discrete(4, start=-2), None),
    "discrete of int8": (Discrete(np.int8(100), start=np.int8(-50), dtype=np.int8), None),
    "multi-discrete": (MultiDiscrete([3, 4, 2]), None),
    "multi-discrete with starts": (MultiDiscrete(np.array([[3, 1], [2, 4]]), start=np.array([[-1, 7], [0, 2]])), None),
    "multi-binary": (MultiBinary([2, 3]), None),
    "tuple": (Tuple([Discrete(3), Discrete(4, start=1), Discrete(2)]), None),
    "dict": (Dict(b=Discrete(3), a=MultiBinary(2)), None),
    "dict of one": (Dict(a=Discrete(3)), None),
    "grid": (GRID, None),
    "int8 box": (Box(-128, 127, (1,), np.int8), None),
    "box of bools": (Box(0, 1, (3,), np.bool_), None),
    "box of one number": (Box(2, 5, (), np.uint8), None),
    "plane": (Box(-1, 1, (2,)), 6),
    "plane of one bin across": (Box(-1, 1, (2,)), [6, 1]),
    "box of three": (Box(np.array([-1, 0, 5], np.float32), np.array([1, 9, 6], np.float32)), [3, 2, [5.5, 5.9]]),
    "box of axes": (Box(0, 1, (2, 2), np.float64), [2, 3, 1, 2]),
    "box of a number": (Box(0, 1, (), np.float64), [4]),
    "half float": (Box(-4, 4, (2,), np.float16), 8),
    "unbounded": (Box(-np.inf, np.inf, (2,)), [[-0.3, 0.1, 0.7], [1e-3]]),
    "bounded below": (Box(0, np.inf, (1,)), [[0.3, 0.7]]),
    "bounded above": (Box(-np.inf, 1, (1,)), [[0.3, 0.7]]),
    "unbounded and not cut": (Box(-np.inf, np.inf, (3,)), 1),
    "whole numbers by bins": (Box(-10, 10, (2,), np.int32), [7, [-3.5, 0.2, 2.0]]),
    "unbounded whole numbers": (Box(-np.inf, np.inf, (1,), np.int32), [[-3.0, 0.2, 2.0]]),
    "many whole numbers": (Box(0, 1000, (1,), np.int32), 10),
    "nested": (Tuple([Discrete(2), Dict(x=Box(-1, 1, (2,)), y=MultiDiscrete([2, 3]))]), 3),
    "nested, one by one": (
        Tuple([Box(0, 3, (1,), np.uint8), Dict(x=Box(-1, 1, (1,)), y=Box(0, 9, (1,), np.uint8))]),
        (None, {"x": [[0.0]], "y": 5}),
    ),
}  # fmt: skip
small = pytest.mark.parametrize(("space", "bins"), SMALL.values(), ids=SMALL)


def same(a: Any, b: Any) -> bool:
    """Return whether two members are equal, arrays entry by entry and of one type."""
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, Mapping):
        return isinstance(b, Mapping) and list(a) == list(b) and all(same(a[key], b[key]) for key in a)
    return np.shape(a) == np.shape(b) and np.asarray(a).dtype == np.asarray(b).dtype and bool(np.all(a == b))


def batched(space: gymnasium.Space[Any], members: list[Any]) -> Any:
    """Return members as arrays with a leading axis, in tuples and dicts."""
    if isinstance(space, Tuple):
        return tuple(batched(part, [m[i] for m in members]) for i, part in enumerate(space.spaces))
    if isinstance(space, Dict):
        return {key: batched(part, [m[key] for m in members]) for key, part in space.spaces.items()}
    return np.array(members, dtype=space.dtype)


@small
def test_every_number_has_a_member_of_the_space_with_that_number(space: gymnasium.Space[Any], bins: Any) -> None:
    code = space_encoder(space, bins)
    assert code.n == math.prod(code.sizes)
    members = [code.decode(i) for i in range(code.n)]
    assert all(member in space for member in members)
    assert [code.encode(member) for member in members] == list(range(code.n))
    assert all(type(code.encode(member)) is int for member in members)


@small
def test_batches_have_the_numbers_of_their_members(space: gymnasium.Space[Any], bins: Any) -> None:
    space.seed(3)
    code = space_encoder(space, bins)
    members = [space.sample() for _ in range(200)]
    batch = batched(space, members)
    numbers = code.encode_many(batch)
    assert numbers.dtype == np.int64
    assert numbers.shape == (200,)
    assert numbers.tolist() == [code.encode(member) for member in members]
    assert len(set(numbers)) > 1 or code.n == 1
    assert code.is_batch(batch)
    assert not code.is_batch(members[0])
    assert batch_space(space, 200).contains(batch)


@small
def test_codings_are_rebuilt_from_their_edges_and_copied(space: gymnasium.Space[Any], bins: Any) -> None:
    code = space_encoder(space, bins)
    space.seed(4)
    members = [space.sample() for _ in range(50)]
    numbers = [code.encode(member) for member in members]
    copies: list[SpaceEncoder] = [
        space_encoder_of_edges(space, code.edges),
        copy.deepcopy(code),
        pickle.loads(pickle.dumps(code)),  # noqa: S301  # our own
    ]
    if isinstance(space, Box):
        copies.append(space_encoder(space, code.edges))
    for again in copies:
        assert again.sizes == code.sizes
        assert type(again) is type(code)
        assert all(map(np.array_equal, again.edges, code.edges))
        assert [again.encode(member) for member in members] == numbers
        assert same(again.decode(code.n - 1), code.decode(code.n - 1))


def test_a_rebuilt_coding_refuses_what_the_first_one_refused() -> None:
    code = space_encoder(GRID)
    again = space_encoder_of_edges(GRID, code.edges)
    for one in (code, again, pickle.loads(pickle.dumps(code))):  # noqa: S301  # our own
        with pytest.raises(ObservationError, match=r"observation\['agent'\] must be an array of whole numbers"):
            one.encode({"agent": np.array([0, 4]), "target": np.array([1, 1])})


def finite_spaces() -> st.SearchStrategy[gymnasium.Space[Any]]:
    starts = st.integers(-5, 5)
    discrete = st.builds(lambda n, start: Discrete(n, start=start), st.integers(1, 9), starts)
    vectors = st.lists(st.tuples(st.integers(1, 4), starts), min_size=1, max_size=4)
    multi = vectors.map(lambda v: MultiDiscrete([n for n, _ in v], start=[s for _, s in v]))
    binary = st.lists(st.integers(1, 3), min_size=1, max_size=2).map(MultiBinary)
    boxes = st.builds(lambda low, size: Box(low, low + size, (2,), np.int16), starts, st.integers(0, 255))
    leaves = discrete | multi | binary | boxes
    return st.recursive(
        leaves,
        lambda parts: (
            st.lists(parts, min_size=1, max_size=3).map(Tuple)
            | st.dictionaries(st.sampled_from("abcd"), parts, min_size=1, max_size=3).map(Dict)
        ),
        max_leaves=8,
    )


def digits_of(space: gymnasium.Space[Any], member: Any) -> list[tuple[int, int]]:
    """Return the (digit, size) pairs of a member, read off the definition."""
    if isinstance(space, Tuple):
        return [pair for part, one in zip(space.spaces, member, strict=True) for pair in digits_of(part, one)]
    if isinstance(space, Dict):
        return [pair for key, part in space.spaces.items() for pair in digits_of(part, member[key])]
    if isinstance(space, Discrete):
        return [(int(member - space.start), int(space.n))]
    low: Any = 0
    size: Any = 2
    if isinstance(space, MultiDiscrete):
        low, size = space.start, space.nvec
    elif isinstance(space, Box):
        low, size = space.low, space.high.astype(int) - space.low + 1
    values = np.asarray(member, dtype=np.int64)
    sizes = np.broadcast_to(size, values.shape).ravel().tolist()
    return list(zip((values - low).ravel().tolist(), sizes, strict=True))


@settings(max_examples=150, deadline=None)
@given(finite_spaces(), st.integers(0, 2**31 - 1))
def test_numbers_are_those_of_ravel_multi_index(space: gymnasium.Space[Any], seed: int) -> None:
    space.seed(seed)
    code = space_encoder(space)
    members = [space.sample() for _ in range(3)]
    for member in members:
        number = code.encode(member)
        digits, sizes = zip(*digits_of(space, member), strict=True)
        assert code.sizes == sizes
        assert code.decode(number) in space
        assert same(code.decode(number), member)
        if code.n < 2**62 and len(sizes) <= 32:
            assert number == int(np.ravel_multi_index(digits, sizes))
    if code.n <= 2**63:
        assert code.encode_many(batched(space, members)).tolist() == [code.encode(member) for member in members]


def test_numbers_by_hand() -> None:
    code = space_encoder(Tuple([Discrete(4, start=1), MultiDiscrete([3, 2]), MultiBinary(2)]))
    assert (code.sizes, code.n) == ((4, 3, 2, 2, 2), 96)
    # ((((2 * 3 + 1) * 2 + 0) * 2 + 1) * 2 + 1
    assert code.encode((np.int64(3), np.array([1, 0]), np.array([1, 1], np.int8))) == 59
    assert (
        space_encoder(GRID).encode({"target": np.array([2, 3]), "agent": np.array([3, 0])})
        == ((3 * 4 + 0) * 3 + 1) * 3 + 2
    )


def test_a_dict_is_read_in_the_order_of_its_space() -> None:
    # Gymnasium sorts the keys of a mapping, but for an OrderedDict's.
    value = {"b": 1, "a": 2}
    assert space_encoder(Dict({"b": Discrete(3), "a": Discrete(5)})).encode(value) == 2 * 3 + 1
    assert space_encoder(Dict(OrderedDict(b=Discrete(3), a=Discrete(5)))).encode(value) == 1 * 5 + 2
    assert list(space_encoder(Dict(OrderedDict(b=Discrete(3), a=Discrete(5)))).decode(7)) == ["b", "a"]


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.float16])
@pytest.mark.parametrize("shape", [(1,), (2,), (5,)])
def test_bins_are_those_of_digitize_also_on_the_edges(dtype: type[np.floating[Any]], shape: tuple[int]) -> None:
    rng = np.random.default_rng(5)
    edges = [np.unique(rng.normal(size=9)) for _ in range(shape[0])]
    edges[0] = np.sort(edges[0].astype(dtype).astype(np.float64))  # of these the values hold some exactly
    code = space_encoder(Box(-np.inf, np.inf, shape, dtype), edges)
    on_edges = rng.permuted(np.array(edges), axis=1).T.astype(dtype)
    values = np.concatenate([
        on_edges, np.nextafter(on_edges, dtype(9)), np.nextafter(on_edges, dtype(-9)),
        rng.normal(size=(100, shape[0])).astype(dtype), np.full((1, shape[0]), np.inf, dtype),
        np.full((1, shape[0]), -np.inf, dtype),
    ])  # fmt: skip
    expected = np.zeros(len(values), np.int64)
    for column, places in zip(values.T, edges, strict=True):
        expected = expected * (len(places) + 1) + np.digitize(column.astype(np.float64), places)
    assert code.encode_many(values).tolist() == expected.tolist()
    assert [code.encode(value) for value in values] == expected.tolist()


def test_even_bins_lie_between_the_bounds_and_beyond_them_the_last_goes_on() -> None:
    code = space_encoder(Box(np.array([-1.0, 0.0]), np.array([1.0, 10.0]), dtype=np.float64), [4, 5])
    assert [edges.tolist() for edges in code.edges] == [[-0.5, 0.0, 0.5], [2.0, 4.0, 6.0, 8.0]]
    assert code.layout == code.sizes == (4, 5)
    assert code.encode(np.array([0.2, 5.0])) == 2 * 5 + 2
    assert code.encode(np.array([-7.0, 70.0])) == 4
    assert code.decode(2 * 5 + 2).tolist() == [0.25, 5.0]


def test_one_number_of_bins_goes_for_every_box_inside() -> None:
    space = Dict(a=Discrete(3), b=Tuple([Box(0, 1, (2,)), Discrete(2), Box(0, 5, (1,), np.int8)]))
    assert space_encoder(space, 4).sizes == (3, 4, 4, 2, 4)
    assert space_encoder(space, {"b": (4, None, None)}).sizes == (3, 4, 4, 2, 6)
    assert space_encoder(space, {"b": [[[0.5], 2], None, 3]}).sizes == (3, 2, 2, 2, 3)


def test_rows_of_an_array_are_edges_too() -> None:
    assert space_encoder(Box(0, 1, (2,)), np.array([[0.2, 0.4], [0.3, 0.6]])).sizes == (3, 3)
    assert space_encoder(Box(0, 1, (2,)), np.array([3, 4])).sizes == (3, 4)


def test_edges_are_read_only_copies() -> None:
    mine = np.array([0.25, 0.5])
    code = space_encoder(Box(0, 1, (2,)), [mine, 3])
    mine[0] = 0.4
    assert code.edges[0].tolist() == [0.25, 0.5]
    assert not any(edges.flags.writeable for edges in code.edges)


def test_middles_of_bins() -> None:
    inner = space_encoder(Box(0, 8, (1,), np.float64), [[2.0, 3.0]])
    assert [inner.decode(i).item() for i in range(3)] == [1.0, 2.5, 5.5]
    outer = space_encoder(Box(-np.inf, np.inf, (1,), np.float64), [[2.0, 3.0]])
    assert [outer.decode(i).item() for i in range(3)] == [np.nextafter(2.0, 0.0), 2.5, 3.0]
    assert space_encoder(Box(-np.inf, np.inf, (1,)), [1]).decode(0).tolist() == [0.0]
    whole = space_encoder(Box(0, 1000, (1,), np.int32), [[1.5, 2.4, 100.0]])
    assert [whole.decode(i).tolist() for i in range(4)] == [[0], [2], [51], [550]]
    assert whole.decode(0).dtype == np.int32


def test_a_bin_outside_the_box_is_met_at_the_nearest_bound() -> None:
    code = space_encoder(Box(0, 1, (1,), np.float64), [[-3.0, -2.0, 0.5, 2.0]])
    assert [code.decode(i).item() for i in range(5)] == [0.0, 0.0, 0.25, 0.75, 1.0]


@pytest.mark.parametrize(
    ("space", "layout"),
    [
        (MultiDiscrete([3, 4]), (3, 4)),
        (Tuple([Discrete(3), Discrete(4)]), (3, 4)),
        (Discrete(12), None),
        (MultiBinary(3), None),
    ],
)
def test_two_digits_make_a_grid(space: gymnasium.Space[Any], layout: tuple[int, int] | None) -> None:
    assert space_encoder(space).layout == layout


def test_huge_products_are_exact() -> None:
    bits = space_encoder(MultiBinary(1000))
    assert bits.n == 2**1000
    assert bits.encode(np.ones(1000, np.int8)) == 2**1000 - 1
    assert bits.decode(2**999).tolist() == [1] + [0] * 999
    assert "about 10^301 numbers" in repr(bits)
    image = space_encoder(Box(0, 255, (84, 84, 3), np.uint8))
    assert image.n == 256 ** (84 * 84 * 3)
    with pytest.raises(SpaceError, match=r"observation has about 10\^301 members, too many for int64: encode them one"):
        bits.encode_many(np.ones((2, 1000), np.int8))
    with pytest.raises(ParameterError, match=r"code of observation must be below about 10\^301; got about 10\^301"):
        bits.decode(2**1000)
    with pytest.raises(ParameterError, match=r"code of observation must be below about 10\^50977; got about"):
        image.decode(image.n)
    with pytest.raises(SpaceError, match="too many for int64"):
        space_encoder(MultiBinary(64)).encode_many(np.zeros((1, 64), np.int8))
    largest = space_encoder(MultiBinary(63))
    assert largest.encode_many(np.ones((1, 63), np.int8)).tolist() == [2**63 - 1]


def test_the_upper_half_of_uint64_has_numbers() -> None:
    space = Discrete(3, start=2**64 - 5, dtype=np.uint64)
    code = space_encoder(space)
    assert code.encode(2**64 - 4) == 1
    assert code.encode_many(np.array([2**64 - 5, 2**64 - 3], np.uint64)).tolist() == [0, 2]
    with pytest.raises(ObservationError, match="must be a whole number from 18446744073709551611 to"):
        code.encode_many(np.array([2**64 - 2], np.uint64))
    with pytest.raises(ObservationError, match=r"got .*18446744073709551615"):
        space_encoder(Discrete(5, start=-2)).encode_many(np.array([2**64 - 1], np.uint64))


class Suit(IntEnum):
    CLUBS = 0
    HEARTS = 1


BOOLS = (True, np.bool_(True), np.array(True))


@pytest.mark.parametrize("value", [1, np.int64(1), np.uint8(1), np.array(1), Suit.HEARTS, *BOOLS])
def test_whole_numbers_of_any_kind(value: Any) -> None:
    assert space_encoder(Discrete(3)).encode(value) == 1
    assert space_encoder(Tuple([Discrete(3), Discrete(2)])).encode((value, value)) == 3


def test_false_lies_in_a_space_with_a_zero_only() -> None:
    assert space_encoder(Discrete(2)).encode_many(np.array([False, True])).tolist() == [0, 1]
    with pytest.raises(ObservationError, match="got False of type bool"):
        space_encoder(Discrete(2, start=1)).encode(False)


NUMBERS = (
    Discrete(4, start=-1),
    MultiDiscrete([3, 4]),
    MultiBinary(3),
    Box(0, 3, (2,), np.int8),
    Box(-1, 1, (2, 2)),
    Box(0.0, 1.0, ()),
)


@pytest.mark.filterwarnings("ignore:.*Casting input x to numpy array")
@pytest.mark.parametrize("space", NUMBERS, ids=str)
def test_what_contains_accepts_is_encoded(space: gymnasium.Space[Any]) -> None:
    encoder = space_encoder(space, 3 if isinstance(space, Box) and space.dtype.kind == "f" else None)
    space.seed(0)
    for _ in range(20):
        member = space.sample()
        code = encoder.encode(member)
        for form in (list, tuple, lambda one: np.asarray(one, np.float64), lambda one: np.asarray(one, np.int16), bool):
            other = None
            with suppress(TypeError, ValueError):  # it has no such form
                other = form(member)
            if other is not None and space.contains(other) and np.array_equal(other, member):
                assert encoder.encode(other) == code, form


def test_sequences_and_mappings_of_other_kinds() -> None:
    assert space_encoder(MultiDiscrete([3, 4])).encode([2, 3]) == 11
    assert space_encoder(MultiBinary(3)).encode(np.array([True, False, True])) == 5
    assert space_encoder(Box(0, 1, (2,)), 4).encode([0.3, 0.6]) == 6
    assert space_encoder(Box(0, 1, (2,)), 4).encode(np.array([0, 1])) == 3
    assert space_encoder(Box(0, 1, (3,)), 4).encode((0, 0, 0.3)) == 1
    assert space_encoder(Box(0, 1, ()), [4]).encode(0.3) == 1
    pair = space_encoder(Tuple([Discrete(3), MultiDiscrete([2, 2])]))
    assert pair.encode([2, np.array([1, 0])]) == 10
    assert space_encoder(Tuple([Discrete(3), Discrete(2)])).encode(np.array([2, 1])) == 5
    assert space_encoder(Dict(a=Discrete(3), b=Discrete(2))).encode(MappingProxyType({"b": 1, "a": 2})) == 5


@pytest.mark.parametrize(
    ("space", "bins", "value", "message"),
    [
        (
            Discrete(3),
            None,
            3,
            r"observation must be a whole number from 0 to 2, as in Discrete\(3\); got 3 of type int",
        ),
        (Discrete(3, start=5), None, 4, r"from 5 to 7, as in Discrete\(3, start=5\); got 4"),
        (Discrete(3), None, -1, "got -1"),
        (Discrete(3), None, 1.0, "got 1.0 of type float"),
        (Discrete(3), None, np.float32(1), r"got np.float32\(1.0\)"),
        (Discrete(3), None, np.array([1]), r"got array\(\[1\]\)"),
        (Discrete(3), None, 10**30, "got 1000000"),
        (Discrete(3), None, None, "got None"),
        (Discrete(3), None, "1", "got '1' of type str"),
        (
            MultiBinary(3),
            None,
            [1, 2, 0],
            r"must be an array of zeros and ones of shape \(3,\), as in MultiBinary\(3\)",
        ),
        (MultiDiscrete([2, 3]), None, np.array([2, 0]), r"whole numbers of shape \(2,\), as in MultiDisc.*; got array"),
        (MultiDiscrete([2, 3], start=[1, 1]), None, np.array([1, 0]), r"got array\(\[1, 0\]\)"),
        (MultiDiscrete([2, 3]), None, np.array([1, 0, 0]), r"got array\(\[1, 0, 0\]\)"),
        (MultiDiscrete([2, 3]), None, np.array([1.0, 0.0]), r"got array\(\[1., 0.\]\)"),
        (MultiDiscrete([2, 3]), None, 1, "got 1 of type int"),
        (MultiDiscrete([2, 3]), None, [1, [2]], r"got \[1, \[2\]\]"),
        (MultiBinary(2), None, np.array([0, 2]), r"got array\(\[0, 2\]\)"),
        (MultiBinary((2, 2)), None, np.zeros(4, np.int8), r"shape \(2, 2\)"),
        (Box(0, 9, (2,), np.uint8), None, np.array([0, 10]), r"got array\(\[ 0, 10\]\)"),
        (Box(0, 9, (2,), np.uint8), None, np.array([0.0, 1.0]), "array of whole numbers"),
        (Box(0, 1, (2,)), 3, np.array([0.5, math.nan]), "an array of numbers, none of them NaN, of shape .*nan"),
        (Box(0, 1, (2,)), 3, np.array([math.nan, 0.5]), "none of them NaN"),
        (Box(0, 1, (2,)), [3, 1], np.array([0.5, math.nan]), "none of them NaN"),
        (Box(0, 1, (3,)), 3, np.array([0.5, math.nan, 0.5]), "none of them NaN"),
        (Box(0, 1, (2,)), 3, np.zeros(3), r"of shape \(2,\), as in Box\(.*; got array\(\[0., 0., 0.\]\)"),
        (Box(0, 1, (2,)), 1, np.zeros((2, 1)), r"of shape \(2,\)"),
        (Box(0, 1, (2,)), 3, np.array(["a", "b"]), "of shape"),
        (Box(0, 1, (2,)), 1, np.array([1j, 0]), "of shape"),
        (Box(0, 1, (2,)), 3, None, "got None"),
        (Box(0, 1, (4,)), 3, np.zeros(2), r"of shape \(4,\)"),
        (Tuple([Discrete(2), Discrete(3)]), None, (1, 3), r"observation\[1\] must be a whole number from 0 to 2"),
        (Tuple([Discrete(2), Discrete(3)]), None, (1,), r"a tuple of 2 parts, as in Tuple\(.*; got \(1,\)"),
        (Tuple([Discrete(2), Discrete(3)]), None, 1, "got 1 of type int"),
        (Tuple([Discrete(2), Discrete(3)]), None, np.array(1), r"got array\(1\)"),
        (Dict(a=Discrete(2), b=Discrete(3)), None, {"a": 1, "b": 3}, r"observation\['b'\] must be"),
        (Dict(a=Discrete(2), b=Discrete(3)), None, {"a": 1}, "a mapping with the keys 'a', 'b', as in Dict"),
        (Dict(a=Discrete(2), b=Discrete(3)), None, {"a": 1, "c": 1}, "keys 'a', 'b'"),
        (Dict(a=Discrete(2)), None, {"a": 1, "c": 1}, "keys 'a',"),
        (Dict(a=Discrete(2), b=Discrete(3)), None, (1, 1), "keys 'a', 'b'"),
    ],
)
def test_what_is_outside_the_space_is_refused(space: gymnasium.Space[Any], bins: Any, value: Any, message: str) -> None:
    with pytest.raises(ObservationError, match=message):
        space_encoder(space, bins).encode(value)


@pytest.mark.parametrize(
    ("space", "bins", "values", "message"),
    [
        (Discrete(3), None, np.array([0, 3]), r"observation must be a whole number from 0 to 2, .*; got np.int64\(3\)"),
        (Discrete(3), None, np.array([0.0, 1.0]), r"a batch of observation must be .* of shape \(batch\); got array"),
        (Discrete(3), None, 2, "a batch of observation"),
        (Box(0, 1, (2,)), 3, np.zeros(2), r"of shape \(batch, 2\); got array"),
        (Box(0, 1, (2,)), 3, np.zeros((4, 3)), r"of shape \(batch, 2\); got array"),
        (Box(0, 1, (2,)), 3, [[0.0, 1.0], [math.nan, 0.5]], r"none of them NaN, .*got array\(\[nan, 0.5\]"),
        (Box(0, 1, (2,)), 3, [[0.0], [0.5, 1.0]], r"of shape \(batch, 2\)"),
        (Tuple([Discrete(2), Discrete(3)]), None, ([0, 1], [0, 1, 1]), "parts of one length; got 2, 3"),
        (Tuple([Discrete(2), Discrete(3)]), None, [(0, 1), (1, 1)], "must be a tuple of 2 parts"),
        (Dict(a=Discrete(2)), None, {"b": np.zeros(2, int)}, "must be a mapping with the keys 'a'"),
    ],
)  # fmt: skip
def test_batches_outside_the_space_are_refused(
    space: gymnasium.Space[Any], bins: Any, values: Any, message: str
) -> None:
    with pytest.raises(ObservationError, match=message):
        space_encoder(space, bins).encode_many(values)


def test_an_empty_batch_has_no_numbers() -> None:
    assert space_encoder(Box(0, 1, (2,)), 3).encode_many(np.empty((0, 2))).shape == (0,)
    assert space_encoder(Discrete(3)).encode_many(np.empty(0, int)).shape == (0,)


@pytest.mark.parametrize(
    ("space", "values"),
    [
        (Tuple([Discrete(2), Discrete(3)]), 1),
        (Tuple([Discrete(2), Discrete(3)]), (1,)),
        (Dict(a=Discrete(2)), {"b": [1]}),
        (MultiBinary(2), [[1], [1, 0]]),
        (MultiBinary(2), np.zeros((2, 2, 2))),
        (Discrete(2), 1),
    ],
)
def test_what_is_no_batch(space: gymnasium.Space[Any], values: Any) -> None:
    assert not space_encoder(space).is_batch(values)


@pytest.mark.parametrize(
    ("code", "error", "message"),
    [
        (6, ParameterError, "code of observation must be below 6; got 6"),
        (-1, ParameterError, "must be a whole number of at least 0; got -1"),
        (1.0, ParameterTypeError, "code of observation must be a whole number"),
        (True, ParameterTypeError, "got True of type bool"),
    ],
)
def test_numbers_that_no_member_has(code: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        space_encoder(MultiDiscrete([3, 2])).decode(code)


def test_numpy_numbers_are_decoded_too() -> None:
    assert space_encoder(MultiDiscrete([3, 2])).decode(np.int64(3)).tolist() == [1, 1]  # type: ignore[arg-type]  # an Integral
    assert type(space_encoder(Discrete(4)).decode(2)) is int


@pytest.mark.parametrize(
    "space", [Text(3), Graph(Discrete(2), None), OneOf([Discrete(2), Discrete(3)]), Dict(a=Text(3)), 3, None]
)
def test_other_spaces_are_refused(space: Any) -> None:
    with pytest.raises(SpaceError, match=r"must be a Discrete, MultiDiscrete, MultiBinary or Box of Gymnasium.*; got"):
        space_encoder(space)


@pytest.mark.parametrize("space", [Tuple([]), Dict({})])
def test_spaces_without_parts_are_refused(space: gymnasium.Space[Any]) -> None:
    with pytest.raises(SpaceError, match="observation must be a space with parts"):
        space_encoder(space)


def test_continuous_spaces_need_bins() -> None:
    for box in (Box(0, 1, (2,)), Box(0, 256, (2,), np.int16), Box(2**60, 2**60 + 9, (1,), np.int64)):
        with pytest.raises(SpaceError, match=r"observation Box.* cannot be .*: give bins.*quantile_edges\(env, bins\)"):
            space_encoder(box)
    with pytest.raises(SpaceError, match=r"observation\['x'\] Box"):
        space_encoder(Dict(x=Box(0, 1, (2,))))
    with pytest.raises(SpaceError, match=r"action of robot_0 must be one of finitely many.*wrappers.DiscretizeAction"):
        space_encoder(Box(0, 1, (2,)), what="action of robot_0")
    assert hasattr(gymnasium.wrappers, "DiscretizeAction")


def test_dimensions_without_bounds_need_edges() -> None:
    space = gymnasium.make("CartPole-v1").observation_space
    with pytest.raises(
        SpaceError, match=r"no bounds .* in dimensions 1, 3: give edges there, or take those of tuckerl"
    ):
        space_encoder(space, 4)
    with pytest.raises(SpaceError, match="in dimension 3: give edges"):
        space_encoder(space, [1, 1, 6, 12])
    assert space_encoder(space, [1, 1, 6, [-1.0, 1.0]]).sizes == (1, 1, 6, 3)
    for low, high in ((-np.inf, 0), (0, np.inf), (-np.inf, np.inf)):
        with pytest.raises(SpaceError, match="in dimension 0: "):
            space_encoder(Box(low, high, (1,), np.int32), 3)
    for low, high in ((-1.1e30, 0), (0, 1.1e30)):
        with pytest.raises(SpaceError, match="in dimension 0: "):
            space_encoder(Box(low, high, (1,), np.float64), 3)
    assert space_encoder(Box(-1e30, 1e30, (1,), np.float64), 2).edges[0].tolist() == [0.0]


BOX = Box(0, 1, (2,))


@pytest.mark.parametrize(
    ("space", "bins", "error", "message"),
    [
        (BOX, 0, ParameterError, "bins of dimension 0 of observation must be a whole number from 1 to 1000000; got 0"),
        (BOX, [2, 10**9], ParameterError, "bins of dimension 1 .* got 1000000000"),
        (BOX, True, ParameterTypeError, "bins of observation must be a whole number, or a sequence .* got True"),
        (BOX, [True, 2], ParameterTypeError, "bins of dimension 0 of observation must be a whole number"),
        (BOX, 2.5, ParameterTypeError, "one entry for each of 2 dimensions; got 2.5"),
        (BOX, "12", ParameterTypeError, "got '12'"),
        (BOX, np.array(3), ParameterTypeError, "got array"),
        (BOX, {"a": 1}, ParameterTypeError, "got {'a': 1}"),
        (BOX, [1, 2, 3], ParameterError, r"one entry for each of 2 dimensions; got 3: \[1, 2, 3\]"),
        (
            BOX,
            [0.1, 0.2],
            ParameterError,
            "bins of dimension 0 .* 1-D array of finite, increasing inner edges; got 0.1",
        ),
        (BOX, [3, [0.2, 0.2]], ParameterError, r"dimension 1 .*increasing inner edges; got \[0.2, 0.2\]"),
        (BOX, [3, [0.3, 0.2]], ParameterError, "increasing"),
        (BOX, [3, [0.2, math.inf]], ParameterError, "finite"),
        (BOX, [3, [math.nan]], ParameterError, "finite"),
        (BOX, [3, [[0.2, 0.3]]], ParameterError, "1-D"),
        (BOX, [3, [[0.2], [0.3, 0.4]]], ParameterTypeError, "1-D"),
        (BOX, [3, ["a"]], ParameterTypeError, "1-D"),
        (BOX, [3, None], ParameterTypeError, "1-D array .*; got None"),
        (Box(3, 3, (1,)), 2, ParameterError, "dimension 0 of observation must be 1, as there is no room for 2 between"),
        (Discrete(3), 2, ParameterError, r"observation Discrete\(3\) has no Box .* bins must be None; got 2"),
        (Tuple([Discrete(3)]), 2, ParameterError, "has no Box to cut into bins"),
        (Dict(a=Discrete(3)), {"a": 1}, ParameterError, "has no Box to cut into bins"),
        (Dict(a=Discrete(3), b=BOX), {"a": 2, "b": 3}, ParameterError, r"observation\['a'\] Discrete\(3\) has no Box"),
        (Dict(b=BOX), {"c": 3}, ParameterError, r"bins of observation must have keys of Dict\(.*; got 'c'"),
        (Dict(b=BOX), [3], ParameterTypeError, r"a whole number or a mapping by its keys; got \[3\]"),
        (Dict(b=BOX), True, ParameterTypeError, "a mapping by its keys; got True"),
        (Tuple([BOX, BOX]), [3], ParameterError, "an entry for each of its 2 parts, None for one without a Box; got 1"),
        (Tuple([BOX]), {0: 3}, ParameterTypeError, "a sequence with an entry for each part; got {0: 3}"),
    ],
)
def test_bins_that_do_not_fit(space: gymnasium.Space[Any], bins: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        space_encoder(space, bins)


def test_edges_must_be_as_many_as_dimensions() -> None:
    with pytest.raises(ParameterError, match="edges of it must be one array for each of the 3 dimensions of its Boxes"):
        space_encoder_of_edges(Tuple([BOX, Box(0, 1, (1,))]), space_encoder(BOX, 3).edges, what="it")
    with pytest.raises(ParameterError, match="each of the 0 dimensions of its Boxes; got 2"):
        space_encoder_of_edges(Discrete(3), space_encoder(BOX, 3).edges)
