"""What `tuckerl train` finds in its folder is believed only after it was checked."""

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest

import tuckerl
from tests.cli.moody_world import ID, Mood
from tests.cli.test_train import LEARNED, status_of
from tuckerl.studies import training, training_config
from tuckerl.studies.folder_lock import FolderLock

LAKE = ["train", "q-learning", "FrozenLake-v1", "--set", "alpha=0.2", "--episodes", "40", "--evaluate", "0", "--out"]
WITH_STEP = ["train", "tq-learning", *LAKE[2:]]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    Mood.left, Mood.act = -1, None


def contents(folder: str) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def change_run(folder: str, **entries: object) -> None:
    path = Path(folder) / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))


def test_a_folder_in_use_is_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(*LAKE, "lake") == 0
    before = contents("lake")
    lock = FolderLock(Path("lake"))
    capsys.readouterr()
    for more in ([], ["--overwrite"], ["--resume"]):
        assert status_of(*LAKE, "lake", *more) == 2
        assert "tuckerl: lake is in use by process" in capsys.readouterr().err
    lock.release()
    assert contents("lake") == before
    assert status_of(*LAKE, "lake") == 0


def test_a_folder_is_free_again_after_training_and_after_an_error() -> None:
    assert status_of(*LAKE, "lake") == 0
    assert status_of(*LAKE, "lake", "--seed", "1") == 2
    FolderLock(Path("lake")).release()
    assert sorted(contents("lake")) == LEARNED


def test_a_folder_that_another_training_made_just_now_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    build = training_config.build_learner

    def meanwhile(*arguments: Any) -> Any:
        Path("lake").mkdir()
        Path("lake/run.json").write_text("{}")
        Path("lake/agent.tuckerl").write_text("of another")
        return build(*arguments)

    monkeypatch.setattr(training, "build_learner", meanwhile)
    assert status_of(*LAKE, "lake") == 2
    assert "lake was made by another tuckerl train just now" in capsys.readouterr().err
    assert Path("lake/agent.tuckerl").read_text() == "of another"


def test_the_end_is_believed_only_with_an_agent_that_has_come_to_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(*LAKE, "whole", "--checkpoint", "10") == 0
    shutil.copytree("whole", "lake")
    early_file = Path("early.tuckerl")
    tuckerl.QLearning("FrozenLake-v1", alpha=0.2, seed=0).learn(20).save(early_file)
    shutil.copy(early_file, "lake/agent.tuckerl")
    change_run("lake", saved=None)  # as an older version wrote it, or by hand
    assert status_of(*LAKE, "lake") == 0
    assert contents("lake") == contents("whole")
    digests = {"agent.tuckerl": digest(early_file), "history.parquet": digest(Path("lake/history.parquet"))}
    shutil.copy(early_file, "lake/agent.tuckerl")
    change_run("lake", saved=digests)
    assert status_of(*LAKE, "lake") == 0
    assert contents("lake") == contents("whole")
    Path("lake/agent.tuckerl").unlink()
    assert status_of(*LAKE, "lake") == 0
    assert contents("lake") == contents("whole")
    assert "Nothing to do" not in capsys.readouterr().out


def test_an_agent_file_that_the_training_did_not_write_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(*LAKE, "whole") == 0
    shutil.copytree("whole", "lake")
    tuckerl.QLearning("FrozenLake-v1", alpha=0.2, seed=0).learn(20).save("lake/agent.tuckerl")
    before = contents("lake")
    capsys.readouterr()
    assert status_of(*LAKE, "lake") == 2
    said = capsys.readouterr().err
    assert said.startswith("tuckerl: lake/agent.tuckerl is not the file that the training wrote")
    assert "go on from this one with --resume, or begin anew with --overwrite" in said
    assert contents("lake") == before
    assert status_of(*LAKE, "lake", "--resume") == 0
    assert contents("lake") == contents("whole")


@pytest.mark.parametrize(
    ("other", "difference"),
    [
        (lambda: tuckerl.QLearning("FrozenLake-v1", alpha=0.3, seed=0), "alpha is 0.3 in agent.tuckerl and 0.2 in run"),
        (lambda: tuckerl.QLearning("FrozenLake-v1", alpha=0.2, seed=1), "seed is 1 in agent.tuckerl and 0 in run.json"),
        (lambda: tuckerl.Sarsa("FrozenLake-v1", alpha=0.2, seed=0), 'learner is "Sarsa" in agent.tuckerl and "QLear'),
        (lambda: _with_step(), "tensor_step is true in agent.tuckerl and false in run.json"),
        (lambda: _stepped(), 'played is "gymnasium" in agent.tuckerl and "table" in run.json'),
    ],
)
@pytest.mark.parametrize("more", [[], ["--resume"]])
def test_an_agent_of_another_training_is_refused(
    other: Callable[[], Any], difference: str, more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert status_of(*LAKE, "lake") == 0
    other().learn(10).save("lake/agent.tuckerl")
    change_run("lake", finished=False, saved=None)
    before = contents("lake")
    assert status_of(*LAKE, "lake", *more) == 2
    assert difference in capsys.readouterr().err
    assert contents("lake") == before
    assert status_of(*LAKE, "lake", "--overwrite") == 0


def _with_step() -> Any:
    step = tuckerl.TensorStep(every=10, ranks=(15, 3, 9, 1))
    return tuckerl.QLearning("FrozenLake-v1", alpha=0.2, seed=0, tensor_step=step)


def _stepped() -> Any:
    return tuckerl.QLearning("FrozenLake-v1", alpha=0.2, seed=0, compiled=False)


@pytest.mark.parametrize("spoil", [Path.unlink, lambda path: path.write_bytes(b"other")])
def test_a_history_that_is_not_the_agents_is_written_anew(spoil: Callable[[Path], Any]) -> None:
    assert status_of(*WITH_STEP, "lake") == 0
    before = contents("lake")
    spoil(Path("lake/history.parquet"))
    assert status_of(*WITH_STEP, "lake") == 0
    assert contents("lake") == before


def test_what_a_killed_training_left_half_written_is_deleted() -> None:
    assert status_of(*LAKE, "whole") == 0
    Path("lake").mkdir()
    shutil.copy("whole/run.json", "lake")
    change_run("lake", finished=False, saved=None)
    for name in LEARNED:
        (Path("lake") / f".{name}.x1y2z3").write_text("hal")
    assert status_of(*LAKE, "lake") == 0
    assert contents("lake") == contents("whole")


@pytest.mark.parametrize("at", [1, 2, 3, 4, 5, 6, 7])
def test_after_a_full_disk_the_same_command_goes_on_to_the_same_bits(
    at: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status_of(*WITH_STEP, "whole", "--checkpoint", "10") == 0
    left, fsync = [at], os.fsync

    def full(descriptor: int) -> None:
        left[0] -= 1
        if left[0] <= 0:
            raise OSError(28, "No space left on device")
        fsync(descriptor)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        capsys.readouterr()
        assert status_of(*WITH_STEP, "lake", "--checkpoint", "10") == 2
    assert re.search(r"^tuckerl: cannot write lake/.*: No space left on device; make room there$", *said(capsys))
    assert set(contents("lake")) <= set(LEARNED), "nothing half-written"
    assert status_of(*WITH_STEP, "lake") == 0
    assert contents("lake") == contents("whole")


def said(capsys: pytest.CaptureFixture[str]) -> tuple[str, re.RegexFlag]:
    return capsys.readouterr().err, re.MULTILINE


def test_a_goal_below_what_the_folder_holds_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    few = ["train", "q-learning", "FrozenLake-v1", "--evaluate", "0", "--out", "lake"]
    assert status_of(*few, "--episodes", "25") == 0
    assert status_of(*few, "--episodes", "24", "--resume") == 2
    assert "lake holds 25 episodes, more than the 24 asked for" in capsys.readouterr().err
    steps = pl.read_parquet("lake/history.parquet")["steps"]
    most, before = int(steps.sum()), int(steps[:-1].sum())
    assert status_of(*few, "--steps", str(before), "--resume") == 2
    assert f"lake holds {most} steps, an episode more than the {before} asked for" in capsys.readouterr().err
    assert status_of(*few, "--steps", str(before + 1), "--resume") == 0  # where so many steps end
    assert pl.read_parquet("lake/history.parquet").height == 25


def test_agents_that_an_error_left_behind_catch_up_though_the_steps_are_done() -> None:
    def fail() -> None:
        raise ConnectionError("lost")

    wanted = ["train", "sarsa", f"tests.cli.moody_world:{ID}", "--agents", "2", "--steps", "100", "--evaluate", "0"]
    assert status_of(*wanted, "--out", "whole") == 0
    Mood.left, Mood.act = 140, fail
    assert status_of(*wanted, "--out", "agent") == 2
    behind = tuckerl.load("agent/agent.tuckerl")
    assert behind.first_agent_steps >= 100
    assert not behind.history.in_sync
    assert status_of(*wanted, "--out", "agent") == 0
    ours, theirs = (pl.read_parquet(f"{folder}/history.parquet") for folder in ("agent", "whole"))
    assert ours.height == theirs.height


def test_one_number_of_quantile_bins_is_for_every_dimension() -> None:
    wanted = ["train", "sarsa", "CartPole-v1", "--episodes", "3", "--evaluate", "0", "--quantile-bins", "3"]
    assert status_of(*wanted, "--out", "pole") == 0
    assert tuckerl.load("pole/agent.tuckerl", env="CartPole-v1").problem.n_states == 3**4
