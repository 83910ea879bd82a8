"""Whoever asks a command for its end is heard as Ctrl-C is."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.cli.moody_world import ID, Mood
from tests.cli.test_train import status_of
from tests.studies.study_texts import LAKE
from tuckerl import cli
from tuckerl.cli.signals import endings_are_interrupts
from tuckerl.reports.inspect import file
from tuckerl.studies import reproduce, study_folder, training, tuning_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has other signals")

TRAIN = ["train", "sarsa", f"tests.cli.moody_world:{ID}", "--episodes", "20", "--evaluate", "0", "--out", "agent"]
ENDINGS = ["SIGTERM", "SIGHUP"]


@pytest.fixture(autouse=True)
def _as_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    numbers = [signal.SIGINT, *(getattr(signal, name) for name in ENDINGS)]
    before = [signal.getsignal(number) for number in numbers]
    yield
    Mood.left, Mood.act = -1, None
    for number, handler in zip(numbers, before, strict=True):
        signal.signal(number, handler)


@pytest.mark.parametrize("name", ENDINGS)
def test_training_is_ended_in_order(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    ending = getattr(signal, name)
    before = signal.getsignal(ending)
    Mood.left, Mood.act = 60, lambda: signal.raise_signal(ending)
    assert status_of(*TRAIN) == 130
    assert "interrupted: what is finished is kept" in capsys.readouterr().err
    assert Path("agent/agent.tuckerl").exists()
    assert signal.getsignal(ending) == before
    assert status_of(*TRAIN) == 0


def test_the_handler_of_ctrl_c_is_told_what_was_running() -> None:
    seen: list[object] = []
    signal.signal(signal.SIGINT, lambda number, frame: seen.append((number, frame and frame.f_code.co_name)))
    with endings_are_interrupts():
        signal.raise_signal(signal.SIGTERM)
    assert seen == [(signal.SIGINT, "test_the_handler_of_ctrl_c_is_told_what_was_running")]


@pytest.mark.parametrize("command", [name for name in cli.COMMANDS if name not in ("list", "watch")])
def test_all_long_commands_hear_them(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def terminated(*arguments: Any, **options: Any) -> None:
        signal.raise_signal(signal.SIGTERM)

    for module, name in (
        (file, "inspect_file"),
        (reproduce, "play_study"),
        (study_folder, "run_study"),
        (tuning_folder, "play_study"),
        (training, "load_learner"),
        (training, "build_learner"),
    ):
        monkeypatch.setattr(module, name, terminated)
    Path("agent.tuckerl").write_text("")
    Path("study.toml").write_text(LAKE)
    arguments = {
        "train": TRAIN[1:],
        "evaluate": ["agent.tuckerl"],
        "show": ["agent.tuckerl"],
        "compare": ["sarsa", "q-learning", "--env", "FrozenLake-v1", "--out", "compared"],
        "reproduce": ["dyna-maze", "--quick", "--out", "results"],
        "study": ["run", "study.toml"],
        "tune": ["q-learning", "FrozenLake-v1", "--out", "tuned"],
    }
    assert status_of(command, *arguments[command]) == 130


def test_an_ignored_ctrl_c_stays_ignored_and_an_end_that_is_asked_for_is_heard() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a shell does where it puts a command into the background
    Mood.left, Mood.act = 60, lambda: signal.raise_signal(signal.SIGINT)
    assert status_of(*TRAIN) == 0
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    went_on: list[bool] = []

    def terminated() -> None:
        signal.raise_signal(signal.SIGTERM)
        went_on.append(True)  # it waits for the end of the episode, as Ctrl-C does

    Mood.left, Mood.act = 60, terminated
    assert status_of(*TRAIN, "--overwrite") == 130
    assert went_on
    assert Path("agent/agent.tuckerl").exists()


@pytest.mark.parametrize("name", ENDINGS)
def test_an_ignored_ending_stays_ignored(name: str) -> None:
    ending = getattr(signal, name)
    signal.signal(ending, signal.SIG_IGN)  # as nohup does
    Mood.left, Mood.act = 60, lambda: signal.raise_signal(ending)
    assert status_of(*TRAIN) == 0


def test_an_end_is_heard_while_ctrl_c_is_ignored_for_a_moment() -> None:
    def ended() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # as worker processes start
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt), endings_are_interrupts():
        ended()


def test_the_library_leaves_them_alone() -> None:
    code = (
        "import signal\n"
        "import tuckerl, tuckerl.cli\n"
        "seen = []\n"
        "look = lambda learner: seen.append(signal.getsignal(signal.SIGTERM))\n"
        "tuckerl.Sarsa('FrozenLake-v1', seed=0).learn(1000, callbacks=[look])\n"
        "assert set(seen) == {signal.SIG_DFL}\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
