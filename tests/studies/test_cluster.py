"""A Dask cluster's workers die, join, and differ: what they play is the same bytes as here."""

import importlib
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from distributed import Client, LocalCluster

from tuckerl import sutton_maze
from tuckerl.errors import MissingExtraError, ParameterError, ParameterTypeError, WorkerError, WorkerWarning
from tuckerl.studies import cluster, cluster_worker
from tuckerl.studies.cluster import play_on_cluster
from tuckerl.studies.cluster_worker import play, prepare, sent
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.workers import Played, tasks_of

ONE_CORE_BYTES = ("runs", "weights", "paths")  # the table of times is another each time


@pytest.fixture(scope="module")
def processes() -> Iterator[Any]:
    """Two workers, each a process, in whose place another one joins when it is killed."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as made:
        yield made


@pytest.fixture
def threads() -> Iterator[Any]:
    """Two workers that are threads of this process, whose code a test can change."""
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=":0"
    ) as made:
        yield made


def with_problem(study: Study, problem: Any, n_runs: int = 2) -> Study:
    scenario = study.scenarios[0]
    return Study((replace(scenario, problem=problem, variants=scenario.variants[:1], n_runs=n_runs, n_episodes=2),), 3)


def played_by(made: Any, study: Study) -> list[Played]:
    tasks = play_on_cluster(study, tasks_of(all_runs(study)), made.scheduler_address)
    return [one for task in tasks for one in task]


@pytest.mark.slow
def test_results_are_the_same_bytes_while_workers_die_and_join(study: Study, tmp_path: Path, processes: Any) -> None:
    killed: list[int] = []

    def kill(runs: RunProgress) -> None:
        if runs.n_done and not killed:
            with Client(processes.scheduler_address, set_as_default=False) as client:
                killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    run_study(study, tmp_path / "cluster", cluster=processes.scheduler_address, progress=kill)
    run_study(study, tmp_path / "core", workers=1)
    assert killed
    for name in ONE_CORE_BYTES:
        there, here = (tmp_path / folder / f"{name}.parquet" for folder in ("cluster", "core"))
        assert there.read_bytes() == here.read_bytes()


class Deadly:
    """A problem whose instance 1 ends the process that plays it."""

    def __call__(self, instance: int) -> Any:
        if instance == 1 and multiprocessing.parent_process() is not None:
            os._exit(3)
        return sutton_maze()


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:the cluster has no workers")  # for a moment, as both have died
def test_a_run_that_kills_its_workers_is_recorded_and_the_others_are_played(study: Study, processes: Any) -> None:
    played = played_by(processes, with_problem(study, Deadly()))
    assert len(played) == 4
    for one in played:
        assert (one.tables is None) == (one.run.instance == 1)
        assert ("died, 3 times" in one.error) == (one.run.instance == 1)


class Faulty:
    """A problem of which instance 1 cannot be made."""

    def __call__(self, instance: int) -> Any:
        if instance == 1:
            raise ArithmeticError("no such maze")
        return sutton_maze()


def test_a_run_that_raises_is_recorded_and_few_tasks_are_given_at_once(study: Study, threads: Any) -> None:
    faulty = with_problem(study, Faulty(), n_runs=20)
    played, most = [], 0
    for task in play_on_cluster(faulty, tasks_of(all_runs(faulty)), threads.scheduler_address):
        most = max(most, len(threads.scheduler.tasks))
        played += task
    assert sorted(one.run for one in played) == sorted(all_runs(faulty))
    for one in played:
        assert (one.tables is None) == (one.run.instance == 1) == ("ArithmeticError: no such maze" in one.error)
    assert most <= 3 * 2 * 2  # given to two workers, come back, and about to be forgotten


def test_the_scheduler_forgets_what_is_broken_off_and_its_end_is_said(study: Study, threads: Any) -> None:
    small = with_problem(study, Faulty(), n_runs=200)
    tasks, address = tasks_of(all_runs(small)), threads.scheduler_address
    with closing(play_on_cluster(small, tasks, address)) as broken_off:
        next(broken_off)
    due = time.monotonic() + 10
    while threads.scheduler.tasks and time.monotonic() < due:  # what is just being played ends
        time.sleep(0.01)
    assert not threads.scheduler.tasks
    going_on = play_on_cluster(small, tasks, address)
    next(going_on)
    threads.close()
    with pytest.raises(WorkerError, match="scheduler has gone away: what is finished is kept; start it again"):
        list(going_on)


def test_workers_of_other_versions_are_refused_by_name(
    study: Study, threads: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = sent(study)
    monkeypatch.setattr(cluster, "sent", lambda study: here._replace(code=here.code | {"numpy": "9.9"}))
    with (
        pytest.raises(
            WorkerError, match=r"no worker .* can play this study; tcp://.*: on .*, numpy [\d.]+ there and 9"
        ),
        pytest.warns(WorkerWarning, match="is given no runs"),
    ):
        played_by(threads, study)


def test_one_that_differs_is_given_nothing_and_the_others_play(
    study: Study, threads: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone, original, prepared = threading.Lock(), cluster_worker._prepare, list[str]()

    def only_once(name: str, content: Any) -> str:
        with alone:
            prepared.append(name)
            return original(name, content) if len(prepared) == 1 else "it differs"

    monkeypatch.setattr(cluster_worker, "_prepare", only_once)
    small = with_problem(study, Faulty(), n_runs=40)
    with pytest.warns(WorkerWarning, match=r"worker tcp://.* is given no runs: on .*, it differs"):
        assert len(played_by(threads, small)) == 80


def test_workers_are_waited_for(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    small, told = with_problem(study, Faulty()), list[str]()
    with LocalCluster(n_workers=0, processes=False, protocol="tcp", dashboard_address=":0") as made:

        def join(words: str, category: type[Warning]) -> None:
            told.append(words)
            made.scale(1)

        monkeypatch.setattr(cluster, "warn", join)
        assert len(played_by(made, small)) == 4
    assert "has no workers: the study waits until some join" in told[0]
    if len(told) > 1:  # it has as many threads as this machine has cores
        assert "of which a study uses one: start them with `dask worker --nthreads 1" in told[1]


class NotThere:
    """A problem of a module that workers cannot import."""

    def __call__(self, instance: int) -> Any:
        return sutton_maze()

    def __reduce__(self) -> Any:
        return importlib.import_module, ("nowhere_to_be_found",)


def test_what_differs_is_said(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    here = sent(study)
    module = "tuckerl.learners.dyna_h"
    assert module in here.code
    assert "changed code of tuckerl.learners.dyna_h: bring" in prepare("", here._replace(code=here.code | {module: ""}))
    assert "python 3." in prepare("", here._replace(code=here.code | {"python": "2"}, study=b"unreadable"))
    assert "same OPENBLAS_CORETYPE" in prepare("", here._replace(code=here.code | {"BLAS": "an older processor"}))
    assert "nowhere_to_be_found" in prepare("", sent(with_problem(study, NotThere())))
    assert "PYTHONPATH" in prepare("", sent(with_problem(study, NotThere())))
    assert prepare("", here) == ""
    assert play("never prepared", ()) is None


@pytest.mark.parametrize("program", ["/bin/tuckerl", "/home/somebody/test_cluster.py", None])
def test_the_program_that_was_started_is_no_code_of_a_worker(
    study: Study, monkeypatch: pytest.MonkeyPatch, program: str | None
) -> None:
    monkeypatch.setattr(sys.modules["__main__"], "__file__", program, raising=False)
    here = sent(with_problem(study, Faulty()))
    assert {"tuckerl", "python", "numpy", "tuckerl.learners.dyna_h"} <= set(here.code)
    assert ("test_cluster.py" in here.code) == (program is None or not program.endswith("test_cluster.py"))


def test_what_cannot_be_sent_is_said(study: Study, threads: Any) -> None:
    locked: Any = threading.Lock()
    with pytest.raises(
        WorkerError, match=r"cannot be sent to workers .*lock.*: let its problem be a function or a class"
    ):
        played_by(threads, with_problem(study, lambda instance: locked))


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:{}", "host", "http://127.0.0.1:{}", "", "tcp://no.such.invalid:1"]
)
def test_a_cluster_that_does_not_answer_is_said(study: Study, address: str) -> None:
    with socket.socket() as bound:  # and not listening
        bound.bind(("127.0.0.1", 0))
        with pytest.raises(
            WorkerError, match=r"no Dask scheduler answers at .*: give the address that `dask scheduler`"
        ):
            list(play_on_cluster(study, tasks_of(all_runs(study)), address.format(bound.getsockname()[1])))


def test_who_plays_is_asked_once(study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ParameterError, match="give one of the two"):
        run_study(study, tmp_path, workers=1, cluster="tcp://127.0.0.1:1")
    with pytest.raises(ParameterTypeError, match="cluster must be text"):
        run_study(study, tmp_path, cluster=8786)  # type: ignore[arg-type]  # wrong on purpose
    assert list(play_on_cluster(study, [], "nowhere")) == []
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r'not installed: pip install "tuckerl\[cluster\]"'):
        run_study(study, tmp_path, cluster="tcp://127.0.0.1:1")
