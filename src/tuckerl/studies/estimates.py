"""What single variants of a scenario reached: means over runs with intervals, and learning curves."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.runner import StudyTables
from tuckerl.studies.statistics import Measure, finite_values, json_numbers, mean_band
from tuckerl.studies.summary import Curve, Samples, mean_seconds, paired_curves, samples_of
from tuckerl.types import FloatArray, IntArray

MOST_POINTS = 100  # of a curve: with more episodes, each point is the mean of several


class Estimate(NamedTuple):
    """A variant's mean over runs; NaN where it is not known."""

    variant: str
    mean: float
    low: float  # 95 % interval of the mean over runs, by Student's t
    high: float
    n_runs: int
    n_diverged: int
    seconds: float  # processor time of a run and agent

    def to_dict(self) -> dict[str, Any]:
        """Return the variant's entry in files of numbers."""
        numbers = json_numbers(self[1:4], "mean", "low", "high")
        return {"variant": self.variant} | numbers | {"runs": self.n_runs, "diverged": self.n_diverged}


class LearningCurves(NamedTuple):
    """What is measured in an episode, by points of one or more episodes."""

    episode: IntArray  # (P,) the last one that each point stands for
    curves: tuple[Curve, ...]


class Reached:
    """What the variants of one scenario reached.

    Parameters
    ----------
    tables : StudyTables
        Of the scenario.
    measure : Measure
    """

    def __init__(self, tables: StudyTables, measure: Measure) -> None:
        self._measure, self._seconds = measure, mean_seconds(tables.times)
        parts = tables.runs.partition_by("variant", as_dict=True, maintain_order=True)
        self._runs = {str(name): part for (name,), part in parts.items()}
        self._none = tables.runs.clear()

    def runs_of(self, names: Iterable[str]) -> pl.DataFrame:
        """Return the rows of some variants."""
        return pl.concat([self._runs.get(name, self._none) for name in names])

    def estimate(self, name: str, measure: Measure | None = None) -> Estimate:
        """Return a variant's mean of what is measured, or of another measure."""
        runs = self._runs.get(name, self._none)
        values = finite_values(runs, name, measure or self._measure)
        n_diverged = runs.filter(pl.col("diverged"))["run"].n_unique()
        return _estimate(name, values, n_diverged, self._seconds.get(name, math.nan))

    def learning_curves(self, names: Iterable[str], n_episodes: int) -> LearningCurves:
        """Return the curves of those variants that have runs, paired with the first of them."""
        per_point = math.ceil(n_episodes / MOST_POINTS)
        samples = {
            name: _by_points(samples_of(self._runs[name], self._measure.column), per_point)
            for name in names
            if name in self._runs
        }
        episode = np.minimum(np.arange(1, math.ceil(n_episodes / per_point) + 1) * per_point, n_episodes)
        return LearningCurves(episode, paired_curves(samples) if samples else ())


def _by_points(samples: Samples, per_point: int) -> Samples:
    """Return the means over as many episodes as one point stands for."""
    n_episodes = samples.values.shape[1]
    starts = np.arange(0, n_episodes, per_point)
    sums = np.add.reduceat(samples.values, starts, axis=1)
    return samples._replace(values=sums / np.diff([*starts, n_episodes]))


def _estimate(name: str, values: FloatArray, n_diverged: int, seconds: float) -> Estimate:
    mean, low, high = (float(bound[0]) for bound in mean_band(values[:, np.newaxis]))
    if values.size < 2:
        low = high = math.nan
    return Estimate(name, mean, low, high, values.size, n_diverged, seconds)
