"""The paper's problems, each from an instance's number: a module of their own, so that runs depend on no more of it."""

from typing import Any

from tuckerl.environments.cart_pole import cart_pole
from tuckerl.environments.robot_rescue import robot_rescue
from tuckerl.problems.maze import Maze, random_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator


def pole(instance: int, **changes: Any) -> Simulator:
    """Return the one cart pole there is, or the same with other parameters."""
    return cart_pole(**changes)


def maze(instance: int) -> Maze:
    """Return the random maze of that number."""
    return random_maze(seed=instance)


def maze_with(instance: int, metric: str) -> TabularMDP:
    """Return the same maze with another heuristic."""
    one = maze(instance)
    mdp = one.to_mdp()
    return TabularMDP.from_arrays(mdp.arrays, mdp.n_states, one.heuristic(metric))  # type: ignore[arg-type]  # a name


def rescue(instance: int, **changes: Any) -> TabularMDP:
    """Return the one rescue world there is, or the same with other parameters."""
    return robot_rescue(**changes)
