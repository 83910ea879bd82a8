"""A user's own scenario: one file, one line, measured by return. It has all that the paper's have."""

import json
from pathlib import Path

import pytest

from tests.studies import own_scenario
from tuckerl.cli import main
from tuckerl.studies import scenarios
from tuckerl.studies.ablation import ablation_study, ablations
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.study import Study
from tuckerl.studies.summary import summarise
from tuckerl.studies.tables import StudyTables

MINE = own_scenario.FROZEN_LAKE


@pytest.fixture(scope="module")
def study() -> Study:
    return Study((MINE.resized(n_runs=3),), seed=4)


@pytest.fixture(scope="module")
def tables(study: Study, tmp_path_factory: pytest.TempPathFactory) -> StudyTables:
    return run_study(study, tmp_path_factory.mktemp("mine"), workers=1)


def test_claims_and_curves_are_of_returns(study: Study, tables: StudyTables) -> None:
    claims, (summary,) = summarise(study, tables)
    mine = next(claim for claim in claims if claim.id == "L1")
    returns = {
        name: tables.runs.filter(variant=name)
        .group_by("run", "agent")
        .agg(own_scenario.MEAN_RETURN)["return"]
        .to_numpy()
        for name in ("q-learning", "tq-learning-1")
    }
    expected = returns["tq-learning-1"].mean() - returns["q-learning"].mean()
    assert mine.difference.mean * (abs(returns["q-learning"].mean()) if mine.difference.relative else 1) == (
        pytest.approx(expected)
    )
    curve = summary.curves[0]
    assert curve.variant == "q-learning"
    assert curve.band.mean[-1] == pytest.approx(returns["q-learning"].mean() * MINE.n_episodes)
    best = tables.runs.filter(variant="q-learning").group_by("run").agg(own_scenario.BEST_RETURN)["return"].mean()
    assert summary.best_episodes["q-learning"] == best
    assert [claim.id for claim in claims] == ["L1", "L2"]


def test_its_ablation_has_the_rules_that_it_names(study: Study, tmp_path: Path) -> None:
    small = ablation_study(study)
    (ablation,) = ablations(small, run_study(small, tmp_path, workers=1).runs)
    assert [step.variant for step in ablation.steps] == [
        *("constant-1", "permuted-1", "tq-learning-1", "tq-learning-3-best", "q-learning-slow"),
    ]
    assert {step.difference.relative for step in ablation.steps} == {False}, "in some run the base never arrived"
    assert all(step.difference.n_pairs == 3 for step in ablation.steps)


def test_reproduce_plays_it_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(scenarios.SCENARIOS, MINE.name, MINE)  # as its line in the register does
    with pytest.raises(SystemExit) as end:
        main(["reproduce", "lake", "--runs", "2", "--workers", "1", "--sensitivity", "--out", str(tmp_path)])
    out = capsys.readouterr().out
    assert end.value.code == 0
    assert " L1  " in out
    claims = json.loads((tmp_path / "claims.json").read_text(encoding="utf-8"))
    assert [claim["id"] for claim in claims] == ["L1", "L2"]
    names = ("ablation-lake", "curves-lake", "omega-lake", "sensitivity")
    assert sorted(path.name for path in (tmp_path / "figures").glob("*.svg")) == [f"{name}.svg" for name in names]
    page = (tmp_path / "report.html").read_text(encoding="utf-8").split("<script>")[0]
    for words in (
        *("Total return", "Best episode", "Slippery lake"),
        *("smaller rate", "tuckerl reproduce lake --runs 2 --seed 0 --sensitivity"),
    ):
        assert words in page, words
    assert " nan" not in page.lower()


def test_it_is_listed_by_its_description(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(scenarios.SCENARIOS, MINE.name, MINE)
    with pytest.raises(SystemExit):
        main(["list", "scenarios"])
    assert capsys.readouterr().out.splitlines()[-1] == f"lake\t{MINE.description}"


def test_no_two_scenarios_have_one_place_in_the_seeds() -> None:
    numbers = [scenario.number for scenario in (*scenarios.SCENARIOS.values(), MINE)]
    assert len(set(numbers)) == len(numbers)
    assert 3 not in numbers, "tuckerl compare has it"
