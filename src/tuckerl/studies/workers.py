"""Runs are played by worker processes with one BLAS thread each, or in this process, so that all bits agree.

A *task* is one run number of one instance, played by those variants of its scenario that are missing: from the same
seed, one after the other. Nobody is left behind: workers end with the process that started them, and at once where it
is interrupted.
"""

import itertools
import multiprocessing
import os
import signal
import threading
import traceback
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import scipy.linalg  # noqa: F401  # its BLAS must be loaded before it can be limited
from threadpoolctl import threadpool_limits

from tuckerl.errors import WorkerError
from tuckerl.studies.playing import play_run, warm_up
from tuckerl.studies.runs import Run
from tuckerl.studies.study import Study
from tuckerl.studies.tables import StudyTables

_WAITING = 2  # tasks for each worker that are handed out, so that none waits for the next


class Task(NamedTuple):
    """Runs that one worker plays one after the other, each with where it may keep what it has."""

    runs: tuple[Run, ...]
    checkpoints: tuple[Path | None, ...]


class Played(NamedTuple):
    """What came of a run: its tables, or the traceback of the error that ended it."""

    run: Run
    tables: StudyTables | None
    error: str = ""


def tasks_of(runs: Iterable[Run], checkpoints: dict[Run, Path] | None = None) -> list[Task]:
    """Return tasks for all of the runs: those of one number and instance together, numbers in order."""
    kept = checkpoints or {}
    ordered = sorted(runs, key=lambda run: (run.run, run.instance, run.scenario))
    groups = itertools.groupby(ordered, key=lambda run: (run.run, run.instance, run.scenario))
    return [Task(own := tuple(group), tuple(map(kept.get, own))) for _, group in groups]


def play_tasks(study: Study, tasks: Sequence[Task], workers: int) -> Generator[list[Played], None, None]:
    """Play the tasks and yield what came of each one's runs as it ends, in any order.

    Kernels are compiled here first, so that workers find them ready.
    """
    if not tasks:
        return
    with threadpool_limits(1):
        warm_up(study)
        if workers == 1:
            for task in tasks:
                yield play_task(study, task)
            return
    waiting, has_played = deque(tasks), False
    while waiting:
        suspects: list[Task] = []
        for played in _play_in_pool(study, waiting, workers, suspects):
            has_played = True
            yield played
        for task in suspects:  # each alone, so that only the one to blame dies again
            dead: list[Task] = []
            for played in _play_in_pool(study, deque([task]), 1, dead):
                has_played = True
                yield played
            if dead and not has_played:
                raise WorkerError(_NONE_STARTS)
            if dead:
                yield [Played(run, None, _DIED) for run in task.runs]


_NONE_STARTS = (
    "the worker processes ended before any of them had played a run: ask for one worker, to see why; in a program of "
    'your own, start the study below `if __name__ == "__main__":`, as each worker imports it'
)
_DIED = (
    "The process that played this run died, twice: it was killed, or left no memory. Give it fewer workers, or a "
    "smaller problem.\n"
)


def play_task(study: Study, task: Task) -> list[Played]:
    """Return what comes of a task's runs, played in this process."""
    played = []
    for run, checkpoint in zip(task.runs, task.checkpoints, strict=True):
        try:
            played.append(Played(run, play_run(study, run, checkpoint)))
        except Exception:  # noqa: BLE001  # one run's error is its own; the study goes on
            played.append(Played(run, None, traceback.format_exc()))
    return played


def _play_in_pool(
    study: Study, waiting: deque[Task], workers: int, suspects: list[Task]
) -> Generator[list[Played], None, None]:
    """Play tasks, taken from `waiting`, until none is left or a worker dies: `suspects` are those in play then."""
    playing: dict[Future[list[Played]], Task] = {}
    with _pool(study, min(workers, len(waiting))) as pool:
        try:
            while waiting or playing:
                with _interrupts_ignored():  # by workers that start here: Ctrl-C is this process's business
                    while waiting and len(playing) < _WAITING * workers:
                        playing[pool.submit(_work, waiting[0])] = waiting[0]
                        waiting.popleft()
                done, _ = wait(playing, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
                    del playing[future]
        except BrokenProcessPool:
            suspects += playing.values()


@contextmanager
def _pool(study: Study, workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool of workers, which are killed if the block is left by an error or an interrupt."""
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _start_worker, (study,))
    try:
        yield pool
    except BaseException:
        for worker in set(multiprocessing.active_children()) - others:
            worker.kill()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    pool.shutdown()


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C here and in every process that is started meanwhile, for as long as that process lives."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread hears signals, and only it may say what becomes of them
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_study: Study | None = None  # of this worker process


def _start_worker(study: Study) -> None:
    global _study
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _study = study
    threadpool_limits(1)
    warm_up(study)  # or the first variant of the first task would pay for loading the kernels


def _end_with_parent() -> None:
    """End this worker when the process that started it has ended, however that was: nobody waits for its tasks."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(task: Task) -> list[Played]:
    if _study is None:
        raise RuntimeError("a worker was asked to work before it was started")
    return play_task(_study, task)
