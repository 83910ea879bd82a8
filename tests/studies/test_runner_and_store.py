import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from tests.studies.played import first_runs
from tuckerl import DynaH, sutton_maze
from tuckerl.errors import (
    DamagedResultsWarning,
    FailedRunsWarning,
    OutputConflictError,
    OutputError,
    ParameterError,
)
from tuckerl.problems.mdp import TabularMDP
from tuckerl.studies import checkpoints, reproduce
from tuckerl.studies.executed_code import changes
from tuckerl.studies.parts import Parts
from tuckerl.studies.playing import play_run
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import Run, all_runs, run_code
from tuckerl.studies.store import Store
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.study_folder import kept_runs
from tuckerl.studies.tables import ROWS
from tuckerl.studies.workers import Played

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


def test_paths_are_all_episodes_of_the_pictured_run(study: Study, tmp_path: Path) -> None:
    tables = run_study(study, tmp_path, workers=1)
    assert set(tables.paths["variant"]) == {"dyna-h", "dyna-ht-1", "dyna-ht-3"}
    for (variant, agent), paths in tables.paths.group_by("variant", "agent"):
        steps = tables.runs.filter(variant=variant, agent=agent, instance=0, run=0).sort("episode")["steps"]
        assert paths.group_by("episode").len().sort("episode")["len"].to_list() == [one + 1 for one in steps]
        for _, path in paths.group_by("episode"):
            assert path.sort("step")["state"][[0, -1]].to_list() == [18, 8]  # Sutton's start and goal


@pytest.mark.slow
def test_workers_do_not_change_a_bit(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path / "one", workers=1)
    run_study(study, tmp_path / "two", workers=2)
    for name in FILES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_another_seed_gives_other_runs(study: Study, tmp_path: Path) -> None:
    one = run_study(study, tmp_path / "one", workers=1).runs
    other = run_study(replace(study, seed=4), tmp_path / "other", workers=1).runs
    assert not one["steps"].equals(other["steps"])


def test_an_interrupt_keeps_what_is_finished_and_the_rest_follows(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce, "_SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr(reproduce, "_WRITES_SHARE", 1.0)

    def interrupt(runs: RunProgress) -> None:
        assert runs.n_total == 20
        if runs.n_done >= 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "halting", workers=1, progress=interrupt)
    with Store(tmp_path / "halting", study) as store:
        finished = store.finished()
        assert {Run("dyna-maze", variant.name, 0, 0) for variant in study.scenarios[0].variants} <= finished
        assert len(finished) < 20
    seen: list[int] = []
    run_study(study, tmp_path / "halting", workers=1, progress=lambda runs: seen.append(runs.n_done))
    assert seen[0] == len(finished)
    assert seen[-1] == 20
    run_study(study, tmp_path / "straight", workers=1)
    for name in FILES:
        assert (tmp_path / "halting" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_finished_results_are_not_run_again(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    before = {name: (tmp_path / name).stat().st_mtime_ns for name in FILES}
    parts = sorted(tmp_path.glob("parts/*"))
    run_study(study, tmp_path, workers=1)
    assert before == {name: (tmp_path / name).stat().st_mtime_ns for name in FILES}
    assert sorted(tmp_path.glob("parts/*")) == parts


def played(study: Study, folder: Path, *, overwrite: bool = False) -> list[Run]:
    """Run a study, and return which of its runs were not there before."""
    with Store(folder, study, overwrite=overwrite) as store:
        missing = store.missing()
    run_study(study, folder, workers=1, overwrite=overwrite)
    return missing


def test_a_study_grows_and_shrinks_and_nothing_is_played_twice(study: Study, tmp_path: Path) -> None:
    (scenario,) = study.scenarios
    small = replace(scenario, n_instances=1, n_runs=1, variants=scenario.variants[:2])
    assert len(played(Study((small,), 3), tmp_path)) == 2
    assert played(Study((replace(small, n_runs=2),), 3), tmp_path) == [
        Run("dyna-maze", variant.name, 0, 1) for variant in small.variants
    ]
    more = replace(small, n_runs=2, variants=scenario.variants[:3])
    assert {run.variant for run in played(Study((more,), 3), tmp_path)} == {scenario.variants[2].name}
    other = replace(small, name="another", number=2**40)
    assert {run.scenario for run in played(Study((other, more), 3), tmp_path)} == {"another"}
    before = pl.read_parquet(tmp_path / "runs.parquet").filter(scenario="dyna-maze", run=0)
    for smaller, message in (
        ((small,), r"scenarios.another is there and not in this one"),
        ((small, other), r"scenarios.dyna-maze.runs is 2 there and 1 now"),
        (
            (replace(more, variants=more.variants[1:]), other),
            r"scenarios.dyna-maze.variants.dyna-h is there and not in",
        ),
    ):
        with pytest.raises(OutputConflictError, match=message):
            Store(tmp_path, Study(smaller, 3))
    assert played(Study((small,), 3), tmp_path, overwrite=True) == [], "what it no longer has stays in parts"
    only = [variant.name for variant in small.variants]
    assert pl.read_parquet(tmp_path / "runs.parquet").equals(before.filter(pl.col("variant").is_in(only)))
    assert played(Study((more, other), 3), tmp_path) == []
    run_study(Study((more, other), 3), tmp_path / "straight", workers=1)
    for name in FILES:
        assert (tmp_path / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_the_same_run_under_two_names_is_played_once(study: Study, tmp_path: Path) -> None:
    scenario = replace(study.scenarios[0], n_instances=1, n_runs=1, record_paths_of=())
    twice = replace(scenario, variants=(scenario.variants[0], replace(scenario.variants[0], name="again")))
    assert len(played(Study((twice,), 3), tmp_path)) == 1
    runs = pl.read_parquet(tmp_path / "runs.parquet")
    one, other = (runs.filter(variant=name).drop("variant") for name in ("dyna-h", "again"))
    assert one.height == 20
    assert one.equals(other)


def test_results_of_another_study_are_refused_and_the_difference_named(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    with pytest.raises(OutputConflictError, match=r"seed is 3 there and 4 now.*--overwrite"):
        Store(tmp_path, replace(study, seed=4))
    shorter = replace(study, scenarios=(study.scenarios[0].resized(n_episodes=7),))
    with pytest.raises(OutputConflictError, match=r"scenarios.dyna-maze.episodes is 20 there and 7 now"):
        Store(tmp_path, shorter)
    first = study.scenarios[0].variants[0]
    changed = replace(first, parameters={**first.parameters, "alpha": 0.5})
    other = replace(study, scenarios=(replace(study.scenarios[0], variants=(changed,)),))
    with pytest.raises(OutputConflictError, match=r"variants.dyna-h.parameters.alpha is 0.1 there and 0.5 now"):
        Store(tmp_path, other)
    with Store(tmp_path, shorter, overwrite=True) as store:
        assert store.finished() == set()
    assert not (tmp_path / "runs.parquet").exists()
    assert len(played(study, tmp_path, overwrite=True)) == 0, "what was finished is never lost"


def test_overwrite_still_reuses_the_same_study(study: Study, tmp_path: Path) -> None:
    run_study(study, tmp_path, workers=1)
    with Store(tmp_path, study, overwrite=True) as store:
        assert len(store.finished()) == 20


def test_runs_of_other_code_are_neither_mixed_nor_played_again_unasked(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = Study((replace(study.scenarios[0], n_instances=1, n_runs=1, variants=study.scenarios[0].variants[:2]),), 3)
    real = run_code

    def of_then(scenario: Scenario, variant: Variant) -> dict[str, str]:
        return real(scenario, variant) | {"numpy": "1.0", "tuckerl.learners.dyna_h": "0"}

    with monkeypatch.context() as then:
        then.setattr("tuckerl.studies.store.run_code", of_then)
        run_study(small, tmp_path, workers=1)
    with pytest.raises(
        OutputConflictError,
        match=r"2 of the study's runs as other code has played them \(numpy 1.0 there and .* now; changed code of "
        r"tuckerl.learners.dyna_h\): keep them with --accept-code, or play them again with --overwrite",
    ):
        run_study(small, tmp_path, workers=1)
    with Store(tmp_path, small, accept_code=True) as kept:
        assert len(kept.finished()) == 2
    with pytest.raises(ParameterError, match="give one of the two"):
        Store(tmp_path, small, accept_code=True, overwrite=True)
    run_study(small, tmp_path, workers=1, overwrite=True)
    with Store(tmp_path, small) as again:
        assert len(again.finished()) == 2, "played again by today's code"
    with monkeypatch.context() as then:
        then.setattr("tuckerl.studies.store.run_code", of_then)
        with Store(tmp_path, small) as old:
            assert len(old.finished()) == 2, "and what the other code has played is still there"


def test_an_edit_elsewhere_leaves_finished_runs_as_they_are(study: Study) -> None:
    code = run_code(study.scenarios[0], study.scenarios[0].variants[0])
    assert {"tuckerl.learners.dyna_h", "tuckerl.training.loop", "tuckerl.studies.playing", "numpy"} <= set(code)
    assert not [name for name in code if name.startswith(("tuckerl.reports", "tuckerl.cli"))]
    assert "tuckerl.learners.team_q" not in code
    assert "tuckerl.studies.workers" not in code
    assert not changes(code, code)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]", b"{}"])
def test_an_unreadable_specification_is_refused(study: Study, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "study.json").write_bytes(content)
    with pytest.raises(OutputConflictError, match=r"study\.json is not one that tuckerl writes"):
        Store(tmp_path, study)


def test_results_of_an_older_version_are_refused(study: Study, tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text('{"format": 1, "seed": 3, "scenarios": {}}')
    with pytest.raises(OutputConflictError, match=r"in format 1 and not 2\).*--overwrite"):
        Store(tmp_path, study)


def test_results_without_a_specification_are_refused(study: Study, tmp_path: Path) -> None:
    (tmp_path / "runs.parquet").write_bytes(b"somebody's")
    with pytest.raises(OutputConflictError, match=r"runs.parquet without study.json"):
        Store(tmp_path, study)
    assert (tmp_path / "runs.parquet").read_bytes() == b"somebody's"


def tiny(study: Study, n_runs: int = 2) -> Study:
    scenario = study.scenarios[0]
    return Study((replace(scenario, n_instances=1, n_runs=n_runs, n_episodes=5, variants=scenario.variants[:2]),), 3)


def one_by_one(study: Study, folder: Path) -> None:
    """Store each run in a part of its own."""
    with Store(folder, study) as store:
        for run in store.missing():
            store.add([Played(run, play_run(study, run))])


@pytest.mark.parametrize("damage", ["a bit", "cut short", "empty", "another's name", "gone"])
def test_what_is_damaged_is_set_aside_and_played_again(study: Study, tmp_path: Path, damage: str) -> None:
    small = tiny(study)
    one_by_one(small, tmp_path / "damaged")
    run_study(small, tmp_path / "straight", workers=1)
    first, second, *_ = sorted((tmp_path / "damaged" / "parts").iterdir())
    content = bytearray(first.read_bytes())
    content[len(content) // 3] ^= 64
    if damage == "gone":
        first.unlink()
    else:
        whole = {"a bit": bytes(content), "cut short": bytes(content[:100]), "empty": b""}
        first.write_bytes(whole.get(damage, second.read_bytes()))
    if damage == "gone":
        run_study(small, tmp_path / "damaged", workers=1)
    else:
        what = f"has what {second.name} has, and" if damage == "another's name" else "is damaged and"
        with pytest.warns(
            DamagedResultsWarning, match=rf"{what} was set aside as .*\.damaged: the runs .* played again"
        ):
            run_study(small, tmp_path / "damaged", workers=1)
        assert len(list((tmp_path / "damaged" / "parts").glob("*.damaged"))) == 1
    for name in FILES:
        assert (tmp_path / "damaged" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_a_copy_of_a_part_is_set_aside_and_nothing_is_played(study: Study, tmp_path: Path) -> None:
    small = tiny(study)
    run_study(small, tmp_path, workers=1)
    part, *_ = (tmp_path / "parts").iterdir()
    part.with_stem("copy").write_bytes(part.read_bytes())
    with pytest.warns(
        DamagedResultsWarning, match=rf"copy.part has what {part.name} has, .* as copy.damaged: nothing is"
    ):
        Store(tmp_path, small).close()
    with Store(tmp_path, small) as store:
        assert not store.missing()


REFUSED = (PermissionError(13, "Permission denied"), OSError(30, "Read-only file system"))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.DamagedResultsWarning")
@pytest.mark.parametrize("error", REFUSED)
@pytest.mark.parametrize("what", ["replace", "unlink", "read_bytes"])
def test_a_folder_that_refuses_is_said_in_a_sentence(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, what: str
) -> None:
    small = tiny(study)
    one_by_one(small, tmp_path)
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "checkpoints" / ".left").touch()
    part, *_ = (tmp_path / "parts").iterdir()
    part.write_bytes(b"damaged")
    real = getattr(Path, what)

    def refused(path: Path, *arguments: Any, **keywords: Any) -> Any:
        if path.parent.name in ("parts", "checkpoints"):
            raise error
        return real(path, *arguments, **keywords)

    monkeypatch.setattr(Path, what, refused)
    with pytest.raises(OutputError, match=f"{error.strerror}.*; choose another"):
        run_study(small, tmp_path, workers=1)


def test_runs_of_another_processor_are_of_other_code_and_those_of_old_folders_are_kept(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small, real = tiny(study, n_runs=1), run_code

    def code_of(scenario: Scenario, variant: Variant, blas: str | None = None) -> dict[str, str]:
        own = real(scenario, variant) | {"BLAS": blas or ""}
        return own if blas else {name: value for name, value in own.items() if name != "BLAS"}

    for blas, folder in ((None, "old"), ("openblas for Z80", "other")):
        with monkeypatch.context() as then:
            then.setattr("tuckerl.studies.store.run_code", partial(code_of, blas=blas))
            run_study(small, tmp_path / folder, workers=1)
    with Store(tmp_path / "old", small) as store:
        assert not store.missing()
    with pytest.raises(
        OutputConflictError, match=r"other code .*\(BLAS openblas for Z80 there and .* now\): keep them"
    ):
        Store(tmp_path / "other", small)
    with Store(tmp_path / "other", small, accept_code=True) as store:
        assert not store.missing()


def test_tables_that_were_changed_are_made_anew(study: Study, tmp_path: Path) -> None:
    small = tiny(study)
    run_study(small, tmp_path, workers=1)
    whole = (tmp_path / "runs.parquet").read_bytes()
    for wrong in (whole[:-1], whole + b"0", None):
        if wrong is None:
            (tmp_path / "runs.parquet").unlink()
        else:
            (tmp_path / "runs.parquet").write_bytes(wrong)
        run_study(small, tmp_path, workers=1)
        assert (tmp_path / "runs.parquet").read_bytes() == whole


def test_many_small_parts_become_one(study: Study, tmp_path: Path) -> None:
    small = tiny(study, n_runs=20)
    one_by_one(small, tmp_path / "many")
    assert len(list((tmp_path / "many" / "parts").iterdir())) == 40
    run_study(small, tmp_path / "many", workers=1)
    assert len(list((tmp_path / "many" / "parts").iterdir())) == 1
    with Store(tmp_path / "many", small) as store:
        assert store.missing() == []
    run_study(small, tmp_path / "straight", workers=1)
    for name in FILES:
        assert (tmp_path / "many" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


@pytest.mark.parametrize("moment", ["_open", "_tables"])
def test_a_folder_is_looked_at_while_its_parts_become_one(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    small = tiny(study)
    one_by_one(small, tmp_path)
    real, is_first = getattr(Parts, moment), True

    def late(self: Parts, part: Any) -> Any:
        nonlocal is_first
        if is_first:  # a writer is quicker
            is_first = False
            with monkeypatch.context() as other:
                other.setattr("tuckerl.studies.parts._MANY", 2)
                with Store(tmp_path, small) as store:
                    store.write_tables()
        return real(self, part)

    monkeypatch.setattr(Parts, moment, late)
    kept = kept_runs(small, tmp_path)
    assert len(list((tmp_path / "parts").iterdir())) == 1
    assert kept.tables.runs.n_unique(["variant", "run"]) == 4


def test_a_folder_that_cannot_be_looked_into_is_said(study: Study, tmp_path: Path) -> None:
    (tmp_path / "parts" / "of a folder.part").mkdir(parents=True)
    with pytest.raises(OutputError, match="cannot read "):
        kept_runs(tiny(study), tmp_path)


def test_a_column_that_older_code_did_not_write_is_null(study: Study, tmp_path: Path) -> None:
    run = all_runs(tiny(study))[0]
    tables = play_run(tiny(study), run)
    with Store(tmp_path, tiny(study)) as store:
        store.add([Played(run, tables._replace(times=tables.times.drop("regret")))])
        assert store.tables.times["regret"].to_list() == [None]
        assert store.tables.times["agents"].to_list() == [1]


def test_a_folder_is_one_process_at_a_time(study: Study, tmp_path: Path) -> None:
    with Store(tmp_path, study), pytest.raises(OutputConflictError, match="is in use by process"):
        Store(tmp_path, study)
    Store(tmp_path, study).close()


def failing_problem(instance: int, failing: int) -> Any:
    if instance == failing:
        raise ZeroDivisionError("no such maze")
    return sutton_maze()


@pytest.mark.parametrize("failing", [0, 1])  # the first instance is also what kernels are compiled with
def test_a_run_that_fails_is_recorded_and_the_study_goes_on(study: Study, tmp_path: Path, failing: int) -> None:
    scenario = replace(study.scenarios[0], n_runs=1, n_episodes=5, variants=study.scenarios[0].variants[:2])
    broken = Study((replace(scenario, problem=partial(failing_problem, failing=failing)),), 3)
    for _ in range(2):
        with pytest.warns(
            FailedRunsWarning, match=r"2 runs ended with an error .* ZeroDivisionError: no such maze; the"
        ):
            tables = run_study(broken, tmp_path, workers=1)
        assert set(tables.runs["instance"]) == {1 - failing}
        assert len(list((tmp_path / "failures").iterdir())) == 2
        assert all("Traceback" in path.read_text() for path in (tmp_path / "failures").iterdir())
    with Store(tmp_path, Study((scenario,), 3), accept_code=True) as store:
        assert len(store.failures()) == 2
    run_study(Study((scenario,), 3), tmp_path, workers=1, accept_code=True)
    assert not list((tmp_path / "failures").iterdir())


def test_a_long_run_goes_on_from_its_checkpoint(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = tiny(study)
    run = all_runs(small)[-1]  # of no recorded paths
    whole = play_run(small, run)
    monkeypatch.setattr(checkpoints, "SECONDS_BETWEEN", 0.0)
    learn, n = DynaH.learn, 0

    def learn_twice(self: DynaH, **given: Any) -> DynaH:
        nonlocal n
        n += 1
        if n == 2:
            raise KeyboardInterrupt
        return learn(self, **given)

    path = tmp_path / "run.tuckerl"
    with monkeypatch.context() as broken:
        broken.setattr(DynaH, "learn", learn_twice)
        with pytest.raises(KeyboardInterrupt):
            play_run(small, run, path)
    assert path.exists()
    again = play_run(small, run, path)
    assert again.runs.equals(whole.runs)
    assert again.weights.equals(whole.weights)
    assert again.times["seconds"][0] > 0
    for damaged in ("[6]", "6", '[6, "", 1]', "[6, 1, 2, 3]"):
        path.with_suffix(".json").write_text(damaged)
        assert play_run(small, run, path).runs.equals(whole.runs)
    path.write_bytes(b"cut short")
    assert play_run(small, run, path).runs.equals(whole.runs)


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
    tables = play_run(Study((wild,), 0), Run(wild.name, "dyna-h", 0, 0))
    runs = tables.runs
    assert runs.height == 20
    assert runs["diverged"].any()
    first = int(runs["diverged"].arg_max() or 0)
    assert runs["steps"][:first].null_count() == 0
    assert runs["steps"][first:].null_count() == runs["return"][first:].null_count() == 20 - first
    assert runs["diverged"][first:].all()
    assert dict(runs.schema) == ROWS["runs"]


def test_overwriting_leaves_nothing_of_the_other_study(study: Study, tmp_path: Path) -> None:
    run_study(tiny(study), tmp_path, workers=1)
    (tmp_path / "figures").mkdir()
    names = ("claims.json", "compare.json", "comparisons.json", "tune.json", "report.html", "figures/fig11.svg")
    shown = [tmp_path / name for name in names]
    for path in shown:
        path.write_text("of the other study")
    Store(tmp_path, replace(study, seed=4), overwrite=True).close()
    assert not any(path.exists() for path in shown)


def test_a_folder_in_the_way_of_a_file_is_said(study: Study, tmp_path: Path) -> None:
    (tmp_path / "runs.parquet").mkdir()
    with pytest.raises(OutputError, match="cannot use the folder"):
        Store(tmp_path, study, overwrite=True)
    assert not (tmp_path / ".lock").exists()


WARMED = """
import pathlib, sys
from dataclasses import replace
from tests.studies.comparisons import small_comparison
from tuckerl.studies.playing import play_run, warm_up
from tuckerl.studies.runs import all_runs

made = small_comparison("sarsa", "tsarsa-lambda").study
compiled = lambda: {path.name for path in pathlib.Path(sys.argv[1]).rglob("tensor*/*.nbi")}
warm_up(made)
before = compiled()
for run in all_runs(made):
    play_run(made, run)
assert before, "kernels are kept where they were looked for"
assert compiled() == before, sorted(compiled() - before)
"""


@pytest.mark.long
def test_no_run_pays_for_compiling_the_decomposition(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", WARMED, str(tmp_path)], cwd=root, env=environment, check=True)


def test_times_hold_the_steps_part(study: Study) -> None:
    times = first_runs(study).times
    plain = times.filter(pl.col("variant").is_in(["dyna-h"]))
    assert plain["tensor_step_seconds"].to_list() == [0.0]
    stepped = times.filter(pl.col("variant").str.starts_with("dyna-ht"))
    assert (stepped["tensor_step_seconds"] > 0).all()
    assert (stepped["tensor_step_seconds"] < stepped["seconds"]).all()
