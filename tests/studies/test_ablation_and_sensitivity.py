from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tests.studies.played import first_runs
from tuckerl.studies.ablation import ablation_study, ablations
from tuckerl.studies.scenarios import SCENARIOS, scenario_study
from tuckerl.studies.sensitivity import DEFAULT, estimated_seconds, sensitivity_study, summarise_sensitivity
from tuckerl.studies.study import Study, variant

MAIN = scenario_study(runs=1, episodes=12)
OTHERS = sensitivity_study(MAIN, runs=1)
SMALL = ablation_study(MAIN)


def tiny(study: Study, place: int, n_episodes: int = 12) -> Study:
    """Return one scenario of a study, with one instance, one run and a window's worth of episodes."""
    return Study((study.scenarios[place].resized(1, 1, n_episodes),), study.seed)


def _slow(name: str) -> list[pytest.MarkDecorator]:
    return [pytest.mark.compiled] if name.startswith("dyna-maze") else []  # planning in mazes of a thousand cells


@pytest.mark.compiled
@pytest.mark.parametrize(
    "place",
    [pytest.param(i, id=one.name, marks=_slow(one.name)) for i, one in enumerate(OTHERS.scenarios)],
)
def test_every_alternative_plays(place: int) -> None:
    study = tiny(OTHERS, place)
    (scenario,) = study.scenarios
    runs = first_runs(study).runs
    assert set(runs["variant"]) == {made.name for made in scenario.variants}
    assert runs["episode"].max() == 11
    cells = summarise_sensitivity(study, runs).cells
    name, label = scenario.name.split(": ")
    assert {(cell.scenario, cell.alternative) for cell in cells} == {(scenario.title, label)}
    assert [cell.claim.id for cell in cells] == [c.id for c in SCENARIOS[name].comparisons]
    assert all(cell.claim.difference.n_pairs + cell.claim.difference.n_diverged == 1 for cell in cells)


def test_every_scenario_has_its_default_first_and_no_reading_twice() -> None:
    for scenario in MAIN.scenarios:
        names = [other.name for other in OTHERS.scenarios if other.name.startswith(f"{scenario.name}: ")]
        assert names == [f"{scenario.name}: {one}" for one in (DEFAULT, *(a.label for a in scenario.alternatives))]
        assert len(set(names)) == len(names)
        assert scenario.alternatives


def test_an_alternative_differs_from_the_default_in_what_it_says() -> None:
    made = {scenario.name: scenario for scenario in OTHERS.scenarios}
    for name, main in SCENARIOS.items():
        default = made[f"{name}: {DEFAULT}"]
        assert default.problem is main.problem
        assert default.algorithm == main.algorithm
        assert default.comparisons == main.comparisons
        for alternative in main.alternatives:
            other = made[f"{name}: {alternative.label}"]
            differs = [
                other.problem is not default.problem,
                other.algorithm.parameters != default.algorithm.parameters,
                other.algorithm.step != default.algorithm.step,
                {v.n_agents for v in other.variants} != {v.n_agents for v in default.variants},
            ]
            # To bootstrap from a failure, the learner must, and the failure must have a row with something in it.
            expected = 2 if alternative.label == "bootstrap at failure" else 1
            assert sum(differs) == expected, other.name


@pytest.mark.parametrize("study", [OTHERS, SMALL], ids=["alternatives", "ablation"])
def test_names_of_variants_follow_the_contract(study: Study) -> None:
    for scenario in study.scenarios:
        for made in scenario.variants:
            if made.name != f"{scenario.algorithm.base}-slow":
                assert made == variant(scenario.algorithm, made.name)


@pytest.mark.compiled
@pytest.mark.parametrize("study", [OTHERS, SMALL], ids=["alternatives", "ablation"])
def test_pairs_share_their_seeds_with_the_main_study(study: Study) -> None:
    main = {scenario.name: scenario for scenario in MAIN.scenarios}
    assert study.seed == MAIN.seed
    for scenario in study.scenarios:
        own = study.run_seed(scenario, 0, 4)
        assert own.spawn_key == MAIN.run_seed(main[scenario.name.split(": ")[0]], 0, 4).spawn_key
    place = next(p for p, s in enumerate(study.scenarios) if s.name.split(": ")[0] == "dyna-maze")
    here, there = (first_runs(one).runs for one in (tiny(study, place, 3), tiny(MAIN, 1, 3)))
    both = sorted(set(here["variant"]) & set(there["variant"]))
    assert {"dyna-h", "dyna-ht-1", "constant-1"} <= set(both)
    for name in both:
        rows = [runs.filter(pl.col("variant") == name).drop("scenario") for runs in (here, there)]
        assert rows[0].equals(rows[1]), name


@pytest.mark.compiled
@pytest.mark.parametrize("place", range(3), ids=lambda place: SMALL.scenarios[place].name)
def test_every_step_plays(place: int) -> None:
    study = tiny(SMALL, place)
    (ablation,) = ablations(study, first_runs(study).runs)
    assert [one.variant for one in ablation.steps] == [v.name for v in study.scenarios[0].variants[1:]]
    assert all(one.difference.n_pairs == 1 for one in ablation.steps)


STEPS = {
    "dyna-h": 100,
    "constant-1": 80,
    "permuted-1": 120,
    "dyna-ht-1": 60,
    "dyna-ht-3-max": 30,
    "dyna-h-slow": 75,
}


def runs_of(steps: dict[str, int]) -> pl.DataFrame:
    """Every episode of a variant's runs takes its steps, and run r as many times r + 1."""
    rows = [
        {"scenario": "dyna-maze", "variant": name, "instance": 0, "run": run, "agent": 0, "episode": 0}
        | {"steps": number * (run + 1), "diverged": name == "dyna-ht-3-max" and run == 2}
        for name, number in steps.items()
        for run in range(3)
    ]
    return pl.DataFrame(rows)


def test_steps_are_differences_to_the_base_and_to_the_step_before() -> None:
    study = Study((SMALL.scenarios[1],), 0)
    (ablation,) = ablations(study, runs_of(STEPS))
    found = {one.variant: one for one in ablation.steps}
    expected = {  # over the base, the step before, over that
        "constant-1": (0.2, "dyna-h", 0.2),
        "permuted-1": (-0.2, "constant-1", -0.5),
        "dyna-ht-1": (0.4, "permuted-1", 0.5),
        "dyna-ht-3-max": (0.7, "dyna-ht-1", 0.5),
        "dyna-h-slow": (0.25, "dyna-h", 0.25),
    }
    for name, (difference, before, added) in expected.items():
        assert found[name].before == before
        assert found[name].difference.mean == pytest.approx(difference)
        assert found[name].added.mean == pytest.approx(added)
    assert (found["dyna-ht-3-max"].added.n_pairs, found["dyna-ht-3-max"].added.n_diverged) == (2, 1)
    unplayed = found["dyna-ht-3-mean"]
    assert np.isnan(unplayed.difference.mean)
    assert unplayed.before == "dyna-ht-1"


def test_the_slow_base_learns_at_the_rate_of_the_constant_control() -> None:
    for scenario in SMALL.scenarios:
        base, slow = scenario.variants[0], scenario.variants[-1]
        assert slow.tensor_step is None
        assert slow.parameters == {
            **base.parameters,
            "alpha": base.parameters["alpha"] / np.sqrt(scenario.algorithm.n_actions),
        }


def test_studies_stay_small() -> None:
    large = scenario_study()
    for small in (ablation_study(large), sensitivity_study(large)):
        assert max(scenario.n_instances for scenario in small.scenarios) == 3
        assert max(scenario.n_runs for scenario in small.scenarios) == 20
    one = replace(large.scenarios[1], n_runs=2, n_instances=1)
    for small in (ablation_study(Study((one,), 0)), sensitivity_study(Study((one,), 0))):
        assert {(s.n_instances, s.n_runs) for s in small.scenarios} == {(1, 2)}


def test_the_time_of_all_alternatives_is_estimated_by_the_longest_where_a_variant_is_new() -> None:
    names = [variant.name for variant in OTHERS.scenarios[0].variants]
    main = OTHERS.scenarios[0].name.split(": ")[0]
    study = Study((OTHERS.scenarios[0].resized(n_runs=3, n_instances=1),) * 2, 0)
    times = [(main, names[0], 1.0), (main, names[0], 3.0), (main, "another", 5.0), ("elsewhere", names[0], 99.0)]
    table = pl.DataFrame(times, ["scenario", "variant", "seconds"], orient="row")
    assert estimated_seconds(study, table, workers=4) == 2 * 3 * (2.0 + 5.0 * (len(names) - 1)) / 4
