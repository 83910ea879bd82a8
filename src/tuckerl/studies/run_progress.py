"""What is known of a study's runs while they are played: how many, how fast, and each variant's mean so far."""

import math
import time
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.statistics import MEASURES, Measure
from tuckerl.studies.study import Study
from tuckerl.studies.tables import SCHEMAS, StudyTables
from tuckerl.studies.workers import Played

_NORMAL = 1.959964  # of the standard error, on each side of a mean: 95 % of a normal distribution


class VariantProgress(NamedTuple):
    """A variant's runs so far."""

    scenario: str
    variant: str
    n_runs: int  # that finished, without those that diverged: of which the mean is
    mean: float  # of what the scenario measures, over single runs; NaN without any
    half_width: float  # of the normal 95 % interval of the mean; NaN of fewer than two runs
    n_diverged: int
    n_failed: int


class _Sums:
    """The running mean of a variant, and the sum of squares about it (Welford), at the same cost whatever came before.

    Its interval is that of a normal distribution: this is looked at while runs go on, and verdicts come later.
    """

    def __init__(self) -> None:
        self.n = self.n_diverged = self.n_failed = 0
        self.mean = self.squares = 0.0

    def add(self, value: float | None, *, diverged: bool) -> None:
        if diverged or value is None:
            self.n_diverged += 1
            return
        self.n += 1
        away = value - self.mean
        self.mean += away / self.n
        self.squares += away * (value - self.mean)

    @property
    def half_width(self) -> float:
        return _NORMAL * math.sqrt(self.squares / (self.n - 1) / self.n) if self.n > 1 else math.nan


class RunProgress:
    """How far the runs of a study are, and what its variants have reached.

    Parameters
    ----------
    study : Study
    n_done : int
        Runs that were finished before.
    n_total : int
    tables : StudyTables, optional
        What those have left, for the means.

    Attributes
    ----------
    n_done, n_total : int
        Runs that are finished and stored, and all.
    n_failed : int
        Runs that ended with an error since it was made.
    """

    def __init__(self, study: Study, n_done: int, n_total: int, tables: StudyTables | None = None) -> None:
        self.n_done, self.n_total, self.n_failed = n_done, n_total, 0
        self._begun = self._first = time.monotonic()
        self._n_first: float = math.nan  # runs that had ended when the first had
        self.measures = {scenario.name: MEASURES[scenario.measure] for scenario in study.scenarios}
        self._sums = {(one.name, variant.name): _Sums() for one in study.scenarios for variant in one.variants}
        finished = pl.DataFrame(schema=SCHEMAS["runs"]) if tables is None else tables.runs
        for scenario, measure in self.measures.items():
            runs = finished.filter(pl.col("scenario") == scenario)
            for variant, _, _, value, diverged in _values(runs, ["variant", "instance", "run"], measure):
                self._sums[scenario, variant].add(value, diverged=diverged)

    def add(self, played: Sequence[Played]) -> None:
        """Count runs that have been stored, and those that ended with an error."""
        for one in played:
            if one.tables is None:
                self.n_failed += 1
                self._sums[one.run.scenario, one.run.variant].n_failed += 1
            else:
                self.n_done += 1
        if math.isnan(self._n_first):
            self._first, self._n_first = time.monotonic(), self.n_done + self.n_failed
        for scenario, measure in self.measures.items():
            own = [(one.run, one.tables) for one in played if one.tables is not None and one.run.scenario == scenario]
            if own:  # all at once: that costs little more than one
                place = np.repeat(np.arange(len(own)), [tables.runs.height for _, tables in own])
                runs = pl.concat([tables.runs for _, tables in own]).with_columns(place=place)
                for number, value, diverged in _values(runs, ["place"], measure):
                    self._sums[scenario, own[number][0].variant].add(value, diverged=diverged)

    @property
    def rate(self) -> float:
        """Runs that end in a second, on the average since the first: before it, kernels are loaded; NaN until then."""
        n_ended, seconds = self.n_done + self.n_failed - self._n_first, time.monotonic() - self._first
        return n_ended / seconds if n_ended > 0 and seconds > 0 else math.nan

    @property
    def seconds_left(self) -> float:
        """Seconds until all runs have ended, at this rate; NaN where that is not known."""
        return (self.n_total - self.n_done - self.n_failed) / self.rate

    @property
    def seconds(self) -> float:
        """Seconds since it was made."""
        return time.monotonic() - self._begun

    def variants(self) -> list[VariantProgress]:
        """Return how far each variant is, in the study's order."""
        return [
            VariantProgress(*key, one.n, one.mean if one.n else math.nan, one.half_width, one.n_diverged, one.n_failed)
            for key, one in self._sums.items()
        ]


def _values(runs: pl.DataFrame, key: list[str], measure: Measure) -> Iterator[tuple[Any, ...]]:
    """Give the key of each run, what is measured of it (the mean over its agents), and whether it diverged."""
    agents = runs.group_by(*key, "agent").agg(measure.value.cast(pl.Float64).alias("value"), pl.col("diverged").any())
    return agents.group_by(*key).agg(pl.col("value").mean(), pl.col("diverged").any()).sort(*key).iter_rows()
