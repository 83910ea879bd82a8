"""What is known of runs while they are played agrees with what their tables say in the end."""

import math
from pathlib import Path

import polars as pl
import pytest

from tests.studies.comparisons import small_comparison
from tuckerl.studies import reproduce
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.run_progress import RunProgress, VariantProgress
from tuckerl.studies.runs import Run
from tuckerl.studies.tables import ROWS, StudyTables
from tuckerl.studies.workers import Played


def test_means_and_intervals_are_those_of_the_finished_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reproduce, "_SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr(reproduce, "_WRITES_SHARE", 1.0)
    seen: list[tuple[int, int]] = []

    def look(runs: RunProgress) -> None:
        seen.append((runs.n_done, runs.n_total))
        known[:] = runs.variants()

    known: list[VariantProgress] = []
    few = small_comparison("sarsa", "q-learning", n_runs=2).study
    run_study(few, tmp_path, workers=1, progress=look)
    assert seen[0] == (0, 4)
    assert seen[-1] == (4, 4)
    assert len(seen) > 2, "it is told of between the first run and the last"
    seen.clear()
    more = small_comparison("sarsa", "q-learning", n_runs=5).study
    tables = run_study(more, tmp_path, workers=1, progress=look)
    assert seen[0] == (4, 10)
    by_run = tables.runs.group_by("variant", "run").agg(pl.col("return").mean())
    for one in known:
        values = by_run.filter(variant=one.variant)["return"].to_numpy()
        assert one.n_runs == values.size == 5, "also those that an earlier call has played"
        assert one.mean == pytest.approx(values.mean())
        assert one.half_width == pytest.approx(1.959964 * values.std(ddof=1) / math.sqrt(5))
        assert (one.n_diverged, one.n_failed) == (0, 0)


def test_runs_that_diverged_or_failed_are_counted_beside_the_mean() -> None:
    study = small_comparison(n_runs=4).study
    scenario = study.scenarios[0]
    name = scenario.variants[0].name
    runs = RunProgress(study, 0, 4)
    assert math.isnan(runs.rate)
    assert math.isnan(runs.seconds_left)
    tables = [_tables(value) for value in (1.0, 3.0, None)]
    played = [Played(Run(scenario.name, name, 0, at), own) for at, own in enumerate(tables)]
    runs.add([*played, Played(Run(scenario.name, name, 0, 3), None, "it broke")])
    own = runs.variants()[0]
    assert own[2:] == pytest.approx((2, 2.0, 1.959964, 1, 1))
    assert (runs.n_done, runs.n_failed) == (3, 1)
    assert math.isnan(runs.variants()[1].mean)


def _tables(value: float | None) -> StudyTables:
    empty = {kind: pl.DataFrame(schema=schema) for kind, schema in ROWS.items()}
    columns = {
        "agent": [0, 0],
        "episode": [0, 1],
        "steps": [1, 1],
        "return": [value] * 2,
        "diverged": [value is None] * 2,
    }
    return StudyTables(**empty | {"runs": pl.DataFrame(columns, schema=ROWS["runs"])})
