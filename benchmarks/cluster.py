"""What a Dask cluster adds to a run: as its user waits, and what scheduler and client, which are one each, have to do.

The workers are processes of this machine, so no network is in it. The processor time of the scheduler and the client,
which are this process, bounds the runs a second of any number of workers.
"""

import statistics
import time
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from distributed import LocalCluster

from benchmarks.timing import Row, compare, replaced
from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.studies import cluster as studies_cluster
from tuckerl.studies.cluster import play_on_cluster
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.processes import Processes
from tuckerl.studies.runs import all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.workers import tasks_of

LENGTHS = {"short": (1, 600), "longer": (500, 120)}  # episodes of a run, runs


def sutton(instance: int) -> Maze:
    """Return Sutton's maze."""
    return sutton_maze()


def rows() -> list[Row]:
    """Time short and longer runs on one core, and on one and two workers of a cluster; and short ones sent alone."""
    several = [row for length in LENGTHS for n_workers in (1, 2) for row in _rows(length, n_workers)]
    with replaced(studies_cluster, "_MOST_IN_A_PIECE", 1):
        return several + _rows("short", 2, ", each sent alone")


def _rows(length: str, n_workers: int, how: str = "") -> list[Row]:
    n_episodes, n_runs = LENGTHS[length]
    own: dict[str, Any] = {
        "problem": sutton,
        "n_instances": 1,
        "n_runs": n_runs,
        "n_episodes": n_episodes,
        "record_paths_of": (),
    }
    study = Study((replace(DYNA_MAZE, variants=DYNA_MAZE.variants[:1], **own),), seed=0)
    tasks, central = tasks_of(all_runs(study)), []
    with LocalCluster(n_workers=n_workers, threads_per_worker=1, dashboard_address=":0") as made:

        def there() -> None:
            begun = time.process_time()
            _all(play_on_cluster(study, tasks, made.scheduler_address))
            central.append(time.process_time() - begun)

        def here() -> None:
            _all(Processes(1).play(study, tasks))

        what = f"{length} runs, {n_workers} worker{'s' if n_workers > 1 else ''}{how}"
        row = compare(what, "run", there, "one core, no cluster", here, units=n_runs, repeats=3)
    cpu = statistics.median(central[1:]) / n_runs
    return [row, Row("  of it scheduler and client", "run, CPU", cpu, "-", None, None)]


def _all(played: Iterable[Any]) -> None:
    for _ in played:
        pass
