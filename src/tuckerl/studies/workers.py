"""What workers are given and what they return, wherever they are: here, in processes, or on a cluster."""

import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from tuckerl.studies.playing import play_run
from tuckerl.studies.runs import Run
from tuckerl.studies.study import Study
from tuckerl.studies.tables import StudyTables


class Task(NamedTuple):
    """A run to be played, and where it may keep what it has."""

    run: Run
    checkpoint: Path | None


class Played(NamedTuple):
    """What came of a run: its tables, or the traceback of the error that ended it."""

    run: Run
    tables: StudyTables | None
    error: str = ""


def tasks_of(runs: Iterable[Run], checkpoints: dict[Run, Path] | None = None) -> list[Task]:
    """Return tasks for all of the runs: numbers in order, as all variants of a few runs say more than few of all."""
    kept = checkpoints or {}
    ordered = sorted(runs, key=lambda run: (run.run, run.instance, run.scenario))
    return [Task(run, kept.get(run)) for run in ordered]


def play_task(study: Study, task: Task) -> Played:
    """Return what comes of a task, played in this process."""
    try:
        return Played(task.run, play_run(study, *task))
    except Exception:  # noqa: BLE001  # one run's error is its own; the study goes on
        return Played(task.run, None, traceback.format_exc())
