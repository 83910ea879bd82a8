"""The paper's experiments are study files: what they say, and that any study of them plays the same runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tuckerl.adapters.resolve import as_problem
from tuckerl.errors import UnknownNameError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.reports.study import Study as UsersStudy
from tuckerl.studies.planned import FILES, file_of
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.scenarios import SCENARIOS, scenario_study
from tuckerl.studies.study import Study
from tuckerl.studies.study_file import parse_study_file
from tuckerl.studies.study_making import study_of
from tuckerl.studies.variants import NamedEnvironment


def made(name: str) -> Study:
    return study_of(parse_study_file(file_of(name), f"{name}.toml"))


@pytest.mark.parametrize("name", FILES)
def test_a_file_asks_for_what_the_scenario_has(name: str) -> None:
    (scenario,), known = made(name).scenarios, SCENARIOS[name]
    assert scenario.environment
    assert scenario.specification() == {"environment": scenario.environment, **known.specification()}
    assert (scenario.number, scenario.measure) == (known.number, known.measure)
    assert scenario.comparisons == tuple(replace(one, control_base="") for one in known.comparisons)


def runs_of(study: Study, folder: Path, numbers: tuple[int, int, int]) -> pl.DataFrame:
    small = replace(study, scenarios=tuple(one.resized(*numbers) for one in study.scenarios))
    return run_study(small, folder, workers=1).runs


@pytest.mark.parametrize("name", FILES)
def test_the_runs_of_a_file_are_those_of_reproduce(name: str, tmp_path: Path) -> None:
    numbers = (min(2, SCENARIOS[name].n_instances), 1, 11)  # a window, and an episode with its weights
    expected = runs_of(scenario_study(name), tmp_path / "reproduced", numbers)
    assert expected.height > 0
    assert runs_of(made(name), tmp_path / "study", numbers).equals(expected)
    for table in ("runs", "weights"):  # to the last bit
        files = [tmp_path / folder / f"{table}.parquet" for folder in ("reproduced", "study")]
        assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_the_runs_of_a_file_are_those_of_a_quick_reproduce(name: str, tmp_path: Path) -> None:
    quick = scenario_study(name, quick=True).scenarios[0]
    numbers = quick.n_instances, quick.n_runs, quick.n_episodes
    expected = runs_of(scenario_study(name), tmp_path / "reproduced", numbers)
    assert runs_of(made(name), tmp_path / "study", numbers).equals(expected)


def test_no_other_file_comes_with_the_package() -> None:
    with pytest.raises(UnknownNameError, match="unknown scenario 'maze': did you mean 'dyna-maze'"):
        file_of("maze")


def test_instances_are_counted_and_told(tmp_path: Path) -> None:
    text = file_of("dyna-maze").replace("runs = 25", "runs = 1").replace("episodes = 100", "episodes = 2")
    study = UsersStudy.from_text(text.replace("instances = 10", "instances = 3"))
    assert study.n_runs == 3 * 7
    runs = study.run(tmp_path, workers=1).runs
    assert sorted(runs["instance"].unique()) == [0, 1, 2]
    assert runs.filter(pl.col("episode") == 0).group_by("instance").agg(pl.col("steps").sum())["steps"].n_unique() == 3
    status = study.status(tmp_path)
    assert (status.n_finished, status.n_runs) == (21, 21)
    assert {one.n_runs for one in status.variants} == {3}
    assert "instance" in pl.read_csv(study.export(tmp_path)).columns


def test_instances_have_another_identity_than_one_problem() -> None:
    one, several = NamedEnvironment("tuckerl/DynaMaze-v0", {}), NamedEnvironment("tuckerl/DynaMaze-v0", {}, "maze_seed")
    assert one.specification != several.specification
    fourth, fifth = (as_problem(several.problem(instance)) for instance in (4, 5))
    assert isinstance(fourth, TabularMDP)
    assert isinstance(fifth, TabularMDP)
    assert not np.array_equal(fourth.arrays.next_state, fifth.arrays.next_state)
