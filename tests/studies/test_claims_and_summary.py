import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tuckerl.studies.claims import Claim, judge_claims
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.scenarios import scenario_study
from tuckerl.studies.study import Study
from tuckerl.studies.summary import Samples, _weight_course, paired_curves, summarise
from tuckerl.studies.tables import SCHEMAS, StudyTables


@pytest.fixture(scope="module")
def tables(study: Study, tmp_path_factory: pytest.TempPathFactory) -> StudyTables:
    return run_study(study, tmp_path_factory.mktemp("study"), workers=1)


KEYS = {
    "id",
    "claim",
    "scenario",
    "verdict",
    "difference",
    "low",
    "high",
    "control_difference",
    "control_low",
    "control_high",
    "tensor",
    "tensor_question",
    "constant_difference",
    "constant_low",
    "constant_high",
    "detail",
    "runs",
}


def test_every_claim_of_the_maze_is_tested(study: Study, tables: StudyTables) -> None:
    claims = judge_claims(study, tables)
    assert [claim.id for claim in claims] == ["C3", "C4", "C5", "C6", "C9"]
    for claim in claims:
        line = claim.to_dict()
        assert set(line) == KEYS
        assert line["verdict"] in ("holds", "does not hold", "not decided")
        if claim.id != "C9":
            assert line["low"] <= line["difference"] <= line["high"]
    assert [claim.runs for claim in claims[:4]] == [4, 4, 2, 2]


def test_the_control_is_the_same_difference_against_the_constant(study: Study, tables: StudyTables) -> None:
    claim = judge_claims(study, tables)[2]
    cost = tables.runs.group_by("variant").agg(pl.col("steps").sum())
    by_name = dict(cost.iter_rows())
    expected = (by_name["constant-1"] - by_name["dyna-ht-1"]) / by_name["constant-1"]
    assert claim.control.mean == pytest.approx(expected)


def test_the_second_verdict_is_the_controls(study: Study, tables: StudyTables) -> None:
    for line in (claim.to_dict() for claim in judge_claims(study, tables)):
        if line["id"] == "C9":
            assert line["tensor"] is line["tensor_question"] is None
        else:
            fits = {"yes": line["control_low"] > 0, "no": line["control_high"] < 0}
            assert line["tensor"] == next((answer for answer, is_so in fits.items() if is_so), "not decided")


def test_a_claim_about_copying_is_asked_another_question_and_has_the_constant_variants_beside_it(
    study: Study, tables: StudyTables
) -> None:
    claims = {claim.id: claim for claim in judge_claims(study, tables)}
    questions = {name: claim.tensor_question for name, claim in claims.items()}
    assert questions == {
        **dict.fromkeys(("C3", "C5"), "is it the tensor?"),
        **dict.fromkeys(("C4", "C6"), "are the weights better than a constant rate?"),
        "C9": "",
    }
    assert math.isnan(claims["C5"].constant.mean)
    costs = tables.runs.group_by("variant", "instance", "run", "agent").agg(pl.col("steps").sum())
    cost = dict(costs.group_by("variant").agg(pl.col("steps").mean()).iter_rows())
    expected = (cost["constant-1"] - cost["constant-3-max"]) / cost["constant-1"]
    assert claims["C6"].constant.mean == pytest.approx(expected)
    line = claims["C6"].to_dict()
    assert line["constant_low"] <= line["constant_difference"] <= line["constant_high"]


def test_a_claim_without_a_control_has_no_second_verdict(study: Study, tables: StudyTables) -> None:
    scenario = study.scenarios[0]
    alone = tuple(replace(one, control="", control_base="") for one in scenario.comparisons)
    claim = judge_claims(Study((replace(scenario, comparisons=alone),), study.seed), tables)[0]
    assert claim.tensor is None
    assert not math.isnan(claim.difference.mean)


def test_every_claim_of_the_paper_names_variants_that_are_played() -> None:
    for scenario in scenario_study().scenarios:
        played = {variant.name for variant in scenario.variants}
        for one in scenario.comparisons:
            assert {one.base, one.candidate, one.control, one.control_base} - {""} <= played


def test_c9_counts_weights_outside(study: Study, tables: StudyTables) -> None:
    def verdict(weights: pl.DataFrame) -> str:
        return judge_claims(study, tables._replace(weights=weights))[-1].verdict

    within = tables.weights.with_columns(weight=pl.lit(0.5))
    assert verdict(within) == "holds"
    assert verdict(within.with_columns(weight=pl.when(pl.int_range(pl.len()) == 5).then(0.0).otherwise("weight"))) == (
        "does not hold"
    )
    assert verdict(within.with_columns(weight=pl.lit(1.0 + 1e-12))) == "does not hold"
    assert verdict(within.clear()) == "not decided"


def test_the_verdict_does_not_depend_on_the_order_of_rows(study: Study, tables: StudyTables) -> None:
    shuffled = tables.runs.sample(fraction=1, shuffle=True, seed=0)
    one, other = (judge_claims(study, tables._replace(runs=runs)) for runs in (tables.runs, shuffled))
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
        agents = tables.runs.filter(variant=path.variant).group_by("instance", "run", "agent")
        best = agents.agg(pl.col("steps").min())["steps"].mean()
        assert summary.best_episodes[path.variant] == pytest.approx(best)


def test_paths_of_older_results_are_the_shortest_alone(study: Study, tables: StudyTables) -> None:
    _, (summary,) = summarise(study, tables)
    shortest = tables.paths.group_by("variant", "agent", "episode").len().sort("len", "episode")
    first = shortest.group_by("variant", "agent", maintain_order=True).first()
    old = tables.paths.join(first, on=["variant", "agent", "episode"], how="semi")
    old = old.with_columns(episode=pl.lit(None, dtype=pl.Int32))
    _, (of_old,) = summarise(study, tables._replace(paths=old))
    for path, of_older in zip(summary.paths, of_old.paths, strict=True):
        assert len(path.episodes) == study.scenarios[0].n_episodes
        assert of_older.episodes == ()
        assert of_older.states.tolist() == path.states.tolist()


def test_the_agent_that_is_copied_is_counted_window_by_window(study: Study, tables: StudyTables) -> None:
    _, (summary,) = summarise(study, tables)
    course = next(c for c in summary.weights if c.variant == "dyna-ht-3")
    own = tables.weights.filter(variant="dyna-ht-3", action=0, episode=20)
    assert [part[1] for part in course.chosen] == [(own["chosen"] == agent).mean() for agent in range(3)]
    assert sum(part[1] for part in course.chosen) == pytest.approx(1)
    assert course.n_runs == own.height


def paper_tables(seconds: dict[str, float], steps: dict[str, int]) -> tuple[Study, StudyTables]:
    """The paper's study and tables in which a kind of variant takes so long, for so many steps, in each run."""
    study = scenario_study(runs=2, episodes=1)
    runs, times = [], []
    for scenario in study.scenarios:
        for variant in scenario.variants:
            kind = "base" if variant.tensor_step is None else "other"
            for run in range(2):
                key = {"scenario": scenario.name, "variant": variant.name, "instance": 0, "run": run}
                times.append(key | {"agents": variant.n_agents, "seconds": seconds[kind], "tensor_step_seconds": 0.25})
                for agent in range(variant.n_agents):
                    lost = run == 1 and (scenario.name, variant.name) == ("cart-pole", "tsarsa-lambda-1")
                    row = {"agent": agent, "episode": 0, "steps": None if lost else steps[kind], "return": None}
                    runs.append(key | row | {"diverged": lost})
    rows = {"runs": runs, "weights": [], "paths": [], "times": times}
    frames = {name: pl.DataFrame(rows[name], schema=schema) for name, schema in SCHEMAS.items()}
    return study, StudyTables(**frames)


def processor_time(study: Study, tables: StudyTables) -> Claim:
    (claim,) = (claim for claim in judge_claims(study, tables) if claim.id == "C8")
    return claim


def test_processor_time_is_counted_by_environment_step() -> None:
    # Twice the time, and twice the steps: one agent needs as much for each of them.
    claim = processor_time(*paper_tables({"base": 1.0, "other": 2.0}, {"base": 100, "other": 200}))
    assert claim.verdict == "holds"
    assert claim.ratio == pytest.approx(1.0)
    assert claim.to_dict()["ratio"] == claim.ratio
    assert claim.detail.startswith("processor time per environment step, over the base's: Cart pole 0.33 to 1, ")
    # Of three agents all steps are counted, and a run that diverged is left out.
    assert claim.runs == (2 + 1 + 3 * 2) + (2 + 2 * 2) + (2 + 2 * 2)
    slow = processor_time(*paper_tables({"base": 1.0, "other": 4.0}, {"base": 100, "other": 200}))
    assert slow.verdict == "does not hold"
    assert slow.ratio == pytest.approx(2.0)


def test_processor_time_is_a_claim_about_all_of_the_papers_scenarios() -> None:
    study, tables = paper_tables({"base": 1.0, "other": 2.0}, {"base": 100, "other": 200})
    part = Study(study.scenarios[:2], study.seed)
    assert [claim.id for claim in judge_claims(part, tables)] == ["C1", "C2", "C3", "C4", "C5", "C6", "C9", "C10"]
    mine = replace(study.scenarios[0], name="mine", is_of_paper=False, comparisons=())
    claim = processor_time(Study((*study.scenarios, mine), study.seed), tables)
    assert "mine" not in claim.detail


def test_processor_time_is_not_decided_where_no_run_is_left() -> None:
    study, tables = paper_tables({"base": 1.0, "other": 2.0}, {"base": 100, "other": 200})
    runs = tables.runs.with_columns(diverged=pl.col("diverged") | (pl.col("scenario") == "dyna-maze"))
    claim = processor_time(study, tables._replace(runs=runs))
    assert claim.verdict == "not decided"
    assert "DYNA maze no run left" in claim.detail


def test_other_claims_have_no_ratio(study: Study, tables: StudyTables) -> None:
    assert all("ratio" not in claim.to_dict() for claim in judge_claims(study, tables))


@pytest.mark.parametrize(("seconds", "verdict"), [(1.5, "holds"), (1.6, "does not hold")])
def test_processor_time_is_judged_at_one_and_a_half_times_the_bases(seconds: float, verdict: str) -> None:
    tables = paper_tables({"base": 1.0, "other": seconds}, {"base": 100, "other": 100})
    assert processor_time(*tables).verdict == verdict


def test_runs_that_diverged_take_no_part_in_processor_time() -> None:
    study, tables = paper_tables({"base": 1.0, "other": 1.2}, {"base": 100, "other": 100})
    is_lost = (pl.col("variant") == "tsarsa-lambda-1") & (pl.col("run") == 1)
    times = tables.times.with_columns(seconds=pl.when(is_lost).then(99.0).otherwise(pl.col("seconds")))
    claim = processor_time(study, tables._replace(times=times))
    assert claim.verdict == "holds"
    assert claim.ratio == pytest.approx(1.2)


def test_curves_are_paired_where_other_runs_diverged() -> None:
    base = Samples(np.array([0, 1, 3]), np.array([[1.0], [10.0], [30.0]]), 1)
    other = Samples(np.array([1, 2, 3]), np.array([[11.0], [200.0], [33.0]]), 1)
    _, curve = paired_curves({"base": base, "other": other})
    assert curve.against_base.mean.tolist() == [2.0]  # of 1 and 3, the runs that both have
    assert curve.n_runs == 3


def test_weights_of_runs_that_ended_early_are_in_no_band() -> None:
    rows = [
        (run, episode, action, weight)
        for run, weight in ((0, 0.5), (1, 0.25), (2, 0.9))
        for episode in (9, 19)
        for action in (0, 1)
        if run < 2 or episode < 19
    ]
    weights = pl.DataFrame(rows, schema=["run", "episode", "action", "weight"], orient="row")
    course = _weight_course(DYNA_MAZE.variant("dyna-ht-1"), weights.with_columns(instance=0, chosen=0))
    assert course.episode.tolist() == [9, 19]
    assert [band.mean.tolist() for band in course.bands] == [[0.375, 0.375]] * 2
