"""Problems of Sutton and Barto's book (2018, chapter 8), in the sizes and with the rewards that it gives them."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete

from tests.reference.value_iteration import model_of, optimal_values
from tuckerl import TabularMDP, sutton_maze
from tuckerl.problems.maze import MOVES
from tuckerl.types import BoolArray, FloatArray


def dyna_maze(scale: int = 1, limit: int = 50_000) -> TabularMDP:
    """The maze of figure 8.2, every cell of which is `scale` x `scale` cells: example 8.4's growing mazes.

    Moves into walls leave the agent where it is; entering the goal pays 1 and ends, all else pays 0.
    """
    maze = sutton_maze()
    walls, goals = maze.walls.repeat(scale, 0).repeat(scale, 1), np.zeros(maze.walls.shape, dtype=np.bool_)
    goals[maze.goal] = True
    start = (maze.start[0] * scale, maze.start[1] * scale)
    return gridworld(walls, start, goals.repeat(scale, 0).repeat(scale, 1), limit)


def gridworld(walls: BoolArray, start: tuple[int, int], goals: BoolArray, limit: int) -> TabularMDP:
    """Four moves on a grid; entering a goal pays 1 and ends."""
    rows, columns = walls.shape
    next_state = np.zeros((walls.size, len(MOVES)), dtype=np.int64)
    for state in range(walls.size):
        row, column = divmod(state, columns)
        for action, (down, right) in enumerate(MOVES):
            cell = (row + down, column + right)
            free = 0 <= cell[0] < rows and 0 <= cell[1] < columns and not walls[cell]
            next_state[state, action] = cell[0] * columns + cell[1] if free else state
    ends = goals.ravel()[next_state]
    first = start[0] * columns + start[1]
    return TabularMDP(next_state, ends.astype(np.float64), ends, start=first, max_episode_steps=limit)


def shortest_path(mdp: TabularMDP) -> int:
    """The fewest steps from the start of a grid to its goal, from the optimal value gamma ** (steps - 1)."""
    model, gamma = model_of(mdp), 0.5
    return 1 + round(float(np.log(model.start @ optimal_values(model, gamma, 0.0)) / np.log(gamma)))


def greedy_length(mdp: TabularMDP, q: FloatArray, most: int) -> int:
    """How many steps a table's first greedy actions take from the start to the goal; `most` where they do not."""
    arrays, state = mdp.arrays, int(mdp.arrays.start_state[0])
    for step in range(most):
        outcome = state * mdp.n_actions + int(q[state].argmax())
        if arrays.terminated[outcome]:
            return step + 1
        state = int(arrays.next_state[outcome])
    return most


class ChangingMaze(gymnasium.Env[Any, Any]):
    """A barrier across a 6 x 9 grid whose gaps change after so many steps, counted over all episodes.

    Example 8.2, blocking: the gap on the right closes and one on the left opens. Example 8.3, shortcut: one on the
    right opens besides that on the left.
    """

    observation_space, action_space = Discrete(54), Discrete(4)
    start, goal = (5, 3), (0, 8)

    def __init__(self, gaps: tuple[tuple[int, ...], tuple[int, ...]], change_at: int) -> None:
        self.gaps, self.change_at, self.n_steps, self.place = gaps, change_at, 0, self.start

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.place = self.start
        return self.place[0] * 9 + self.place[1], {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        gaps = self.gaps[self.n_steps >= self.change_at]
        self.n_steps += 1
        row, column = (here + move for here, move in zip(self.place, MOVES[action], strict=True))
        if 0 <= row < 6 and 0 <= column < 9 and (row != 3 or column in gaps):
            self.place = (row, column)
        at_goal = self.place == self.goal
        return self.place[0] * 9 + self.place[1], float(at_goal), at_goal, False, {}


def blocking_maze() -> ChangingMaze:
    """Example 8.2."""
    return ChangingMaze(((8,), (0,)), 1000)


def shortcut_maze() -> ChangingMaze:
    """Example 8.3."""
    return ChangingMaze(((0,), (0, 8)), 3000)


def river_swim(steps: int) -> TabularMDP:
    """RiverSwim (Strehl and Littman 2008): six places along a river, and one long episode.

    Action 0 swims with the current, which always works; at the mouth it pays 5. Action 1 swims against it: 0.3 one
    place on, 0.6 none, 0.1 one back; at the mouth 0.3 on, 0.7 none; at the spring it stays, which pays 10,000, with
    0.3. The swimmer begins in the second or the third place.
    """
    next_state, probability, reward = np.zeros((6, 2, 3), np.int64), np.zeros((6, 2, 3)), np.zeros((6, 2, 3))
    for s in range(6):
        next_state[s, 0] = max(s - 1, 0)
        next_state[s, 1] = max(s - 1, 0), s, min(s + 1, 5)
        probability[s, 0] = 1.0, 0.0, 0.0
        probability[s, 1] = {0: (0.0, 0.7, 0.3), 5: (0.7, 0.3, 0.0)}.get(s, (0.1, 0.6, 0.3))
    reward[0, 0] = 5.0
    reward[5, 1, 1] = 10_000.0
    start = np.array([0.0, 0.5, 0.5, 0.0, 0.0, 0.0])
    ends = np.zeros((6, 2, 3), dtype=np.bool_)
    return TabularMDP(next_state, reward, ends, probability, start=start, max_episode_steps=steps)
