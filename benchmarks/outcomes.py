"""Drawing one of a pair's outcomes: the kernels' search beside its parts, and beside alias tables.

All take one number from the stream. A search of any kind finds the same outcome for it; an alias table [1]_ finds
another one, so that every run would change. Pairs are met at random, as in a large table.

References
----------
.. [1] A. J. Walker (1977). An efficient method for generating discrete random variables with general distributions.
   ACM Transactions on Mathematical Software 3(3), 253-256.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.timing import Row, compare
from tuckerl._jit import kernel
from tuckerl.problems.mdp_kernels import draw_outcome
from tuckerl.rng import below, uniform
from tuckerl.types import FloatArray, IntArray, Stream

COUNTS = (2, 10, 1000)
N_OUTCOMES, N_DRAWS = 100_000, 200_000


def rows() -> list[Row]:
    """Time a draw of 2, 10 and 1,000 outcomes."""
    return [row for count in COUNTS for row in _rows(count)]


def _rows(count: int) -> list[Row]:
    n_pairs = N_OUTCOMES // count
    p = np.random.default_rng(count).dirichlet(np.ones(count), n_pairs)
    cumulative, (limit, other) = np.cumsum(p, axis=1).ravel(), alias_tables(p)

    def timed(draw: Callable[..., int], *arrays: Any) -> Callable[[], int]:
        return lambda: draw(*arrays, n_pairs, count, np.array([1, 2, 3, 4], dtype=np.uint64))

    ours, linear = timed(_by_kernels, cumulative), timed(_one_by_one, cumulative)
    if ours() != linear():
        raise RuntimeError("the search finds other outcomes than looking at one after the other")
    peers = {"one after the other": linear, "an alias table": timed(_by_alias, limit, other)}
    what = f"one of {count:,} outcomes"
    return [compare(what, "draw", ours, name, peer, units=float(N_DRAWS)) for name, peer in peers.items()]


def alias_tables(p: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return for each pair of (n, count) probabilities what its columns keep, and to which others the rest leads.

    Returns
    -------
    limit : (n * count,) float64
    other : (n * count,) int64
    """
    count = p.shape[1]
    limit, other = p * count, np.tile(np.arange(count), (len(p), 1))
    for own, to in zip(limit, other, strict=True):
        small, large = list(np.flatnonzero(own < 1.0)), list(np.flatnonzero(own >= 1.0))
        while small and large:
            giver, taker = large[-1], small.pop()
            to[taker] = giver
            own[giver] -= 1.0 - own[taker]
            if own[giver] < 1.0:
                small.append(large.pop())
    return limit.ravel(), other.ravel()


@kernel
def _by_kernels(cumulative: FloatArray, n_pairs: int, count: int, rng: Stream) -> int:
    """Draw by the kernels' own search; `cumulative` is (n_pairs * count,), `rng` (4,)."""
    total: int = 0
    for _ in range(N_DRAWS):
        first = below(n_pairs, rng) * count
        total += draw_outcome(cumulative, first, first + count, rng) - first
    return total


@kernel
def _one_by_one(cumulative: FloatArray, n_pairs: int, count: int, rng: Stream) -> int:
    """Draw by looking at one after the other; `cumulative` is (n_pairs * count,), `rng` (4,)."""
    total: int = 0
    for _ in range(N_DRAWS):
        first = below(n_pairs, rng) * count
        place, u = first, uniform(rng)
        while place < first + count - 1 and u >= cumulative[place]:
            place += 1
        total += place - first
    return total


@kernel
def _by_alias(limit: FloatArray, other: IntArray, n_pairs: int, count: int, rng: Stream) -> int:
    """Draw by alias tables, `limit` (n_pairs * count,) and `other` (n_pairs * count,); `rng` is (4,)."""
    total: int = 0
    for _ in range(N_DRAWS):
        first = below(n_pairs, rng) * count
        scaled = uniform(rng) * count
        column = int(scaled)
        total += column if scaled - column < limit[first + column] else other[first + column]
    return total
