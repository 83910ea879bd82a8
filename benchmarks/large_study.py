"""A study of 100,000 runs: how long it takes to open it, to add a run, and to write its report anew.

The runs are made up, but stored as any others, in parts of a thousand. The first report works out all thousand
comparisons, the second only the one that has a new run.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.timing import Row
from tuckerl import Study
from tuckerl.files import write_whole
from tuckerl.studies.playing import play_run
from tuckerl.studies.runs import Run, all_runs
from tuckerl.studies.store import Store
from tuckerl.studies.study_folder import FILE
from tuckerl.studies.tables import StudyTables
from tuckerl.studies.workers import Played

AT_ONCE = 1_000
TEXT = """
runs = 100
episodes = 100

[[problem]]
env = "FrozenLake-v1"

[[algorithm]]
name = "base"
algorithm = "q-learning"

[[algorithm]]
name = "other"
algorithm = "q-learning"
grid = { alpha = { from = 0.001, to = 0.999, steps = 999 } }

[[compare]]
base = "base"
candidate = "other"
"""


def rows() -> list[Row]:
    """Time them, once each."""
    study = Study.from_text(TEXT)
    plan = study._plan
    runs, found = all_runs(plan), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made_up = _tables(play_run(plan, runs[0]))
        *old, new = (Played(run, made_up(run)) for run in runs)

        def fill() -> None:
            with Store(folder, plan) as store:
                for first in range(0, len(old), AT_ONCE):
                    store.add(old[first : first + AT_ONCE])
            write_whole(folder / FILE, TEXT.encode())

        def open_and_add() -> None:
            with Store(folder, plan) as store:
                if store.missing() == [new.run]:
                    store.add([new])

        def write() -> None:
            with Store(folder, plan) as store:
                store.write_tables()

        def report() -> None:
            study.report(folder)

        for what, work in (
            ("store 99,999 runs", fill),
            ("the first report", report),
            ("open and add a run", open_and_add),
            ("the report again", report),
            ("write its tables", write),
        ):
            found += _rows(what, work)
    return found


def _tables(played: StudyTables) -> Callable[[Run], StudyTables]:
    """Return what makes up tables like those that were played: a few, again and again."""
    rng = np.random.default_rng(0)
    runs = played.runs
    several = [
        played._replace(runs=runs.with_columns(runs["return"] + rng.standard_normal(runs.height))) for _ in range(97)
    ]
    return lambda run: several[hash(run) % len(several)]


def _rows(what: str, work: Callable[[], None]) -> list[Row]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    return [Row(what, "study", wall, "-", None, None), Row("  processor time", "study", cpu, "-", None, None)]
