"""Random streams: the generator itself, and where its seeds come from."""

import numpy as np
import pytest
from scipy.stats import chisquare

from tests.reference.rng import Stream
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.rng import below, child, seed_sequence, stream, uniform


def test_uniform_equals_the_twin() -> None:
    for agent in (0, 3):
        ours, twin = stream(child(seed_sequence(42), agent)), Stream(42, agent)
        assert [uniform(ours) for _ in range(1000)] == [twin.uniform() for _ in range(1000)]
        assert [int(word) for word in ours] == twin.words


def test_below_equals_the_twin() -> None:
    ours, twin = stream(child(seed_sequence(7), 0)), Stream(7, 0)
    for n in [*range(1, 400), 10**6, 2**31, 2**40]:
        assert below(n, ours) == twin.below(n)


def test_the_published_words() -> None:
    # The authors' own C code from the state 1, 2, 3, 4 gives 41943041, 58720359, 3588806011781223, ...
    state = np.array([1, 2, 3, 4], dtype=np.uint64)
    words = [41943041, 58720359, 3588806011781223, 3591011842654386]
    assert [uniform(state) for _ in words] == [(word >> 11) / 2**53 for word in words]


def test_draws_are_spread_evenly_over_the_interval() -> None:
    state = stream(seed_sequence(1))
    draws = np.array([uniform(state) for _ in range(100_000)])
    assert draws.min() >= 0.0
    assert draws.max() < 1.0
    assert chisquare(np.histogram(draws, bins=100, range=(0.0, 1.0))[0]).pvalue > 0.001
    # ... and pairs of successive draws over the square
    pairs = np.histogram2d(draws[::2], draws[1::2], bins=10, range=[[0, 1], [0, 1]])[0]
    assert chisquare(pairs.ravel()).pvalue > 0.001


@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_below_reaches_every_number_equally_often(n: int) -> None:
    state = stream(seed_sequence(2))
    counts = np.bincount([below(n, state) for _ in range(20_000)])
    assert counts.size == n
    assert n == 1 or chisquare(counts).pvalue > 0.001


def test_child_is_what_spawn_gives_without_its_memory() -> None:
    parent = np.random.SeedSequence(5, spawn_key=(2,))
    first, second = np.random.SeedSequence(5, spawn_key=(2,)).spawn(2)
    for _ in range(2):
        for number, spawned in enumerate((first, second)):
            ours = child(parent, number)
            assert ours.spawn_key == spawned.spawn_key
            np.testing.assert_array_equal(stream(ours), stream(spawned))
    grandchild = child(parent, 1, 4)
    np.testing.assert_array_equal(stream(grandchild), stream(child(child(parent, 1), 4)))


def test_streams_differ() -> None:
    streams = [stream(child(seed_sequence(seed), agent)) for seed in range(20) for agent in range(20)]
    assert len({tuple(state) for state in streams}) == 400


def test_seeds() -> None:
    assert seed_sequence(3).entropy == 3
    assert seed_sequence(np.int64(3)).entropy == 3  # type: ignore[arg-type]
    sequence = np.random.SeedSequence(1)
    assert seed_sequence(sequence) is sequence
    assert seed_sequence(None).entropy != seed_sequence(None).entropy
    with pytest.raises(ParameterError, match="seed must be a whole number of at least 0; got -1"):
        seed_sequence(-1)
    with pytest.raises(ParameterTypeError, match=r"seed must be .* got 1\.5"):
        seed_sequence(1.5)  # type: ignore[arg-type]
    assert seed_sequence(2**4096 - 1).entropy == 2**4096 - 1
    for too_long, got in ((2**4096, "10443888"), (10**5000, r"about 10\^5000")):
        with pytest.raises(ParameterError, match=f"seed must have at most 4096 bits; got {got}"):
            seed_sequence(too_long)
