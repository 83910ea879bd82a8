"""Workers end with the process that started them, and at once where Ctrl-C is pressed again."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tuckerl import sutton_maze
from tuckerl.errors import WorkerError
from tuckerl.studies import workers
from tuckerl.studies.runs import all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.workers import play_tasks, tasks_of

ROOT = Path(__file__).parents[2]


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="a process cannot send another one Ctrl-C there")
@pytest.mark.parametrize("signals", [[signal.SIGKILL], [signal.SIGINT, signal.SIGINT]] if os.name != "nt" else [])
def test_no_worker_outlives_its_parent(signals: list[signal.Signals]) -> None:
    command = [sys.executable, "-m", "tests.studies.endless_study"]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    ) as process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline() == "playing\n"
            for one in signals:
                process.send_signal(one)
                time.sleep(0.5)
            process.communicate(timeout=20)  # until no process has its output open any more
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode != 0


class Deadly:
    """A problem whose instance 1 ends the process that plays it."""

    def __call__(self, instance: int) -> Any:
        if instance == 1 and multiprocessing.parent_process() is not None:
            os._exit(3)
        return sutton_maze()


def test_a_run_whose_worker_dies_is_recorded_and_the_others_are_played(study: Study) -> None:
    scenario = replace(study.scenarios[0], problem=Deadly(), n_episodes=2, variants=study.scenarios[0].variants[:1])
    dying = Study((scenario,), 3)
    played = [one for task in play_tasks(dying, tasks_of(all_runs(dying)), 2) for one in task]
    assert len(played) == 4
    for one in played:
        assert (one.tables is None) == (one.run.instance == 1)
        assert ("died, twice" in one.error) == (one.run.instance == 1)


def test_workers_that_do_not_start_are_said(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "_start_worker", os._exit)  # which is given the study, and fails
    with pytest.raises(WorkerError, match="before any of them had played a run"):
        list(play_tasks(study, tasks_of(all_runs(study)), 2))


class _Worker:
    killed = False

    def kill(self) -> None:
        self.killed = True


class _Impatient:
    """A pool that is interrupted at once."""

    def __init__(self, *given: Any) -> None: ...

    def submit(self, *task: Any) -> Any:
        raise KeyboardInterrupt

    def shutdown(self, **how: Any) -> None:
        assert how == {"wait": False, "cancel_futures": True}


def test_an_interrupt_kills_the_workers_and_nobody_else(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    others, own = _Worker(), [_Worker(), _Worker()]
    children = iter([[others], [others, *own]])
    monkeypatch.setattr(workers, "ProcessPoolExecutor", _Impatient)
    monkeypatch.setattr(workers, "warm_up", lambda study: None)
    monkeypatch.setattr(multiprocessing, "active_children", lambda: next(children))
    with pytest.raises(KeyboardInterrupt):
        list(play_tasks(study, tasks_of(all_runs(study)), 2))
    assert [worker.killed for worker in (others, *own)] == [False, True, True]
