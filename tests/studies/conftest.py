from dataclasses import replace

import pytest

from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.study import Study


def sutton(instance: int) -> Maze:
    return sutton_maze()


@pytest.fixture(scope="session")
def study() -> Study:
    """A study of seconds: Sutton's maze twice, 2 runs of 20 episodes, three variants."""
    kept = ("dyna-h", "dyna-ht-1", "dyna-ht-3", "constant-1", "constant-3-max")
    scenario = replace(
        DYNA_MAZE,
        problem=sutton,
        n_instances=2,
        n_runs=2,
        n_episodes=20,
        variants=tuple(variant for variant in DYNA_MAZE.variants if variant.name in kept),
    )
    return Study((scenario,), seed=3)
