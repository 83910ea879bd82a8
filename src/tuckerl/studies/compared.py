"""What came out of a comparison: the paired difference, the same against the control, and curves."""

import math
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.compare import ComparisonStudy
from tuckerl.studies.runner import Tables
from tuckerl.studies.statistics import MEASURES, Difference, compare, has_one_sign, mean_band, pair_values
from tuckerl.studies.summary import Curve, Samples, finite_runs, paired_curves
from tuckerl.types import FloatArray, IntArray

MOST_POINTS = 100  # of a curve: with more episodes, each point is the mean of several
_NOTHING = Difference(math.nan, math.nan, math.nan, 0, 0)
VERDICTS = {"holds": "better", "does not hold": "worse", "not decided": "not decided"}


class Estimate(NamedTuple):
    """What one variant reached; NaN where it cannot be told."""

    variant: str
    mean: float
    low: float  # 95 % interval of the mean over runs, by Student's t
    high: float
    n_runs: int
    n_diverged: int
    seconds: float  # processor time of a run and agent


class ComparisonResult(NamedTuple):
    """A comparison with its result."""

    contest: ComparisonStudy
    difference: Difference  # of the candidate to the base
    control: Difference  # of the candidate to the control; nothing where there is none
    estimates: tuple[Estimate, ...]  # in the order of the variants: base, candidate, control
    episode: IntArray  # (P,) the last one that each point of the curves stands for
    curves: tuple[Curve, ...]  # by points: the measured quantity in an episode

    @property
    def verdict(self) -> str:
        """Whether the candidate is "better", "worse" or it is "not decided"."""
        return VERDICTS[self.difference.verdict]

    def as_json(self) -> dict[str, Any]:
        """Return the content of ``compare.json``."""
        request, comparison = self.contest.request, self.contest.comparison
        return {
            "base": comparison.base,
            "candidate": comparison.candidate,
            "environment": request.environment,
            "environment_keywords": dict(request.keywords),
            "measure": request.measure,
            "larger_is_better": MEASURES[request.measure].larger_is_better,
            "verdict": self.verdict,
            "relative": self.difference.relative,
            "difference": _number(self.difference.mean),
            "low": _number(self.difference.low),
            "high": _number(self.difference.high),
            "control": comparison.control or None,
            "control_difference": _number(self.control.mean),
            "control_low": _number(self.control.low),
            "control_high": _number(self.control.high),
            "no_control": self.contest.no_control or None,
            "runs": self.difference.n_pairs,
            "diverged": self.difference.n_diverged,
            "episodes": request.n_episodes,
            "seed": request.seed,
            "variants": [_estimate_json(estimate) for estimate in self.estimates],
        }


def compared(contest: ComparisonStudy, tables: Tables) -> ComparisonResult:
    """Return what the tables of a contest's study say."""
    comparison, request = contest.comparison, contest.request
    measure = MEASURES[request.measure]
    values = {
        made.name: pair_values(tables.runs, made.name, measure).filter(~pl.col("diverged"))["value"].to_numpy()
        for made in contest.scenario.variants
    }
    # Both differences are told in the same unit, or they could not be set side by side.
    against = [comparison.base, *([comparison.control] if comparison.control else [])]
    relative = all(has_one_sign(values[name]) for name in against)

    def difference(other: str, stream: int) -> Difference:
        rng = np.random.default_rng([request.seed, contest.scenario.number, stream])
        return compare(tables.runs, other, comparison.candidate, measure, rng, relative=relative)

    per_point = math.ceil(request.n_episodes / MOST_POINTS)
    column = "steps" if request.measure == "steps" else "return"
    samples = {
        made.name: _by_points(tables.runs.filter(pl.col("variant") == made.name), column, per_point)
        for made in contest.scenario.variants
    }
    seconds = tables.times.group_by("variant").agg((pl.col("seconds") / pl.col("agents")).mean())
    times = dict(seconds.iter_rows())
    return ComparisonResult(
        contest,
        difference(comparison.base, 0),
        difference(comparison.control, 1) if comparison.control else _NOTHING._replace(relative=relative),
        tuple(_estimate(name, values[name], samples[name].n_diverged, times[name]) for name in values),
        np.minimum(np.arange(1, math.ceil(request.n_episodes / per_point) + 1) * per_point, request.n_episodes),
        paired_curves(samples),
    )


def _by_points(runs: pl.DataFrame, column: str, per_point: int) -> Samples:
    """Return the mean over a variant's agents, and over as many episodes as one point stands for."""
    finite, kept, n_diverged = finite_runs(runs)
    n_episodes = int(runs["episode"].max() or 0) + 1  # type: ignore[arg-type]  # an integer column
    ordered = finite.sort("run", "episode", "agent")[column].to_numpy().astype(np.float64)
    by_episode = ordered.reshape(kept.len(), n_episodes, -1).mean(axis=2) if kept.len() else np.zeros((0, n_episodes))
    starts = np.arange(0, n_episodes, per_point)
    sums = np.add.reduceat(by_episode, starts, axis=1)
    return Samples(kept.to_numpy(), sums / np.diff([*starts, n_episodes]), n_diverged)


def _estimate(name: str, values: FloatArray, n_diverged: int, seconds: float) -> Estimate:
    if values.size == 0:
        return Estimate(name, math.nan, math.nan, math.nan, 0, n_diverged, seconds)
    mean, low, high = (float(bound[0]) for bound in mean_band(values[:, np.newaxis]))
    if values.size < 2:
        low = high = math.nan
    return Estimate(name, mean, low, high, values.size, n_diverged, seconds)


def _estimate_json(estimate: Estimate) -> dict[str, Any]:
    return {
        "variant": estimate.variant,
        "mean": _number(estimate.mean),
        "low": _number(estimate.low),
        "high": _number(estimate.high),
        "runs": estimate.n_runs,
        "diverged": estimate.n_diverged,
    }


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
