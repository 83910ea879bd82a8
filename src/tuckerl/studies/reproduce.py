"""Running a study into a folder, picking up where an earlier call stopped."""

import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from tuckerl.checks import check_int
from tuckerl.studies.runner import StudyTables, all_tasks, play_tasks
from tuckerl.studies.store import Store
from tuckerl.studies.study import Study

SECONDS_BETWEEN_WRITES = 10.0
WRITES_SHARE = 0.05  # of the time, at most: all tables are written anew every time

Progress = Callable[[int, int], None]
"""Called with the number of tasks finished and of all tasks."""


def run_study(
    study: Study, folder: Path, *, workers: int, overwrite: bool = False, progress: Progress | None = None
) -> StudyTables:
    """Play what is missing of a study in a folder and return all its tables.

    An interrupt keeps every finished task: calling again goes on from there.

    Raises
    ------
    OutputError, OutputConflictError
        If the folder cannot be written, or holds another study's results and `overwrite` is False.
    """
    workers = check_int("workers", workers, 1)
    store = Store(folder, study, overwrite=overwrite)
    tasks, finished = all_tasks(study), store.finished()
    waiting: list[StudyTables] = []
    due = time.monotonic() + SECONDS_BETWEEN_WRITES
    report = progress or (lambda done, total: None)
    report(len(finished), len(tasks))
    missing = [task for task in tasks if task not in finished]
    try:
        with closing(play_tasks(study, missing, workers)) as played:
            for done, (_, tables) in enumerate(played, len(finished) + 1):
                waiting.append(tables)
                report(done, len(tasks))
                if time.monotonic() > due:
                    begun = time.monotonic()
                    store.add(waiting)
                    waiting, now = [], time.monotonic()
                    due = now + max(SECONDS_BETWEEN_WRITES, (now - begun) / WRITES_SHARE)
    finally:
        if waiting:
            store.add(waiting)
    return store.tables
