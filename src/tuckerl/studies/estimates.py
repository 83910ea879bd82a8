"""What single variants of a scenario reached: means over runs with intervals, and learning curves."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.statistics import MEASURES, NO_PAIRS, Pairs, json_numbers, mean_band, pairs_by_variant, run_of
from tuckerl.studies.study import Study
from tuckerl.studies.summary import Curve, Samples, mean_seconds, paired_curves, samples_of
from tuckerl.studies.tables import StudyTables
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
    measure : str
        The name of what is measured, where nothing else is said.
    """

    def __init__(self, tables: StudyTables, measure: str) -> None:
        self._runs, self._measure, self._seconds = tables.runs, measure, mean_seconds(tables.times)
        self._regrets = tables.times.select("variant", "regret")
        self._pairs: dict[str, dict[str, Pairs]] = {}  # by the name of a measure

    def pairs(self, measure: str = "") -> dict[str, Pairs]:
        """Return every variant's pairs by what is measured, or by another measure."""
        measure = measure or self._measure
        if measure not in self._pairs:
            self._pairs[measure] = pairs_by_variant(self._runs, MEASURES[measure])
        return self._pairs[measure]

    def n_finished(self) -> dict[str, int]:
        """Return the number of runs by variant, of those that have any."""
        return dict(self._runs.group_by("variant").agg(pl.struct("instance", "run").n_unique()).iter_rows())

    def estimate(self, name: str, measure: str = "") -> Estimate:
        """Return a variant's mean of what is measured, or of another measure."""
        pairs = self.pairs(measure).get(name, NO_PAIRS)
        n_diverged = np.unique(run_of(pairs.key[pairs.diverged])).size
        return _estimate(name, pairs.finite, n_diverged, self._seconds.get(name, math.nan))

    def regret(self, name: str) -> Estimate | None:
        """Return a variant's mean regret over runs; None where it is not known of any."""
        known = self._regrets.filter(pl.col("variant") == name)["regret"].drop_nulls().to_numpy()
        return _estimate(name, known, 0, math.nan) if known.size else None

    def learning_curves(self, names: Iterable[str], n_episodes: int) -> LearningCurves:
        """Return the curves of those variants that have runs, paired with the first of them.

        A series that is shorter, as its agents share the episodes, is drawn out: an episode of n agents counts as n.
        """
        per_point = math.ceil(n_episodes / MOST_POINTS)
        shown = [name for name in names if name in self.pairs()]
        runs, column = self._runs.filter(pl.col("variant").is_in(shown)), MEASURES[self._measure].column
        samples = {
            name: _by_points(
                _drawn_out(samples_of(runs.filter(pl.col("variant") == name), column), n_episodes), per_point
            )
            for name in shown
        }
        episode = np.minimum(np.arange(1, math.ceil(n_episodes / per_point) + 1) * per_point, n_episodes)
        return LearningCurves(episode, paired_curves(samples) if samples else ())


def reached_of(study: Study, tables: StudyTables) -> list[Reached]:
    """Return what the variants of each of a study's scenarios reached, by what the scenario measures."""
    return [
        Reached(StudyTables(*(frame.filter(pl.col("scenario") == scenario.name) for frame in tables)), scenario.measure)
        for scenario in study.scenarios
    ]


def _drawn_out(samples: Samples, n_episodes: int) -> Samples:
    """Return samples as long as the episodes of all agents together."""
    return samples._replace(values=samples.values.repeat(max(1, n_episodes // samples.values.shape[1]), axis=1))


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
