"""The cart, its pole and the push, as a line of text or as pixels.

Shapes differ as well as colours (Okabe and Ito's palette, safe for the colour-blind): the
cart is a dark box, the pole a long rounded bar, the push an arrow beside the cart, the track's ends are posts.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tuckerl.environments.raster import Colour, Image, blend
from tuckerl.types import FloatArray

Point = tuple[float, float]  # pixels rightwards and downwards

SKY: Colour = (250, 250, 247)
TRACK: Colour = (46, 52, 64)
TICK: Colour = (176, 180, 186)
CART: Colour = (0, 76, 140)
POLE: Colour = (213, 94, 0)
AXLE: Colour = (255, 255, 255)
PUSH: Colour = (0, 158, 115)

WIDTH, HEIGHT = 960, 240
SIDE = 120  # beyond each end of the track: room for the arrow of a cart there, and for a pole that leans over it
GROUND = 188  # the row of the track
CART_SIZE = (64, 30)
LONGEST_PUSH = 60
TEXT_CELLS = 41  # odd: one is the middle of the track


def write_cart_pole(state: FloatArray, track: float, force: float) -> str:
    r"""Return one line: the track with the cart as ``|``, or ``\`` or ``/`` as the pole leans, and the numbers."""
    x, speed, angle, rate = (float(number) for number in state)
    degrees = math.degrees(angle)
    cells = ["-"] * TEXT_CELLS
    middle = TEXT_CELLS // 2
    place = middle + round(max(-1.0, min(1.0, x / track)) * middle)
    cells[place] = "|" if abs(degrees) < 1.0 else ("/" if degrees > 0.0 else "\\")
    return (
        f"[{''.join(cells)}] x {x:+.3f} m, x' {speed:+.3f} m/s, theta {degrees:+.2f} deg, "
        f"theta' {math.degrees(rate):+.2f} deg/s, force {force:+.1f} N"
    )


def draw_cart_pole(state: FloatArray, track: float, pole_length: float, push: float) -> Image:
    """Return the picture, (height, width, 3) uint8.

    Parameters
    ----------
    state : (4,) float64
    track : float
        The length of each half of the track, in m.
    pole_length : float
        In m.
    push : float
        The latest push as a part of the full force, from -1 to 1.
    """
    scale = min((WIDTH / 2 - SIDE) / track, (GROUND - CART_SIZE[1] - 20) / pole_length)
    image = np.empty((HEIGHT, WIDTH, 3), dtype=np.uint8)
    image[:] = SKY
    _draw_track(image, track * scale)
    # A picture of a cart far off the track shows it at the edge.
    x = min(max(WIDTH / 2 + float(state[0]) * scale, 0.0), float(WIDTH))
    axle = (x, GROUND - CART_SIZE[1] / 2 - 8.0)
    _draw_cart(image, axle)
    _draw_push(image, axle, push)
    lean = float(state[2])
    tip = (x + pole_length * scale * math.sin(lean), axle[1] - pole_length * scale * math.cos(lean))
    _draw_bar(image, axle, tip, 5.0, POLE)
    _draw_bar(image, axle, axle, 3.0, AXLE)
    return image


def _draw_track(image: Image, half: float) -> None:
    left, right = round(WIDTH / 2 - half), round(WIDTH / 2 + half)
    image[GROUND : GROUND + 4, left:right] = TRACK
    middle = WIDTH // 2
    image[GROUND + 8 : GROUND + 18, middle - 1 : middle + 1] = TICK
    for end in (left, right):
        image[GROUND - 22 : GROUND + 18, max(end - 3, 0) : end + 3] = TRACK


def _draw_cart(image: Image, axle: Point) -> None:
    width, height = CART_SIZE

    def box(right: FloatArray, down: FloatArray) -> Any:
        return np.maximum(np.abs(right - axle[0]) - width / 2, np.abs(down - axle[1]) - height / 2)

    _paint(image, axle, axle, width / 2 + 2.0, box, CART)
    for side in (-18.0, 18.0):
        wheel = (axle[0] + side, GROUND - 6.0)
        _draw_bar(image, wheel, wheel, 6.0, TRACK)


def _draw_push(image: Image, axle: Point, push: float) -> None:
    """Draw an arrow that leaves the cart on the side that the push moves it to."""
    if push == 0.0:
        return
    sign = math.copysign(1.0, push)
    length = 14.0 + LONGEST_PUSH * abs(push)
    begin = (axle[0] + sign * (CART_SIZE[0] / 2 + 5.0), axle[1])
    end = (begin[0] + sign * length, axle[1])

    def head(right: FloatArray, down: FloatArray) -> Any:
        behind = sign * (end[0] - right)  # pixels behind the point
        return np.maximum((np.abs(down - end[1]) - 0.6 * behind) * 0.85, behind - 14.0)

    neck = (end[0] - sign * 12.0, end[1])
    _draw_bar(image, begin, neck, 2.5, PUSH)
    _paint(image, end, end, 16.0, head, PUSH)


def _draw_bar(image: Image, begin: Point, end: Point, radius: float, colour: Colour) -> None:
    """Draw a straight bar with round ends; a disc where both ends are one point."""
    right, down = end[0] - begin[0], end[1] - begin[1]
    squared = max(right * right + down * down, 1e-12)

    def distance(x: FloatArray, y: FloatArray) -> Any:
        along = np.clip(((x - begin[0]) * right + (y - begin[1]) * down) / squared, 0.0, 1.0)
        return np.hypot(x - begin[0] - along * right, y - begin[1] - along * down) - radius

    _paint(image, begin, end, radius + 1.0, distance, colour)


def _paint(
    image: Image,
    begin: Point,
    end: Point,
    margin: float,
    distance: Callable[[FloatArray, FloatArray], Any],
    colour: Colour,
) -> None:
    """Colour the shape inside which `distance` is negative, its edge smoothed; it lies within `margin` of a line."""
    left = max(math.floor(min(begin[0], end[0]) - margin), 0)
    top = max(math.floor(min(begin[1], end[1]) - margin), 0)
    right = min(math.ceil(max(begin[0], end[0]) + margin), WIDTH)
    bottom = min(math.ceil(max(begin[1], end[1]) + margin), HEIGHT)
    if left >= right or top >= bottom:
        return
    x: FloatArray = np.arange(left, right, dtype=np.float64)[np.newaxis, :] + 0.5
    y: FloatArray = np.arange(top, bottom, dtype=np.float64)[:, np.newaxis] + 0.5
    blend(image[top:bottom, left:right], distance(x, y), colour)
