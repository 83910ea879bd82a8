"""A program whose two workers play what does not end within a test."""

import multiprocessing
import sys
from dataclasses import replace

from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.processes import Processes
from tuckerl.studies.runs import all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.workers import tasks_of


def said(instance: int) -> Maze:
    """Return Sutton's maze; a worker that begins to play it for the second time says so."""
    if instance == 1 and multiprocessing.parent_process() is not None:
        sys.stdout.write("playing\n")
        sys.stdout.flush()
    return sutton_maze()


if __name__ == "__main__":
    base = replace(DYNA_MAZE, problem=said, n_instances=2, n_runs=1, n_episodes=10**6, variants=DYNA_MAZE.variants[:1])
    endless = Study((base,), seed=3)
    with Processes(2) as processes:
        list(processes.play(endless, tasks_of(all_runs(endless))))
