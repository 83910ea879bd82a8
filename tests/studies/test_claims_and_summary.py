from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tuckerl.studies.claims import judge_claims as claims_of
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.runner import StudyTables
from tuckerl.studies.study import Study
from tuckerl.studies.summary import summarise


@pytest.fixture
def tables(study: Study, tmp_path: Path) -> StudyTables:
    return run_study(study, tmp_path, workers=1)


KEYS = {
    "id",
    "claim",
    "verdict",
    "difference",
    "low",
    "high",
    "control_difference",
    "control_low",
    "control_high",
    "runs",
}


def test_every_claim_of_the_maze_is_tested(study: Study, tables: StudyTables) -> None:
    claims = claims_of(study, tables)
    assert [claim.id for claim in claims] == ["C3", "C4", "C5", "C6", "C9"]
    for claim in claims:
        line = claim.to_dict()
        assert set(line) == KEYS
        assert line["verdict"] in ("holds", "does not hold", "not decided")
        if claim.id != "C9":
            assert line["low"] <= line["difference"] <= line["high"]
    assert [claim.runs for claim in claims[:4]] == [4, 4, 2, 2]


def test_the_control_is_the_same_difference_against_the_constant(study: Study, tables: StudyTables) -> None:
    claim = claims_of(study, tables)[2]
    cost = tables.runs.group_by("variant").agg(pl.col("steps").sum())
    by_name = dict(cost.iter_rows())
    expected = (by_name["constant-1"] - by_name["dyna-ht-1"]) / by_name["constant-1"]
    assert claim.control.mean == pytest.approx(expected)


def test_c9_counts_weights_outside(study: Study, tables: StudyTables) -> None:
    def verdict(weights: pl.DataFrame) -> str:
        return claims_of(study, tables._replace(weights=weights))[-1].verdict

    within = tables.weights.with_columns(weight=pl.lit(0.5))
    assert verdict(within) == "holds"
    assert verdict(within.with_columns(weight=pl.when(pl.int_range(pl.len()) == 5).then(0.0).otherwise("weight"))) == (
        "does not hold"
    )
    assert verdict(within.with_columns(weight=pl.lit(1.0 + 1e-12))) == "does not hold"
    assert verdict(within.clear()) == "not decided"


def test_the_verdict_does_not_depend_on_the_order_of_rows(study: Study, tables: StudyTables) -> None:
    shuffled = tables.runs.sample(fraction=1, shuffle=True, seed=0)
    one, other = (claims_of(study, tables._replace(runs=runs)) for runs in (tables.runs, shuffled))
    assert [claim.to_dict() for claim in one] == [claim.to_dict() for claim in other]


def test_curves_cumulate_mean_steps(study: Study, tables: StudyTables) -> None:
    _, (summary,) = summarise(study, tables)
    curve = summary.curves[2]
    assert curve.variant == "dyna-ht-3"
    steps = tables.runs.filter(variant="dyna-ht-3").sort("instance", "run", "agent", "episode")["steps"]
    cube = steps.to_numpy().reshape(2, 2, 3, 20)  # instance, run, agent, episode
    by_run = cube.mean(axis=2).sum(axis=0).cumsum(axis=1)
    assert np.allclose(curve.band.mean, by_run.mean(axis=0))
    assert curve.n_runs == 2


def test_weights_are_averaged_over_runs(study: Study, tables: StudyTables) -> None:
    _, (summary,) = summarise(study, tables)
    course = next(c for c in summary.weights if c.variant == "dyna-ht-1")
    assert course.episode.tolist() == [10, 20]
    up = tables.weights.filter(variant="dyna-ht-1", action=0)
    assert course.bands[0].mean[1] == pytest.approx(up.filter(episode=20)["weight"].mean())


def test_the_shortest_path_of_the_best_agent_is_pictured(study: Study, tables: StudyTables) -> None:
    _, (summary,) = summarise(study, tables)
    for path in summary.paths:
        shortest = tables.runs.filter(variant=path.variant, instance=0, run=0)["steps"].min()
        assert path.states.size - 1 == shortest
