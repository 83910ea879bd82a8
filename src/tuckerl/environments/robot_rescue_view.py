"""The robot rescue world as text or as pixels.

Shapes differ as well as colours (Okabe and Ito's palette, safe for the colour-blind): the
first robot is a blue disc, the second an orange triangle, the object a red square, homes are green houses, and a bar
joins a robot that grips with the object.
"""

import numpy as np

from tuckerl.environments.raster import CELL_BOUNDS, LONGER_SIDE, RIM, Colour, Image, framed, grid, offsets, paint
from tuckerl.environments.robot_rescue import NOT_GRIPPING, Scene
from tuckerl.environments.robot_rescue_map import FREE as FREE_MARK
from tuckerl.environments.robot_rescue_map import HOME, OBJECT, OBSTACLE, ROBOTS, RescueMap
from tuckerl.types import FloatArray

HOUSE: Colour = (0, 158, 115)
THING: Colour = (213, 94, 0)
DISC: Colour = (0, 76, 140)
TRIANGLE: Colour = (230, 159, 0)
BAR: Colour = (46, 52, 64)
SMALLEST_CELL = 12
"""Pixels below which a bar and two shapes are one blot."""


def write_rescue(world: RescueMap, scene: Scene) -> str:
    """Return one line for each row, in the map's own characters; a robot that grips is written small (``a``, ``b``)."""
    marks = np.where(world.obstacles, OBSTACLE, np.where(world.homes, HOME, FREE_MARK))
    marks[world.cell(scene.object)] = OBJECT
    for mark, cell, grip in zip(ROBOTS, scene.robots, scene.grips, strict=True):
        marks[world.cell(cell)] = mark if grip == NOT_GRIPPING else mark.lower()
    return "\n".join("".join(row) for row in marks)


def draw_rescue(world: RescueMap, scene: Scene) -> Image:
    """Return the picture of a scene, (height, width, 3) uint8, with a frame of half a cell."""
    size = min(max(LONGER_SIDE // max(world.rows, world.columns), SMALLEST_CELL), CELL_BOUNDS[1])
    image = grid(world.obstacles, size)
    x, y = offsets(size)
    for row, column in np.argwhere(world.homes):
        paint(image, size, (int(row), int(column)), np.abs(_house(x, y)) - 0.045, HOUSE)
    for cell, grip in zip(scene.robots, scene.grips, strict=True):
        if grip != NOT_GRIPPING:
            _draw_bar(image, size, min(cell, scene.object), world)
    square = np.maximum(np.abs(x), np.abs(y))
    paint(image, size, world.cell(scene.object), square - 0.34, RIM)
    paint(image, size, world.cell(scene.object), square - 0.28, THING)
    first, second = (world.cell(cell) for cell in scene.robots)
    paint(image, size, first, np.hypot(x, y) - 0.38, RIM)
    paint(image, size, first, np.hypot(x, y) - 0.32, DISC)
    paint(image, size, second, _triangle(x, y) - 0.06, RIM)
    paint(image, size, second, _triangle(x, y), TRIANGLE)
    return framed(image, size // 2)


def _draw_bar(image: Image, size: int, left: int, world: RescueMap) -> None:
    """Join the centres of cell number `left` and its right neighbour."""
    row, column = world.cell(left)
    width = max(size // 5, 2)
    top = row * size + (size - width) // 2
    image[top : top + width, column * size + size // 2 : (column + 1) * size + size // 2] = BAR


def _house(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the distances from a house's edge, negative inside: walls below a gabled roof."""
    roof: FloatArray = (np.abs(x) - y - 0.4) / np.sqrt(2)
    return np.maximum(roof, np.maximum(np.abs(x) - 0.38, y - 0.4))


def _triangle(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the distances from a triangle's edge, negative inside: it points up."""
    sides: FloatArray = (2 * np.abs(x) - y - 0.36) / np.sqrt(5)
    return np.maximum(sides, y - 0.3)
