"""Running a study into a folder, picking up where an earlier call stopped."""

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

from tuckerl.checks import check_int, check_text
from tuckerl.errors import FailedRunsWarning, ParameterError, warn
from tuckerl.progress import default_workers
from tuckerl.studies.cluster import play_on_cluster
from tuckerl.studies.processes import Processes
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import Run
from tuckerl.studies.store import Store
from tuckerl.studies.study import Study
from tuckerl.studies.tables import StudyTables
from tuckerl.studies.workers import Played, Task, tasks_of

_SECONDS_BETWEEN_WRITES = 0.5
_WRITES_SHARE = 0.05  # of the time, at most
_QUICKLY_WRITTEN = 1_000_000  # rows, within a second

Progress = Callable[[RunProgress], None]
"""Called when runs have been stored, twice a second at most, and before the first."""
Player = Callable[[Study, Sequence[Task]], Generator[list[Played], None, None]]


def run_study(
    study: Study,
    folder: Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    overwrite: bool = False,
    accept_code: bool = False,
    progress: Progress | None = None,
) -> StudyTables:
    """Play what is missing of a study in a folder and return all its tables.

    Parameters
    ----------
    study : Study
    folder : Path
    workers : int, optional
        Processes on this machine. Default: one for each core.
    cluster : str, optional
        The address of a Dask scheduler, whose workers play the runs instead.
    overwrite, accept_code, progress
        As of :func:`play_study`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a number is impossible, or both `workers` and `cluster` are given.
    MissingExtraError, WorkerError
        If the cluster cannot be used, or no worker lives.
    OutputError, OutputConflictError
        As of :func:`play_study`.
    """
    with player_of(workers, cluster) as player:
        return play_study(study, folder, player, overwrite=overwrite, accept_code=accept_code, progress=progress)


@contextmanager
def player_of(workers: int | None = None, cluster: str | None = None) -> Iterator[Player]:
    """Give who plays tasks, of as many studies as are asked for: this machine's processes, or a cluster's workers.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `workers` is impossible, or both are given.
    """
    if cluster is None:
        with Processes(default_workers() if workers is None else check_int("workers", workers, 1)) as processes:
            yield processes.play
    elif workers is not None:
        raise ParameterError("workers are processes on this machine, and a cluster has its own: give one of the two")
    else:
        yield partial(play_on_cluster, address=check_text("cluster", cluster))


def play_study(
    study: Study,
    folder: Path,
    player: Player,
    *,
    overwrite: bool = False,
    accept_code: bool = False,
    progress: Progress | None = None,
) -> StudyTables:
    """Let `player` play what is missing of a study in a folder and return all its tables.

    An interrupt, and a kill, keep every finished run: calling again goes on from there. A run that ends with an error
    is recorded with its traceback, in the folder ``failures``, and the study goes on.

    Parameters
    ----------
    study : Study
    folder : Path
    player : Player
    overwrite, accept_code : bool
        What to do with another study's results, and with runs that other code has played.
    progress : callable, optional

    Raises
    ------
    MissingExtraError, WorkerError
        If the cluster cannot be used, or no worker lives.
    OutputError, OutputConflictError
        If the folder cannot be written, is in use, or holds another study's results, or runs that other code has
        played, and neither `overwrite` nor `accept_code` says what to do with them.
    """
    with Store(folder, study, overwrite=overwrite, accept_code=accept_code) as store:
        missing = store.missing()
        tasks = tasks_of(missing, store.checkpoints(missing))
        try:
            _play(store, tasks, player, progress)
        except KeyboardInterrupt:
            if store.n_rows < _QUICKLY_WRITTEN:  # otherwise its end would have to be waited for
                store.write_tables()
            raise
        _tell_of(store.failures())
        return store.write_tables()


def _tell_of(failures: dict[Run, Path]) -> None:
    """Warn of runs that ended with an error."""
    if failures:
        run, path = next(iter(failures.items()))
        last = path.read_text("utf-8").strip().rpartition("\n")[2]
        warn(
            f"{len(failures)} runs ended with an error and are left out, such as {run.variant} in {run.scenario}, run "
            f"{run.run}: {last}; the tracebacks are in {path.parent}, and the same command plays them again",
            FailedRunsWarning,
        )


def _play(store: Store, tasks: list[Task], player: Player, progress: Progress | None) -> None:
    """Play the tasks, store what they leave, and say so when it is stored."""
    keep = _keeper(store, len(tasks), progress)
    waiting: list[Played] = []
    due = time.monotonic()
    try:
        with closing(player(store.study, tasks)) as played:
            for results in played:
                waiting += results
                begun = time.monotonic()
                if begun > due:
                    keep(waiting)
                    waiting = []
                    now = time.monotonic()
                    due = now + max(_SECONDS_BETWEEN_WRITES, (now - begun) / _WRITES_SHARE)
    finally:
        if waiting:
            keep(waiting)


def _keeper(store: Store, n_missing: int, progress: Progress | None) -> Callable[[list[Played]], None]:
    """Return what stores runs, and then says so to whom it may concern."""
    if progress is None:
        return store.add
    n_done = len(store.finished())
    known = RunProgress(
        store.study, n_done, n_done + n_missing, store.tables if 0 < store.n_rows < _QUICKLY_WRITTEN else None
    )
    progress(known)

    def keep(played: list[Played]) -> None:
        store.add(played)
        known.add(played)
        progress(known)

    return keep
