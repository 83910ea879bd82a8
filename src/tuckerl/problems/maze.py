"""Mazes on a grid: random worlds, Sutton's maze, shortest paths (the paper's section IV.B, Figures 10 and 11).

A cell is a pair (row, column); its state is ``row * columns + column``. Actions: 0 up, 1 down, 2 left, 3 right.
Stepping into a wall or over the border costs a step and does not move.
"""

from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import NO_ARRAY, check_int, check_name, check_real, check_sequence, refuse_mask, shown
from tuckerl.errors import MazeError, ParameterTypeError
from tuckerl.memory import Part, check_memory
from tuckerl.problems.immutable import Immutable
from tuckerl.problems.mdp import TabularMDP
from tuckerl.types import BoolArray, FloatArray, IntArray

Cell = tuple[int, int]
Metric = Literal["squared", "euclidean", "l1"]

MOVES = ((-1, 0), (1, 0), (0, -1), (0, 1))
ACTION_NAMES = ("up", "down", "left", "right")
MAX_DRAWS = 1000


@dataclass(eq=False)
class Maze(Immutable):
    """A grid of walls with a start and a goal that a path joins; it does not change once it is made.

    Parameters
    ----------
    walls : (rows, columns) bool
        True where nobody can stand.
    start, goal : (row, column)

    Raises
    ------
    MazeError
        If start or goal is outside or a wall, both are the same cell, or no path joins them.
    """

    walls: BoolArray
    start: Cell
    goal: Cell

    def __post_init__(self) -> None:
        walls = check_walls(self.walls)
        self.walls = walls
        for name in ("start", "goal"):
            cell = _check_cell(name, getattr(self, name), walls.shape)
            setattr(self, name, cell)
            if walls[cell]:
                raise MazeError(f"{name} must be a free cell; {cell} is a wall: move it or clear the wall")
        if self.start == self.goal:
            raise MazeError(f"start and goal must be two cells; both are {self.start}")
        if self._distances()[self.start] < 0:
            raise MazeError(f"no path leads from start {self.start} to goal {self.goal}: clear some walls")

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.walls.shape[0])

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.walls.shape[1])

    @property
    def n_states(self) -> int:
        """Number of cells, walls included."""
        return int(self.walls.size)

    def state(self, cell: Cell) -> int:
        """Return the number of a cell."""
        cell = _check_cell("cell", cell, self.walls.shape)
        return cell[0] * self.columns + cell[1]

    def cell(self, state: int) -> Cell:
        """Return the cell of a number."""
        row, column = divmod(check_int("state", state, 0, self.n_states - 1), self.columns)
        return row, column

    def shortest_path(self) -> list[Cell]:
        """Return the cells of one shortest path, from start to goal, both included (breadth-first)."""
        distances = dict(np.ndenumerate(self._distances()))
        path = [self.start]
        while path[-1] != self.goal:
            row, column = path[-1]
            around = ((row + down, column + right) for down, right in MOVES)
            path.append(next(cell for cell in around if distances.get(cell) == distances[row, column] - 1))
        return path

    def heuristic(self, metric: Metric = "squared") -> FloatArray:
        """Return every cell's distance to the goal, (rows * columns,): squared Euclidean, Euclidean or L1."""
        check_name("metric", metric, ("squared", "euclidean", "l1"))
        down = np.arange(self.rows, dtype=np.float64)[:, np.newaxis] - self.goal[0]
        right = np.arange(self.columns, dtype=np.float64) - self.goal[1]
        if metric == "l1":
            return (np.abs(down) + np.abs(right)).ravel()
        squared: FloatArray = (down * down + right * right).ravel()
        return squared if metric == "squared" else np.sqrt(squared)

    def to_mdp(
        self, *, step_reward: float = -1.0, goal_reward: float = 0.0, max_episode_steps: int | None = 2000
    ) -> TabularMDP:
        """Return the maze as a finite MDP with the squared distance as its heuristic.

        `step_reward` is paid for every step but the one into the goal, which pays `goal_reward` and ends the episode.
        """
        next_state = np.empty((self.n_states, len(MOVES)), dtype=np.int32)
        here = np.arange(self.n_states).reshape(self.walls.shape)
        for action, (down, right) in enumerate(MOVES):
            row = np.clip(np.arange(self.rows) + down, 0, self.rows - 1)
            column = np.clip(np.arange(self.columns) + right, 0, self.columns - 1)
            there = here[np.ix_(row, column)]
            stays = self.walls.ravel()[there] | self.walls
            next_state[:, action] = np.where(stays, here, there).ravel()
        goal = self.state(self.goal)
        next_state[goal] = goal
        terminated = next_state == goal
        reward = np.where(terminated, check_real("goal_reward", goal_reward), check_real("step_reward", step_reward))
        return TabularMDP(
            next_state,
            reward,
            terminated,
            start=self.state(self.start),
            max_episode_steps=max_episode_steps,
            heuristic=self.heuristic(),
            layout=(self.rows, self.columns),
            action_names=ACTION_NAMES,
            state_factors=(("row", self.rows), ("column", self.columns)),
        )

    def _distances(self) -> IntArray:
        """Return each cell's number of steps to the goal, -1 where there is no way."""
        # Flat numbers in a grid framed by walls: no bounds to test, several times faster than pairs of indices.
        closed = bytearray(np.pad(self.walls, 1, constant_values=True).tobytes())
        width = self.columns + 2
        distances = np.full(len(closed), -1, dtype=np.int64)
        frontier = [(self.goal[0] + 1) * width + self.goal[1] + 1]
        steps = 0
        while frontier:
            distances[frontier] = steps
            reached = []
            for cell in frontier:
                closed[cell] = True
                for neighbour in (cell - width, cell + width, cell - 1, cell + 1):
                    if not closed[neighbour]:
                        closed[neighbour] = True
                        reached.append(neighbour)
            frontier = reached
            steps += 1
        return distances.reshape(self.rows + 2, width)[1:-1, 1:-1]


def random_maze(
    rows: int = 39,
    columns: int = 36,
    deviation: float = 0.3,
    seed: int = 0,
    *,
    start: Cell = (0, 3),
    goal: Cell = (28, 34),
) -> Maze:
    """Return the random Gaussian world number `seed` (the paper's section IV.B).

    A cell is a wall when a normal draw of mean 0 and standard deviation `deviation`, rounded, is not 0: at 0.3, 9.6 %
    of the cells. Start and goal are free; a world without a path is drawn again.

    Raises
    ------
    MazeError
        If start or goal lie outside, or no path was found in 1000 draws.

    Examples
    --------
    >>> len(random_maze(seed=0).shortest_path()) - 1
    59
    """
    rows, columns = check_int("rows", rows, 1), check_int("columns", columns, 1)
    deviation = check_real("deviation", deviation, 0.0) + 0.0  # -0.0 is below 0 to NumPy
    check_memory("a random maze", [Part("draws and walls", 20 * rows * columns, "use fewer rows or columns")])
    generator = np.random.default_rng(check_int("seed", seed, 0))
    start, goal = (_check_cell(name, cell, (rows, columns)) for name, cell in (("start", start), ("goal", goal)))
    if start == goal:
        raise MazeError(f"start and goal must be two cells; both are {start}")
    for _ in range(MAX_DRAWS):
        walls = np.rint(generator.normal(0.0, deviation, (rows, columns))) != 0
        walls[start] = walls[goal] = False
        # All else has been checked, so what a maze can still lack is a path.
        with suppress(MazeError):
            return Maze(walls, start, goal)
    raise MazeError(
        f"no maze of {rows} x {columns} cells with a path from {start} to {goal} in {MAX_DRAWS} draws at deviation "
        f"{deviation:g}: choose a smaller deviation (0.3 makes 9.6 % of the cells walls)"
    )


def sutton_maze() -> Maze:
    """Return the 6 x 9 maze of Sutton's Dyna papers (1990, 1991), whose shortest path has 14 steps.

    Examples
    --------
    >>> len(sutton_maze().shortest_path()) - 1
    14
    """
    walls = np.zeros((6, 9), dtype=np.bool_)
    for cell in ((1, 2), (2, 2), (3, 2), (0, 7), (1, 7), (2, 7), (4, 5)):
        walls[cell] = True
    return Maze(walls, (2, 0), (0, 8))


def check_walls(walls: ArrayLike) -> BoolArray:
    """Return `walls` as a (rows, columns) boolean array.

    Raises
    ------
    MazeError, ParameterTypeError
        If it is not a (rows, columns) boolean array.
    """
    refuse_mask("walls", walls)
    try:
        array = np.asarray(walls)
    except NO_ARRAY as error:
        raise MazeError(f"walls must be a (rows, columns) boolean array; {error}") from error
    if array.ndim != 2 or array.size == 0:
        raise MazeError(f"walls must be a (rows, columns) boolean array; got shape {array.shape}")
    if array.dtype.kind != "b":
        raise ParameterTypeError(f"walls must be a boolean array, True where there is a wall; got dtype {array.dtype}")
    return array


def _check_cell(name: str, cell: object, shape: tuple[int, ...]) -> Cell:
    pair = check_sequence(name, cell, "a pair (row, column)", 2)
    row, column = (check_int(f"{name}'s {part}", value) for part, value in zip(("row", "column"), pair, strict=True))
    if not (0 <= row < shape[0] and 0 <= column < shape[1]):
        raise MazeError(f"{name} must lie inside the {shape[0]} x {shape[1]} maze; got ({shown(row)}, {shown(column)})")
    return row, column
