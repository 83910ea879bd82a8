"""A maze, the path walked in it and the agent, as text or as pixels.

Shapes differ as well as colours (Okabe and Ito's palette, safe for the colour-blind): walls
are dark, the start is a square ring, the goal a diamond, the agent a disc, the path a line.
"""

from collections.abc import Iterable

import numpy as np

from tuckerl.environments.raster import CELL_BOUNDS, LONGER_SIDE, RIM, Colour, Image, framed, grid, offsets, paint
from tuckerl.problems.maze import Cell, Maze

PATH: Colour = (86, 180, 233)
START: Colour = (0, 158, 115)
GOAL: Colour = (213, 94, 0)
AGENT: Colour = (0, 76, 140)


def write_maze(maze: Maze, steps: Iterable[tuple[Cell, Cell]], agent: Cell) -> str:
    """Return one line for each row: ``#`` wall, ``.`` free, ``+`` walked, ``S`` start, ``G`` goal, ``@`` agent.

    Parameters
    ----------
    maze
    steps
        The pairs of neighbouring cells between which the agent has walked.
    agent
        Where it stands.
    """
    marks = np.where(maze.walls, "#", ".")
    for step in steps:
        for cell in step:
            marks[cell] = "+"
    marks[maze.start], marks[maze.goal] = "S", "G"
    marks[agent] = "@"
    return "\n".join("".join(row) for row in marks)


def draw_maze(maze: Maze, steps: Iterable[tuple[Cell, Cell]], agent: Cell) -> Image:
    """Return the picture that `write_maze` writes, (height, width, 3) uint8, with a frame of half a cell."""
    low, high = CELL_BOUNDS
    size = min(max(LONGER_SIDE // max(maze.walls.shape), low), high)
    image = grid(maze.walls, size)
    for one, other in steps:
        _draw_step(image, size, min(one, other), max(one, other))
    x, y = offsets(size)
    largest = np.maximum(np.abs(x), np.abs(y))
    paint(image, size, maze.start, np.abs(largest - 0.36) - 0.07, START)
    paint(image, size, maze.goal, (np.abs(x) + np.abs(y) - 0.5) / np.sqrt(2), GOAL)
    paint(image, size, agent, np.hypot(x, y) - 0.42, RIM)
    paint(image, size, agent, np.hypot(x, y) - 0.34, AGENT)
    return framed(image, size // 2)


def _draw_step(image: Image, size: int, first: Cell, last: Cell) -> None:
    """Join the centres of two neighbouring cells, `first` above or left of `last`."""
    width = max(size // 4, 2)
    begin = (size - width) // 2
    rows = slice(first[0] * size + begin, last[0] * size + begin + width)
    columns = slice(first[1] * size + begin, last[1] * size + begin + width)
    image[rows, columns] = PATH
