"""Maps of the robot rescue world: two robots, one object, the home cells it is to be brought to, obstacles."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.maze import Cell
from tuckerl.types import BoolArray, IntArray

FREE, OBSTACLE, HOME, OBJECT, ROBOTS = ".", "#", "H", "T", "AB"

MOVES = ((0, -1), (0, 1), (-1, 0), (1, 0), (0, 0))
"""What the actions 0 left, 1 right, 2 up, 3 down and 4 stay add to (row, column)."""

ACTION_NAMES = ("left", "right", "up", "down", "stay")
AGENTS = ("robot_0", "robot_1")

NOWHERE = -1
"""Instead of a cell's number: outside, or an obstacle."""

Place = TypeVar("Place")

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
        to = neighbours(self).tolist()
        if not _can_grip(self, to):
            raise ProblemError(
                f"the robots cannot come to stand left and right of the object at {self.object_cell}, one on each "
                "side: move it or clear some obstacles"
            )
        if not _can_carry(self, to):
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


def as_rescue_map(given: RescueMap | str | Sequence[str] | None) -> RescueMap:
    """Return the map `given`: itself, by its text or its rows; the default one for None."""
    if given is None:
        return RescueMap()
    if isinstance(given, RescueMap):
        return given
    if isinstance(given, (list, tuple)) and all(isinstance(row, str) for row in given):
        return RescueMap("\n".join(given))
    if not isinstance(given, str):
        raise ParameterTypeError(f"map must be a RescueMap, its text or a list of its rows; got {shown(given)}")
    return RescueMap(given)


def _grid(text: object) -> np.ndarray[tuple[int, int], np.dtype[np.str_]]:
    """Return the map's characters, (rows, columns)."""
    if not isinstance(text, str):
        raise ParameterTypeError(f"a map must be text, one line for each row; got {shown(text)}")
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
                raise ProblemError(f"a map is made of {' '.join(known)}; got {shown(mark)} at ({row}, {column})")
    return np.array([list(line) for line in lines])


def _only(grid: np.ndarray[tuple[int, int], np.dtype[np.str_]], mark: str, meaning: str) -> Cell:
    cells = np.argwhere(grid == mark)
    if len(cells) != 1:
        raise ProblemError(f"the map must have exactly one {mark!r}, {meaning}; it has {len(cells)}")
    row, column = (int(part) for part in cells[0])
    return row, column


def neighbours(world: RescueMap) -> IntArray:
    """Return the cell that each move leads to from each cell, (cells, 5); NOWHERE if outside or an obstacle."""
    cells = np.arange(world.n_cells).reshape(world.obstacles.shape)
    framed = np.pad(np.where(world.obstacles, NOWHERE, cells), 1, constant_values=NOWHERE)
    moved = [framed[1 + down :, 1 + right :][: world.rows, : world.columns].ravel() for down, right in MOVES]
    return np.stack(moved, axis=1)


def _can_grip(world: RescueMap, to: list[list[int]]) -> bool:
    """Return whether both robots can come to grip, by a search over the pairs of their cells.

    One moves at a time: with two robots, every joint move that the rules allow is two such moves in some order.
    """
    thing = world.number(world.object_cell)
    goal = set(to[thing][:2])  # left and right

    def moved(cells: tuple[int, int]) -> Iterator[tuple[int, int]]:
        first, second = cells
        barred = (NOWHERE, thing, first, second)
        if first not in goal:  # else it grips for good
            yield from ((cell, second) for cell in to[first] if cell not in barred)
        if second not in goal:
            yield from ((first, cell) for cell in to[second] if cell not in barred)

    begin = world.number(world.robot_cells[0]), world.number(world.robot_cells[1])
    return any(set(cells) == goal for cells in _reached(begin, moved))


def _can_carry(world: RescueMap, to: list[list[int]]) -> bool:
    """Return whether the object, a robot on either side, can come to a home cell."""

    def moved(cell: int) -> Iterator[int]:
        return (new for new in to[cell] if new != NOWHERE and NOWHERE not in to[new][:2])

    homes = world.homes.ravel()
    return any(homes[cell] for cell in _reached(world.number(world.object_cell), moved))


def _reached(begin: Place, moved: Callable[[Place], Iterable[Place]]) -> Iterator[Place]:
    """Search from a place: give it and every other one that moves lead to, once."""
    seen, frontier = {begin}, [begin]
    while frontier:
        place = frontier.pop()
        yield place
        new = set(moved(place)) - seen
        seen |= new
        frontier += new
