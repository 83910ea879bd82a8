"""A program that plays a small study into a folder, and says how many runs are finished whenever some are."""

import sys
from dataclasses import replace
from pathlib import Path

from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.study import Study


def sutton(instance: int) -> Maze:
    """Return Sutton's maze."""
    return sutton_maze()


SMALL = Study(
    (replace(DYNA_MAZE, problem=sutton, n_instances=2, n_runs=15, n_episodes=20, variants=DYNA_MAZE.variants[:2]),),
    seed=3,
)


def say(runs: RunProgress) -> None:
    """Write how many runs are finished of how many."""
    sys.stdout.write(f"{runs.n_done} {runs.n_total}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    from tuckerl.studies import reproduce

    reproduce._SECONDS_BETWEEN_WRITES = 0.0
    reproduce._WRITES_SHARE = 1.0  # it is about being killed while writing
    run_study(SMALL, Path(sys.argv[1]), workers=int(sys.argv[2]), progress=say)
