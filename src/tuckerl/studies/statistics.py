"""From the runs of two variants to a difference with an interval, and from that to a verdict.

A *pair* is what two variants did from the same seed; its value for each variant is a mean over agents. The difference
is counted in the claim's favour and, if it is relative, divided by the base's mean; its 95 % interval is the
bias-corrected and accelerated bootstrap over pairs.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import polars as pl
from scipy.special import stdtrit

from tuckerl.intervals import CONFIDENCE, ROUNDING, bca_interval, is_constant
from tuckerl.studies.study import Comparison
from tuckerl.types import FloatArray


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


def pair_values(runs: pl.DataFrame, variant: str, measure: Measure) -> pl.DataFrame:
    """Return one row for each pair of a variant: its columns, `value` and `diverged`."""
    pair = list(measure.pair)
    chosen = runs.filter(pl.col("variant") == variant)
    value = measure.value.cast(pl.Float64).alias("value")
    agents = chosen.group_by([*pair, "agent"]).agg(value, pl.col("diverged").any())
    return agents.group_by(pair).agg(pl.col("value").mean(), pl.col("diverged").any()).sort(pair)


def finite_values(runs: pl.DataFrame, variant: str, measure: Measure) -> FloatArray:
    """Return the values of a variant's pairs in which nothing diverged."""
    return pair_values(runs, variant, measure).filter(~pl.col("diverged"))["value"].to_numpy()


def are_relative(runs: pl.DataFrame, variants: Iterable[str], measure: Measure) -> bool:
    """Return whether differences to all of these variants can be divided by their means.

    The values of each must be all above 0 or all below: then no resample of them has the mean 0. All differences that
    stand side by side are in the same unit.
    """
    samples = [finite_values(runs, variant, measure) for variant in variants]
    return all(bool((values > 0).all() or (values < 0).all()) for values in samples)


def compare_with_control(
    runs: pl.DataFrame, comparison: Comparison, entropy: list[int]
) -> tuple[Difference, Difference]:
    """Return by how much the candidate does better than the base and than the control, on the runs of one scenario.

    `entropy` seeds the intervals, each with a stream of its own. Without a control there is nothing for the second.
    """
    measure, candidate = MEASURES[comparison.measure], comparison.candidate
    others = [name for name in (comparison.base, comparison.control) if name]
    relative = are_relative(runs, others, measure)
    difference, *control = (
        compare(runs, other, candidate, measure, np.random.default_rng([*entropy, stream]), relative=relative)
        for stream, other in enumerate(others)
    )
    return difference, control[0] if control else NO_DIFFERENCE._replace(relative=relative)


def compare(
    runs: pl.DataFrame, base: str, candidate: str, measure: Measure, rng: np.random.Generator, *, relative: bool = True
) -> Difference:
    """Return by how much `candidate` does better than `base` on the runs of one scenario."""
    pair = list(measure.pair)
    joined = pair_values(runs, base, measure).join(
        pair_values(runs, candidate, measure), on=pair, suffix="_candidate", maintain_order="left"
    )
    diverged = joined["diverged"] | joined["diverged_candidate"]
    kept = joined.filter(~diverged)
    sign = 1.0 if measure.larger_is_better else -1.0
    values = (kept["value"].to_numpy(), kept["value_candidate"].to_numpy())
    return paired_difference(*values, sign, int(diverged.sum()), rng, relative=relative)


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
