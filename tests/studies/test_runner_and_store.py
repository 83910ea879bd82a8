import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tuckerl.errors import OutputConflictError, OutputError, ParameterError, SavedFileError
from tuckerl.files import write_whole
from tuckerl.problems.mdp import TabularMDP
from tuckerl.studies import store
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.runner import SCHEMAS, Task, all_tasks, play_task
from tuckerl.studies.store import Store
from tuckerl.studies.study import Study

pytestmark = pytest.mark.compiled  # most run a whole study

FILES = ("runs.parquet", "weights.parquet", "paths.parquet")


def test_rows_and_columns_are_those_of_the_contract(study: Study, tmp_path: Path) -> None:
    runs = run_study(study, tmp_path, workers=1).runs
    assert runs.columns == ["scenario", "variant", "instance", "run", "agent", "episode", "steps", "return", "diverged"]
    agents = 1 + 1 + 3 + 1 + 3
    assert runs.height == 2 * 2 * 20 * agents
    assert runs.equals(pl.read_parquet(tmp_path / "runs.parquet"))
    assert not runs["diverged"].any()
    assert (runs["return"] == 1 - runs["steps"]).all()  # -1 a step, 0 into the goal
    assert runs["variant"].unique(maintain_order=True).to_list() == [v.name for v in study.scenarios[0].variants]


def test_a_run_is_what_the_learner_alone_does(study: Study, tmp_path: Path) -> None:
    runs = run_study(study, tmp_path, workers=1).runs
    scenario = study.scenarios[0]
    made = scenario.variants[2]
    learner = made.make(scenario.problem(1), np.random.SeedSequence(3, spawn_key=(1, 1, 0))).learn(episodes=20)
    chosen = runs.filter(variant=made.name, instance=1, run=0).sort("agent", "episode")
    assert np.array_equal(chosen["steps"].to_numpy().reshape(3, 20), learner.steps.T)


def test_paths_are_the_shortest_episodes_of_the_pictured_run(study: Study, tmp_path: Path) -> None:
    tables = run_study(study, tmp_path, workers=1)
    assert set(tables.paths["variant"]) == {"dyna-h", "dyna-ht-1", "dyna-ht-3"}
    for (variant, agent), path in tables.paths.group_by("variant", "agent"):
        steps = tables.runs.filter(variant=variant, agent=agent, instance=0, run=0)["steps"]
        assert path.height - 1 == steps.min()
        assert path.sort("step")["state"][[0, -1]].to_list() == [18, 8]  # Sutton's start and goal


def test_workers_do_not_change_a_bit(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path / "one", workers=1)
    run_study(study, tmp_path / "two", workers=2)
    for name in FILES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_another_seed_gives_other_runs(study: Study, tmp_path: Path) -> None:
    one = run_study(study, tmp_path / "one", workers=1).runs
    other = run_study(replace(study, seed=4), tmp_path / "other", workers=1).runs
    assert not one["steps"].equals(other["steps"])


def test_an_interrupt_keeps_what_is_finished_and_the_rest_follows(study: Study, tmp_path: Path) -> None:
    def interrupt(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "halting", workers=1, progress=interrupt)
    assert Store(tmp_path / "halting", study).finished() == {Task(0, 0, 0), Task(0, 0, 1)}
    seen: list[int] = []
    run_study(study, tmp_path / "halting", workers=1, progress=lambda done, total: seen.append(done))
    assert seen == [2, 3, 4]
    run_study(study, tmp_path / "straight", workers=1)
    for name in FILES:
        assert (tmp_path / "halting" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_a_kill_between_two_files_costs_only_that_task(study: Study, tmp_path: Path) -> None:
    store = Store(tmp_path, study)
    first, second = all_tasks(study)[:2]
    store.add([play_task(study, first)])
    before = (tmp_path / "runs.parquet").read_bytes()
    store.add([play_task(study, second)])
    (tmp_path / "runs.parquet").write_bytes(before)  # as if killed before runs.parquet was renamed
    again = Store(tmp_path, study)
    assert again.finished() == {first}
    again.add([play_task(study, second)])
    assert again.tables.weights.equals(store.tables.weights)


def test_finished_results_are_not_run_again(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    before = {name: (tmp_path / name).stat().st_mtime_ns for name in FILES}
    run_study(study, tmp_path, workers=1)
    assert before == {name: (tmp_path / name).stat().st_mtime_ns for name in FILES}


def test_results_of_another_study_are_refused_and_the_difference_named(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    with pytest.raises(OutputConflictError, match=r"seed is 3 there and 4 now.*--overwrite"):
        Store(tmp_path, replace(study, seed=4))
    shorter = replace(study, scenarios=(study.scenarios[0].resized(n_episodes=7),))
    with pytest.raises(OutputConflictError, match=r"scenarios.dyna-maze.episodes is 20 there and 7 now"):
        Store(tmp_path, shorter)
    other = replace(study, scenarios=(replace(study.scenarios[0], name="robot-rescue"),))
    with pytest.raises(OutputConflictError, match=r"\(scenarios.robot-rescue is not there and in this one\)"):
        Store(tmp_path, other)
    assert Store(tmp_path, shorter, overwrite=True).finished() == set()
    assert not (tmp_path / "runs.parquet").exists()


def test_overwrite_still_reuses_the_same_study(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    assert len(Store(tmp_path, study, overwrite=True).finished()) == 4


def test_other_code_is_another_study(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    held = json.loads((tmp_path / "study.json").read_text())
    held["versions"]["numpy"] = "1.0"
    (tmp_path / "study.json").write_text(json.dumps(held))
    with pytest.raises(OutputConflictError, match=r'versions.numpy is "1.0" there'):
        Store(tmp_path, study)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe"])
def test_an_unreadable_specification_is_refused(study: Study, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "study.json").write_bytes(content)
    with pytest.raises(OutputConflictError, match="cannot be read"):
        Store(tmp_path, study)


def test_results_without_a_specification_are_refused(study: Study, tmp_path: Path) -> None:
    (tmp_path / "runs.parquet").write_bytes(b"somebody's")
    with pytest.raises(OutputConflictError, match=r"runs.parquet without study.json"):
        Store(tmp_path, study)
    assert (tmp_path / "runs.parquet").read_bytes() == b"somebody's"


def test_damaged_results_are_said(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    for name in ("runs", "times"):
        path = tmp_path / f"{name}.parquet"
        whole = path.read_bytes()
        flipped = bytearray(whole)
        flipped[len(whole) // 3] ^= 64  # which Parquet itself does not notice, perhaps
        for damaged in (whole[: len(whole) // 2], bytes(flipped)):
            path.write_bytes(damaged)
            with pytest.raises(SavedFileError, match=rf"{name}.parquet is damaged: .*--overwrite"):
                Store(tmp_path, study)
        path.write_bytes(whole)
    assert len(Store(tmp_path, study).finished()) == 4


def test_tables_without_their_digests_are_not_believed(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    for content in (b"", b"[]", b"{}", b'{"runs": 3}'):
        (tmp_path / "digests.json").write_bytes(content)
        with pytest.raises(SavedFileError, match="is damaged"):
            Store(tmp_path, study)
    Store(tmp_path, study, overwrite=True)
    assert not (tmp_path / "digests.json").exists()


def test_a_folder_that_cannot_be_made_is_said(study: Study, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot make the folder .*--out"):
        Store(tmp_path / "file" / "results", study)


def test_a_folder_that_cannot_be_written_is_said(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**arguments: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "mkstemp", refuse)  # permissions do not bind root, who may run the tests
    with pytest.raises(OutputError, match=r"cannot write .*study.json: Permission denied; choose a folder"):
        Store(tmp_path, study)


def test_no_workers_are_refused(study: Study, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="workers must be a whole number of at least 1; got 0"):
        run_study(study, tmp_path, workers=0)


def wild_problem(instance: int) -> TabularMDP:
    return TabularMDP([[0, 1], [1, 0]], [[1e308] * 2] * 2, [[False] * 2] * 2, max_episode_steps=5, heuristic=[0.0, 1.0])


def test_a_diverged_run_keeps_its_rows(study: Study) -> None:
    scenario = study.scenarios[0]
    # A heuristic cannot make it diverge; rewards near the largest float do.
    wild = replace(scenario, problem=wild_problem, variants=scenario.variants[:1])
    tables = play_task(Study((wild,), 0), Task(0, 0, 0))
    runs = tables.runs
    assert runs.height == 20
    assert runs["diverged"].any()
    first = int(runs["diverged"].arg_max() or 0)
    assert runs["steps"][:first].null_count() == 0
    assert runs["steps"][first:].null_count() == runs["return"][first:].null_count() == 20 - first
    assert runs["diverged"][first:].all()
    assert dict(runs.schema) == SCHEMAS["runs"]


def test_overwriting_leaves_nothing_of_the_other_study(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    (tmp_path / "figures").mkdir()
    shown = [tmp_path / name for name in ("claims.json", "compare.json", "report.html", "figures/fig11.svg")]
    for path in shown:
        path.write_text("of the other study")
    Store(tmp_path, replace(study, seed=4), overwrite=True)
    assert not any(path.exists() for path in shown)


def test_damaged_results_can_be_overwritten(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    (tmp_path / "runs.parquet").write_bytes(b"cut short")
    assert Store(tmp_path, study, overwrite=True).finished() == set()


def test_a_folder_in_the_way_of_a_file_is_said(study: Study, tmp_path: Path) -> None:
    (tmp_path / "runs.parquet").mkdir()
    with pytest.raises(OutputError, match="cannot use the folder"):
        Store(tmp_path, study, overwrite=True)


def test_times_hold_the_steps_part(study: Study) -> None:
    times = play_task(study, Task(0, 0, 0)).times
    plain = times.filter(pl.col("variant").is_in(["dyna-h"]))
    assert plain["tensor_step_seconds"].to_list() == [0.0]
    stepped = times.filter(pl.col("variant").str.starts_with("dyna-ht"))
    assert (stepped["tensor_step_seconds"] > 0).all()
    assert (stepped["tensor_step_seconds"] < stepped["seconds"]).all()


def test_runs_are_written_after_all_that_belongs_to_them(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []

    def write(path: Path, data: bytes) -> None:
        written.append(path.name)
        write_whole(path, data)

    monkeypatch.setattr(store, "write_whole", write)
    run_study(study, tmp_path, workers=1)
    tables = [name for name in written if name.endswith(".parquet")]
    assert len(tables) >= 4
    for i, name in enumerate(tables):  # a kill after any of these leaves no task that is said to be finished and is not
        assert (name == "runs.parquet") == (i % 4 == 3)
