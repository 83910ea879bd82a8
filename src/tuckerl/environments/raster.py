"""What environments render: by which mode, and pictures as arrays of pixels.

Pictures of grids have shapes in cells, their edges smoothed, and a frame around all.
"""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from tuckerl.checks import check_name
from tuckerl.types import BoolArray, FloatArray

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]

WALL: Colour = (46, 52, 64)
FREE: Colour = (250, 250, 247)
GRID: Colour = (226, 228, 230)
RIM: Colour = (255, 255, 255)

LONGER_SIDE = 640
"""Pixels that a picture's longer side has about, unless its cells would leave the bounds below."""
CELL_BOUNDS = (6, 48)

RENDER_MODES = ["ansi", "rgb_array"]


def check_render_mode(render_mode: str | None) -> str | None:
    """Return `render_mode` if it is None or one of `RENDER_MODES`.

    Raises
    ------
    ParameterTypeError, UnknownNameError
        If it is anything else.
    """
    return None if render_mode is None else check_name("render_mode", render_mode, RENDER_MODES)


def rendered(render_mode: str | None, write: Callable[[], str], draw: Callable[[], Image]) -> Any:
    """Return what one of two functions returns, as `render_mode` asks; None after a warning where it is None."""
    if render_mode is None:
        gymnasium.logger.warn("render() shows nothing without a render_mode: choose 'ansi' or 'rgb_array'")
        return None
    return write() if render_mode == "ansi" else draw()


def grid(blocked: BoolArray, size: int) -> Image:
    """Return the picture of a grid's cells, `size` pixels each: walls where `blocked`, lines between free cells."""
    image = np.where(blocked[:, :, np.newaxis], WALL, FREE).astype(np.uint8)
    image = image.repeat(size, axis=0).repeat(size, axis=1)
    free = ~blocked.repeat(size, axis=0).repeat(size, axis=1)
    on_line = np.zeros_like(free)
    on_line[::size] = on_line[:, ::size] = True
    image[free & on_line] = GRID
    return image


def offsets(size: int) -> tuple[FloatArray, FloatArray]:
    """Return the distances of a cell's pixels from its centre, rightwards and downwards, in cells."""
    offset: FloatArray = (np.arange(size) + 0.5) / size - 0.5
    return offset[np.newaxis, :], offset[:, np.newaxis]


def paint(image: Image, size: int, cell: tuple[int, int], distance: FloatArray, colour: Colour) -> None:
    """Colour a shape given by each pixel's distance from its edge (in cells, negative inside), its edge smoothed."""
    top, left = cell[0] * size, cell[1] * size
    blend(image[top : top + size, left : left + size], distance * size, colour)


def blend(block: Image, distance: FloatArray, colour: Colour) -> None:
    """Colour what lies inside a shape: `distance` is each pixel's from its edge (in pixels, negative inside)."""
    cover = np.clip(0.5 - distance, 0.0, 1.0)[:, :, np.newaxis]
    block[:] = np.rint(block * (1.0 - cover) + np.array(colour) * cover).astype(np.uint8)


def framed(image: Image, width: int) -> Image:
    """Return the picture inside a frame of the walls' colour."""
    whole = np.empty((image.shape[0] + 2 * width, image.shape[1] + 2 * width, 3), dtype=np.uint8)
    whole[:] = WALL
    whole[width:-width, width:-width] = image
    return whole
