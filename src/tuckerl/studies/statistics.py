"""From the runs of two variants to a difference with an interval, and from that to a verdict.

A *pair* is what two variants did from the same seed; its value for each variant is a mean over agents. The difference
is counted in the claim's favour and, if it is relative, divided by the base's mean; its 95 % interval is the
bias-corrected and accelerated bootstrap over pairs.
"""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple, Protocol

import numpy as np
import polars as pl
from scipy.special import stdtrit

from tuckerl.intervals import CONFIDENCE, ROUNDING, bca_interval, is_constant
from tuckerl.studies.study import Comparison
from tuckerl.types import BoolArray, FloatArray, IntArray


class Measure(NamedTuple):
    """A quantity to compare: a number for each pair, made of the episodes of each agent in it."""

    column: str  # "steps" or "return": what curves show
    value: pl.Expr  # of one agent in one pair, from the rows of its episodes
    larger_is_better: bool
    text: str  # what it is
    pair: tuple[str, ...] = ("run",)  # the columns that make a pair


_STEPS, _RETURN = pl.col("steps"), pl.col("return")
_IS_LAST_TENTH = 10 * (pl.col("episode") + 1) > 9 * (pl.col("episode").max() + 1)

MEASURES = {
    # Steps summed over instances and episodes: what Figure 11 shows at its right end.
    "cost": Measure("steps", _STEPS.sum(), False, "number of steps"),
    # The same where it is the time that the pole stays up: what Figure 9 shows.
    "balance": Measure("steps", _STEPS.sum(), True, "number of steps"),
    # The length of the agent's shortest episode: what Figure 10 shows.
    "path": Measure("steps", _STEPS.min(), False, "shortest episode", ("instance", "run")),
    # Means over episodes, for problems of which nothing is known: of all, and of the last tenth (rounded up).
    "return": Measure("return", _RETURN.mean(), True, "mean return of an episode"),
    "steps": Measure("steps", _STEPS.mean(), False, "mean number of steps of an episode"),
    "final": Measure(
        "return", _RETURN.filter(_IS_LAST_TENTH).mean(), True, "mean return of an episode, over the last tenth of them"
    ),
}


class Difference(NamedTuple):
    """A paired difference in the candidate's favour; NaN where it is not known."""

    mean: float
    low: float
    high: float
    n_pairs: int
    n_diverged: int  # pairs left out because a run of theirs diverged
    relative: bool = True  # to the base's mean; otherwise it is in the unit of what is measured

    @property
    def verdict(self) -> str:
        """Say whether the claim "holds", "does not hold" or is "not decided"."""
        if self.low > 0:
            return "holds"
        return "does not hold" if self.high < 0 else "not decided"


NO_DIFFERENCE = Difference(math.nan, math.nan, math.nan, 0, 0)


def json_number(value: float) -> float | None:
    """Return a number as JSON has it, None for NaN."""
    return None if math.isnan(value) else value


def json_numbers(values: tuple[float, ...], *names: str) -> dict[str, float | None]:
    """Return the first numbers of a tuple by these names, as JSON has them."""
    return dict(zip(names, map(json_number, values), strict=False))


class Pairs(NamedTuple):
    """What one variant did in every pair."""

    key: IntArray  # (n,) ascending: a number for each pair, the same for all variants
    value: FloatArray  # (n,) NaN where the run diverged before anything was measured
    diverged: BoolArray  # (n,)

    @property
    def finite(self) -> FloatArray:
        """The values of those in which nothing diverged."""
        return self.value[~self.diverged]


NO_PAIRS = Pairs(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0, dtype=bool))


def pairs_by_variant(runs: pl.DataFrame, measure: Measure) -> dict[str, Pairs]:
    """Return every variant's pairs, on the runs of one scenario."""
    group, value = ["variant", *measure.pair], measure.value.cast(pl.Float64).alias("value")
    agents = runs.group_by([*group, "agent"]).agg(value, pl.col("diverged").any()).sort([*group, "agent"])
    pairs = agents.group_by(group, maintain_order=True).agg(pl.col("value").mean(), pl.col("diverged").any())
    key = pl.sum_horizontal(pl.col(name).cast(pl.Int64) * _KEYS[name] for name in measure.pair).alias("key")
    parts = pairs.select("variant", key, "value", "diverged").partition_by("variant", as_dict=True, include_key=False)
    return {str(name): Pairs(*(part[column].to_numpy() for column in part.columns)) for (name,), part in parts.items()}


_KEYS = {"instance": 2**32, "run": 1}  # one number tells a pair


def run_of(key: IntArray) -> IntArray:
    """Return the runs' numbers of pairs."""
    return key % _KEYS["instance"]


def _are_relative(samples: Iterable[Pairs]) -> bool:
    return all(bool((one.finite > 0).all() or (one.finite < 0).all()) for one in samples)


def are_relative(runs: pl.DataFrame, variants: Iterable[str], measure: Measure) -> bool:
    """Return whether differences to all of these variants can be divided by their means.

    The values of each must be all above 0 or all below: then no resample of them has the mean 0. All differences that
    stand side by side are in the same unit.
    """
    pairs = pairs_by_variant(runs, measure)
    return _are_relative(pairs.get(name, NO_PAIRS) for name in variants)


def compare_with_control(
    runs: pl.DataFrame, comparison: Comparison, entropy: list[int]
) -> tuple[Difference, Difference]:
    """Return by how much the candidate does better than the base and than the control, on the runs of one scenario.

    `entropy` seeds the intervals, each with a stream of its own. Without a control there is nothing for the second.
    """
    names = [comparison.base, comparison.candidate, comparison.control]
    chosen = runs.filter(pl.col("variant").is_in(names))
    return compare_pairs_with_control(pairs_by_variant(chosen, MEASURES[comparison.measure]), comparison, entropy)


class WorkOut(Protocol):
    """What works out a paired difference: `seeded_difference`, or what remembers that."""

    def __call__(
        self,
        samples: tuple[FloatArray, FloatArray],
        sign: float,
        n_diverged: int,
        entropy: list[int],
        *,
        relative: bool,
    ) -> Difference:
        """Return the difference of the second sample to the first; `entropy` seeds its interval."""


def seeded_difference(
    samples: tuple[FloatArray, FloatArray], sign: float, n_diverged: int, entropy: list[int], *, relative: bool
) -> Difference:
    """Return `paired_difference` of the samples of the base and the candidate, its interval seeded by `entropy`."""
    return paired_difference(*samples, sign, n_diverged, np.random.default_rng(entropy), relative=relative)


def compare_pairs_with_control(
    pairs: Mapping[str, Pairs], comparison: Comparison, entropy: list[int], work_out: WorkOut = seeded_difference
) -> tuple[Difference, Difference]:
    """Return what `compare_with_control` does, from the pairs of all variants by what the comparison measures."""
    measure, candidate = MEASURES[comparison.measure], pairs.get(comparison.candidate, NO_PAIRS)
    others = [pairs.get(name, NO_PAIRS) for name in (comparison.base, comparison.control) if name]
    relative = _are_relative(others)
    sign = 1.0 if measure.larger_is_better else -1.0
    difference, *control = (
        work_out(*_both(other, candidate, sign), [*entropy, stream], relative=relative)
        for stream, other in enumerate(others)
    )
    return difference, control[0] if control else NO_DIFFERENCE._replace(relative=relative)


def compare(
    runs: pl.DataFrame, base: str, candidate: str, measure: Measure, rng: np.random.Generator, *, relative: bool = True
) -> Difference:
    """Return by how much `candidate` does better than `base` on the runs of one scenario."""
    pairs = pairs_by_variant(runs.filter(pl.col("variant").is_in([base, candidate])), measure)
    sign = 1.0 if measure.larger_is_better else -1.0
    samples, sign, n_diverged = _both(pairs.get(base, NO_PAIRS), pairs.get(candidate, NO_PAIRS), sign)
    return paired_difference(*samples, sign, n_diverged, rng, relative=relative)


def _both(base: Pairs, candidate: Pairs, sign: float) -> tuple[tuple[FloatArray, FloatArray], float, int]:
    """Return the values of the pairs that both have and that diverged in neither, the sign, and how many diverged."""
    _, here, there = np.intersect1d(base.key, candidate.key, assume_unique=True, return_indices=True)
    diverged = base.diverged[here] | candidate.diverged[there]
    return (base.value[here][~diverged], candidate.value[there][~diverged]), sign, int(diverged.sum())


def paired_difference(
    base: FloatArray,
    candidate: FloatArray,
    sign: float,
    n_diverged: int,
    rng: np.random.Generator,
    *,
    relative: bool = True,
) -> Difference:
    """Return the mean paired difference of two samples, (n,) each, with its interval."""
    n_pairs = base.size
    if n_pairs == 0 or (relative and base.mean() == 0):
        return Difference(math.nan, math.nan, math.nan, n_pairs, n_diverged, relative)

    def in_favour(base: FloatArray, difference: FloatArray) -> FloatArray:
        return sign * difference / np.abs(base) if relative else sign * difference

    difference = candidate - base
    mean = float(in_favour(base.mean(), difference.mean()))
    unit = base if relative else np.ones(n_pairs)
    if unit.all():
        magnitude = float(((np.abs(base) + np.abs(candidate)) / np.abs(unit)).max())
        if is_constant(difference / unit, magnitude):  # every resample gives the same number
            mean = 0.0 if abs(mean) <= ROUNDING * magnitude else mean
            return Difference(mean, mean, mean, n_pairs, n_diverged, relative)
    low, high = bca_interval((base, difference), in_favour, rng)
    return Difference(mean, low, high, n_pairs, n_diverged, relative)


class Band(NamedTuple):
    """A mean over runs with its pointwise 95 % interval, by Student's t."""

    mean: FloatArray
    low: FloatArray
    high: FloatArray


def mean_band(samples: FloatArray) -> Band:
    """Return the band of (n, T) samples: n runs of a series of length T; NaN where there are none."""
    n = samples.shape[0]
    mean = samples.mean(axis=0) if n else np.full(samples.shape[1], np.nan)
    if n < 2:
        return Band(mean, mean, mean)
    half = stdtrit(n - 1, 0.5 + CONFIDENCE / 2) * samples.std(axis=0, ddof=1) / math.sqrt(n)
    return Band(mean, mean - half, mean + half)
