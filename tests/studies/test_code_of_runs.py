"""Runs that several codes have played in one folder: which of them count, and what the tables hold."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.studies.small_study import SMALL
from tuckerl.studies import playing
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.runs import run_code
from tuckerl.studies.store import Store
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.tables import StudyTables
from tuckerl.training.learner import Learner

CodeOfNumber = Callable[[int], None]
_LAKE = replace(SMALL.scenarios[0], n_instances=1, n_runs=6, n_episodes=3, variants=SMALL.scenarios[0].variants[:1])
STUDY = Study((_LAKE,), 3)


@pytest.fixture
def code(monkeypatch: pytest.MonkeyPatch) -> CodeOfNumber:
    """Make the code another one, whose runs all have its number as returns."""
    real, frame = run_code, playing._runs_frame

    def change(number: int) -> None:
        def code_of(scenario: Scenario, variant: Variant) -> dict[str, str]:
            return real(scenario, variant) | {"tuckerl.changed": str(number)}

        def runs_frame(learner: Learner, n_episodes: int) -> pl.DataFrame:
            return frame(learner, n_episodes).with_columns(pl.lit(float(number)).alias("return"))

        monkeypatch.setattr("tuckerl.studies.store.run_code", code_of)
        monkeypatch.setattr(playing, "_runs_frame", runs_frame)

    return change


def returns(folder: Path, tables: StudyTables) -> set[float]:
    """Return which codes' returns a folder's table has, and the tables that are its."""
    kept = pl.read_parquet(folder / "runs.parquet")
    assert kept.equals(tables.runs), "the file is what was returned"
    return set(kept["return"])


@contextmanager
def each_run_in_a_part(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with monkeypatch.context() as quick:
        quick.setattr("tuckerl.studies.reproduce._SECONDS_BETWEEN_WRITES", -1.0)
        quick.setattr("tuckerl.studies.reproduce._WRITES_SHARE", 1e9)
        yield


def test_tables_are_made_anew_when_the_runs_are_played_again(tmp_path: Path, code: CodeOfNumber) -> None:
    for number in (1, 2):
        code(number)
        assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1, overwrite=True)) == {number}
    code(1)
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1)) == {1}, "its runs are still there"


def test_what_is_accepted_is_what_the_latest_code_has_played(
    tmp_path: Path, code: CodeOfNumber, monkeypatch: pytest.MonkeyPatch
) -> None:
    with each_run_in_a_part(monkeypatch):
        for number in (1, 2, 3):
            code(number)
            run_study(STUDY, tmp_path, workers=1, overwrite=True)
    assert len(list((tmp_path / "parts").iterdir())) == 18
    code(4)
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1, accept_code=True)) == {3}
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1)) == {3}, "from then on"
    monkeypatch.setattr("tuckerl.studies.parts._MANY", 2)
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1)) == {3}
    assert len(list((tmp_path / "parts").iterdir())) == 1
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1)) == {3}, "all in one part"


def test_what_was_accepted_can_still_be_played_again(tmp_path: Path, code: CodeOfNumber) -> None:
    code(1)
    run_study(STUDY, tmp_path, workers=1)
    code(2)
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1, accept_code=True)) == {1}
    assert returns(tmp_path, run_study(STUDY, tmp_path, workers=1, overwrite=True)) == {2}


def test_a_study_that_has_accepted_runs_grows_by_those_of_today(tmp_path: Path, code: CodeOfNumber) -> None:
    code(1)
    run_study(STUDY, tmp_path, workers=1)
    code(2)
    run_study(STUDY, tmp_path, workers=1, accept_code=True)
    larger = Study((replace(_LAKE, n_runs=7),), 3)
    grown = run_study(larger, tmp_path, workers=1)
    assert returns(tmp_path, grown) == {1, 2}
    assert set(grown.runs.filter(pl.col("return") == 2.0)["run"]) == {6}
    with Store(tmp_path, larger) as store:
        assert not store.missing()
