"""Maps of the robot rescue world: two robots, one object, the home cells it is to be brought to, obstacles."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.maze import Cell
from tuckerl.types import BoolArray

FREE, OBSTACLE, HOME, OBJECT, ROBOTS = ".", "#", "H", "T", "AB"

MOVES = ((0, -1), (0, 1), (-1, 0), (1, 0), (0, 0))
"""What the actions 0 left, 1 right, 2 up, 3 down and 4 stay add to (row, column)."""

ACTION_NAMES = ("left", "right", "up", "down", "stay")
AGENTS = ("robot_0", "robot_1")

MAX_CELLS = 400
"""The table of a map of 400 cells has 36 million outcomes, half a gigabyte."""

DEFAULT_MAP = """\
...HH...
........
...##...
........
##....##
...T....
.#....#.
A......B"""
"""Designed for this library, as neither the paper's Figure 12 nor its source gives a map."""


@dataclass(frozen=True)
class RescueMap:
    """Where everything is at first, read from text.

    Parameters
    ----------
    text : str
        One line for each row: ``.`` free, ``#`` obstacle, ``H`` home, ``T`` the object, ``A`` and ``B`` the first
        cells of ``robot_0`` and ``robot_1``. Space around lines and empty lines at both ends are dropped.

    Attributes
    ----------
    text : str
        The lines without that space.
    obstacles, homes : (rows, columns) bool
    object_cell : (row, column)
    robot_cells : ((row, column), (row, column))

    Raises
    ------
    ProblemError
        If rows differ in length, a character is unknown, there are more than 400 cells, no home, not exactly one
        ``T``, ``A`` and ``B``, or no sequence of moves brings the object home.

    Examples
    --------
    >>> RescueMap("ATBH.").object_cell
    (0, 1)
    """

    text: str = DEFAULT_MAP
    obstacles: BoolArray = field(init=False, repr=False, compare=False)
    homes: BoolArray = field(init=False, repr=False, compare=False)
    object_cell: Cell = field(init=False, repr=False, compare=False)
    robot_cells: tuple[Cell, Cell] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        grid = _grid(self.text)
        obstacles, homes = grid == OBSTACLE, grid == HOME
        obstacles.flags.writeable = homes.flags.writeable = False
        found = {
            "text": "\n".join("".join(row) for row in grid),
            "obstacles": obstacles,
            "homes": homes,
            "object_cell": _only(grid, OBJECT, "the object"),
            "robot_cells": tuple(_only(grid, mark, f"robot_{i}'s first cell") for i, mark in enumerate(ROBOTS)),
        }
        if not homes.any():
            raise ProblemError(f"the map must have a home cell, {HOME!r}, to bring the object to; it has none")
        for name, value in found.items():
            object.__setattr__(self, name, value)
        if not _can_grip(self):
            raise ProblemError(
                f"the robots cannot come to stand left and right of the object at {self.object_cell}, one on each "
                "side: move it or clear some obstacles"
            )
        if not _can_carry(self):
            raise ProblemError(
                f"the object cannot be carried from {self.object_cell} to a home cell with a robot on its left and one "
                "on its right: clear some obstacles"
            )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.obstacles.shape[0])

    @property
    def columns(self) -> int:
        """Number of columns."""
        return int(self.obstacles.shape[1])

    @property
    def n_cells(self) -> int:
        """Number of cells, obstacles included."""
        return int(self.obstacles.size)

    def number(self, cell: Cell) -> int:
        """Return the number of a cell, ``row * columns + column``."""
        return cell[0] * self.columns + cell[1]

    def cell(self, number: int) -> Cell:
        """Return the cell of a number."""
        row, column = divmod(int(number), self.columns)
        return row, column

    def is_free(self, cell: Cell) -> bool:
        """Return whether a cell is on the map and no obstacle."""
        return 0 <= cell[0] < self.rows and 0 <= cell[1] < self.columns and not self.obstacles[cell]


def as_rescue_map(given: RescueMap | str | Sequence[str] | None) -> RescueMap:
    """Return the map `given`: itself, by its text or its rows; the default one for None."""
    if given is None:
        return RescueMap()
    if isinstance(given, RescueMap):
        return given
    if isinstance(given, (list, tuple)) and all(isinstance(row, str) for row in given):
        return RescueMap("\n".join(given))
    if not isinstance(given, str):
        raise ParameterTypeError(f"map must be a RescueMap, its text or a list of its rows; got {given!r}")
    return RescueMap(given)


def _grid(text: object) -> np.ndarray[tuple[int, int], np.dtype[np.str_]]:
    """Return the map's characters, (rows, columns)."""
    if not isinstance(text, str):
        raise ParameterTypeError(f"a map must be text, one line for each row; got {text!r}")
    lines = [line.strip() for line in text.strip().splitlines()]
    if not lines:
        raise ProblemError("a map must have at least one row; the text is empty")
    if len(lines) * len(lines[0]) > MAX_CELLS:
        raise ProblemError(
            f"a map must have at most {MAX_CELLS} cells, as its table grows with their square; got {len(lines)} rows "
            f"of {len(lines[0])}"
        )
    known = FREE + OBSTACLE + HOME + OBJECT + ROBOTS
    for row, line in enumerate(lines):
        if len(line) != len(lines[0]):
            raise ProblemError(
                f"all rows of a map must be equally long; row 0 has {len(lines[0])} cells and row {row} has {len(line)}"
            )
        for column, mark in enumerate(line):
            if mark not in known:
                raise ProblemError(f"a map is made of {' '.join(known)}; got {mark!r} at ({row}, {column})")
    return np.array([list(line) for line in lines])


def _only(grid: np.ndarray[tuple[int, int], np.dtype[np.str_]], mark: str, meaning: str) -> Cell:
    cells = np.argwhere(grid == mark)
    if len(cells) != 1:
        raise ProblemError(f"the map must have exactly one {mark!r}, {meaning}; it has {len(cells)}")
    row, column = (int(part) for part in cells[0])
    return row, column


def _beside(cell: Cell) -> tuple[Cell, Cell]:
    """Return the cells left and right of one."""
    return (cell[0], cell[1] - 1), (cell[0], cell[1] + 1)


def _can_grip(world: RescueMap) -> bool:
    """Return whether both robots can come to grip, by a search over the pairs of their cells.

    One moves at a time: with two robots, every joint move that the rules allow is two such moves in some order.
    """
    goal = set(_beside(world.object_cell))
    # A set of pairs: asking the array, cell by cell, takes most of the search's time.
    open_cells = {world.cell(int(number)) for number in np.flatnonzero(~world.obstacles)} - {world.object_cell}
    seen = {world.robot_cells}
    frontier = [world.robot_cells]
    while frontier:
        cells = frontier.pop()
        if set(cells) == goal:
            return True
        for robot in (0, 1):
            if cells[robot] in goal:  # it grips for good
                continue
            for down, right in MOVES:
                to = (cells[robot][0] + down, cells[robot][1] + right)
                if to not in open_cells or to == cells[1 - robot]:
                    continue
                reached = (to, cells[1]) if robot == 0 else (cells[0], to)
                if reached not in seen:
                    seen.add(reached)
                    frontier.append(reached)
    return False


def _can_carry(world: RescueMap) -> bool:
    """Return whether the object, a robot on either side, can come to a home cell."""
    seen = {world.object_cell}
    frontier = [world.object_cell]
    while frontier:
        row, column = frontier.pop()
        if world.homes[row, column]:
            return True
        for down, right in MOVES:
            to = (row + down, column + right)
            if to not in seen and all(world.is_free(cell) for cell in (to, *_beside(to))):
                seen.add(to)
                frontier.append(to)
    return False
