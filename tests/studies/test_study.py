import json

import numpy as np
import pytest

from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.scenarios import scenario_study
from tuckerl.studies.study import variant


@pytest.mark.parametrize(
    ("name", "n_agents", "weights", "share"),
    [
        ("dyna-ht-1", 1, "paper", "max"),
        ("dyna-ht-3", 3, "paper", "max"),
        ("dyna-ht-3-min", 3, "paper", "min"),
        ("constant-1", 1, "constant", "none"),
        ("constant-3-max", 3, "constant", "max"),
        ("permuted-12-consensus", 12, "permuted", "consensus"),
        ("none-2", 2, "none", "none"),
    ],
)
def test_variant_names(name: str, n_agents: int, weights: str, share: str) -> None:
    made = variant(DYNA_MAZE.algorithm, name)
    assert made.tensor_step is not None
    assert (made.n_agents, made.tensor_step.weights, made.tensor_step.share) == (n_agents, weights, share)
    assert made.tensor_step.ranks == (15, 3, 9, 1)


def test_the_base_has_one_agent_and_no_step() -> None:
    base = variant(DYNA_MAZE.algorithm, "dyna-h")
    assert (base.n_agents, base.tensor_step) == (1, None)


@pytest.mark.parametrize("name", ["", "dyna-hx", "dyna-ht", "dyna-ht-0", "dyna-ht-3-most", "heavy-1", "dyna-h-3"])
def test_unknown_variants_are_refused(name: str) -> None:
    with pytest.raises(UnknownNameError, match="expected dyna-h, dyna-ht-<agents>"):
        variant(DYNA_MAZE.algorithm, name)


def test_the_papers_numbers() -> None:
    assert (DYNA_MAZE.n_instances, DYNA_MAZE.n_runs, DYNA_MAZE.n_episodes) == (10, 25, 100)
    assert [v.name for v in DYNA_MAZE.variants] == [
        "dyna-h",
        "dyna-ht-1",
        "dyna-ht-3",
        "constant-1",
        "constant-3-max",
        "permuted-1",
        "permuted-3-max",
    ]
    for made in DYNA_MAZE.variants:
        assert made.parameters == {"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "planning_steps": 10}


def test_seeds_pair_the_variants_and_do_not_depend_on_the_number_of_runs() -> None:
    study, larger = scenario_study("dyna-maze", runs=3, seed=7), scenario_study("dyna-maze", runs=9, seed=7)
    seed = study.run_seed(study.scenarios[0], 4, 2)
    assert (seed.entropy, seed.spawn_key) == (7, (1, 4, 2))
    assert np.array_equal(seed.generate_state(4), larger.run_seed(larger.scenarios[0], 4, 2).generate_state(4))


def test_quick_is_small_and_numbers_given_win() -> None:
    quick = scenario_study(quick=True, runs=3).scenarios[0]
    assert quick.n_runs == 3
    assert quick.n_instances < 10
    assert quick.n_episodes < 100


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"scenario": "dyna-mase"}, UnknownNameError, "did you mean 'dyna-maze'"),
        ({"runs": 0}, ParameterError, "runs must be a whole number of at least 1; got 0"),
        ({"episodes": -5}, ParameterError, "episodes must be a whole number of at least 1; got -5"),
        ({"seed": -1}, ParameterError, "seed"),
        ({"runs": 2.5}, ParameterTypeError, "runs must be a whole number"),
    ],
)
def test_bad_studies_are_refused(arguments: dict[str, object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        scenario_study(**arguments)  # type: ignore[arg-type]  # wrong on purpose


def test_the_specification_is_json_and_tells_studies_apart() -> None:
    texts = {
        json.dumps(scenario_study(**arguments).specification(), sort_keys=True)
        for arguments in ({}, {"runs": 3}, {"episodes": 3}, {"seed": 1}, {"quick": True})
    }
    assert len(texts) == 5
