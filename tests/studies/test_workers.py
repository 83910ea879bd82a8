"""Workers end with the process that started them, and at once where Ctrl-C is pressed again."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections import deque
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from tuckerl import sutton_maze
from tuckerl.errors import WorkerError
from tuckerl.studies import processes, worker_process
from tuckerl.studies.processes import Processes
from tuckerl.studies.runs import all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.workers import Played, tasks_of

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


def played_by(workers: Processes, study: Study) -> list[Played]:
    return [one for piece in workers.play(study, tasks_of(all_runs(study))) for one in piece]


@pytest.mark.slow
@pytest.mark.compiled  # workers load kernels
def test_a_run_whose_worker_dies_is_recorded_and_the_others_are_played_also_of_the_next_study(study: Study) -> None:
    scenario = replace(study.scenarios[0], problem=Deadly(), n_episodes=2, variants=study.scenarios[0].variants[:1])
    dying = Study((scenario,), 3)
    with Processes(2) as workers:
        first = played_by(workers, dying)
        own = {worker._process.pid for worker in workers._workers}
        living = Study((replace(scenario, n_instances=1, n_runs=3),), 3)
        second = played_by(workers, living)
        assert own < {worker._process.pid for worker in workers._workers}, "and one for the one that died last"
    assert {one.run for one in first} == set(all_runs(dying))
    for one in first:
        assert (one.tables is None) == (one.run.instance == 1)
        assert ("died, twice" in one.error) == (one.run.instance == 1)
    assert {one.run for one in second if one.tables is not None} == set(all_runs(living))
    assert not multiprocessing.active_children()


def test_workers_that_do_not_start_are_said(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_process, "_work", os._exit)  # which is given a connection, and fails
    with Processes(2) as workers, pytest.raises(WorkerError, match="before any of them could play a run"):
        played_by(workers, study)


def leave_a_child(folder: Path, connection: object) -> None:
    """End at once, but not what was started."""
    if child := os.fork():
        (folder / "child").write_text(str(child))
        os._exit(3)
    time.sleep(20)
    (folder / "ended").touch()
    os._exit(0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks there")
def test_a_dead_worker_is_noticed_while_what_it_started_lives(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_process, "_work", partial(leave_a_child, tmp_path))
    monkeypatch.setattr(processes, "warm_up", lambda study: None)
    playing = processes._Playing([], 1, study, tasks_of(all_runs(study)))
    with pytest.raises(WorkerError):
        list(playing.results())
    os.kill(int((tmp_path / "child").read_text()), signal.SIGKILL)
    assert not (tmp_path / "ended").exists()


def test_a_worker_that_died_between_studies_stops_nobody(study: Study, told: type["Told"]) -> None:
    told.seconds = dict.fromkeys((variant.name for variant in study.scenarios[0].variants), 0.1)
    with Processes(2) as workers:
        played_by(workers, study)
        told.made[0].is_dead = True
        (task, *_) = tasks_of(all_runs(study))
        assert [one.run for piece in workers.play(study, [task]) for one in piece] == [task.run]


def test_a_study_that_cannot_be_sent_is_said(study: Study) -> None:
    scenario = replace(
        study.scenarios[0], problem=lambda instance: sutton_maze(), variants=study.scenarios[0].variants[:1]
    )
    with Processes(2) as workers, pytest.raises(WorkerError, match=r"cannot be sent to worker processes .* one worker"):
        played_by(workers, Study((scenario,), 3))


class Told:
    """A worker in this process, that says of each piece what `seconds` say when it is asked."""

    seconds: ClassVar[dict[str, float]] = {}
    made: ClassVar[list["Told"]] = []

    def __init__(self) -> None:
        self.handles, self.is_ready, self.is_ended, self.is_dead = (self,), False, False, False
        self.given: deque[tuple[Any, ...]] = deque()
        self.said: list[list[str]] = []
        self.made.append(self)

    def prepare(self, study: bytes) -> None:
        self.is_ready = False

    def give(self, piece: tuple[Any, ...]) -> None:
        self.given.append(piece)
        self.said.append([task.run.variant for task in piece])

    def heard(self) -> list[Played] | None:
        if self.is_dead:
            return None
        if not self.is_ready:
            self.is_ready = True
            return []
        tables = {
            task.run: SimpleNamespace(times={"seconds": [self.seconds[task.run.variant]]}) for task in self.given[0]
        }
        self.given.popleft()
        return [Played(run, one) for run, one in tables.items()]  # type: ignore[arg-type]  # enough of tables

    def end(self) -> None:
        self.is_ended = True


def speaking(workers: list[Told]) -> list[Told]:
    return [worker for worker in workers if worker.given or not worker.is_ready]


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> type[Told]:
    monkeypatch.setattr(processes, "WorkerProcess", Told)
    monkeypatch.setattr(processes, "prepare_workers", lambda: None)
    monkeypatch.setattr(processes, "warm_up", lambda study: None)
    monkeypatch.setattr(multiprocessing.connection, "wait", speaking)
    monkeypatch.setattr(Told, "made", [])
    return Told


def test_short_runs_are_sent_together_and_the_last_ones_alone_the_longest_first(study: Study, told: type[Told]) -> None:
    told.seconds = {"dyna-h": 0.001, "dyna-ht-1": 0.002, "dyna-ht-3": 0.05, "constant-1": 0.003, "constant-3-max": 0.02}
    large = Study((replace(study.scenarios[0], n_runs=20),), 3)
    with Processes(2) as workers:
        played = played_by(workers, large)
    assert len(played) == len({one.run for one in played}) == 200
    pieces = [piece for worker in told.made for piece in worker.said]
    assert 5 <= max(map(len, pieces)) < 30, "about a tenth of a second, as soon as it is known how long runs take"
    last = [worker.said[-1] for worker in told.made]
    assert all(len(piece) == 1 for piece in last)
    assert max(told.seconds[piece[0]] for piece in last) <= 0.003, (
        "the longest of the last ones have been played before"
    )
    assert [worker.is_ended for worker in told.made] == [True, True]


def test_no_worker_keeps_a_long_run_waiting(study: Study, told: type[Told], monkeypatch: pytest.MonkeyPatch) -> None:
    told.seconds = dict.fromkeys((variant.name for variant in study.scenarios[0].variants), 60.0)
    most = []

    class Counting(told):  # type: ignore[misc, valid-type]
        def give(self, piece: tuple[Any, ...]) -> None:
            super().give(piece)
            most.append(len(self.given))

    monkeypatch.setattr(processes, "WorkerProcess", Counting)
    with Processes(2) as workers:
        assert len(played_by(workers, study)) == 20
    assert set(most) == {1}


def test_an_interrupt_ends_the_workers_and_leaves_nothing_behind(study: Study, told: type[Told]) -> None:
    told.seconds = dict.fromkeys((variant.name for variant in study.scenarios[0].variants), 0.1)
    with Processes(2) as workers:
        playing = workers.play(study, tasks_of(all_runs(study)))
        next(playing)
        with pytest.raises(KeyboardInterrupt):
            playing.throw(KeyboardInterrupt)
        assert [worker.is_ended for worker in told.made] == [True, True]
        assert len(played_by(workers, study)) == 20, "and others take their place"
        assert len(told.made) == 4
