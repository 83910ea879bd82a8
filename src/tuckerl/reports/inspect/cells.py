"""Grids whose cells are states: how large they are drawn, in which colours, and what the colours mean."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from tuckerl.problems.parts import Layout
from tuckerl.reports.figure import WIDTH, panel, panel_figure
from tuckerl.types import BoolArray, FloatArray, IntArray

WALL = "0.12"
NOTHING = "1.0"  # of cells without a number
FRAME = "0.25"

BELOW, ABOVE = 0.78, 0.36  # inches under a grid and over it
_LEFT, _RIGHT = 0.62, 0.98  # inches beside a panel: its labels, its colour bar
_TALLEST = 7.0
_LARGEST_CELL = 0.46
_LEAST = 0.3  # of a panel's side
_SHORTEST_BAR = 0.8
_LINES_FROM = 13.0  # points of a cell that lines are drawn between


class Room(NamedTuple):
    """A grid's panel in inches, and a cell's sides in points."""

    width: float
    height: float
    across: float
    down: float

    @property
    def cell(self) -> float:
        """A cell's shorter side in points."""
        return min(self.across, self.down)


def sequential() -> Colormap:
    """Return colours whose lightness grows evenly, without the darkest, which walls have."""
    return ListedColormap(mpl.colormaps["cividis"](np.linspace(0.22, 1.0, 256)))


def scale(values: FloatArray) -> Normalize:
    """Return the scale from the least to the largest finite number, widened where they are one."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return Normalize(0.0, 1.0)
    low, high = float(finite.min()), float(finite.max())
    if high - low > 1e-9 * max(abs(low), abs(high)):
        return Normalize(low, high)
    half = 0.5 * max(abs(low), 1.0)
    return Normalize(low - half, high + half)


def room_for(layout: Layout, width: float = WIDTH - _LEFT - _RIGHT, height: float = _TALLEST) -> Room:
    """Return how large a grid is drawn in the space that there is; square cells, unless a side would vanish."""
    rows, columns = layout
    cell = min(width / columns, height / rows, _LARGEST_CELL)
    across, down = max(cell * columns, min(_LEAST, width)), max(cell * rows, _LEAST)
    return Room(across, down, 72 * across / columns, 72 * down / rows)


def grid_figure(layout: Layout) -> tuple[Figure, Axes, Room]:
    """Return a figure with one grid's axes and space for what stands under it."""
    room = room_for(layout)
    return *panel_figure(_LEFT, BELOW, room.width, room.height, ABOVE), room


def draw_cells(
    axes: Axes,
    values: FloatArray,
    layout: Layout,
    blocked: BoolArray,
    norm: Normalize,
    room: Room,
    *,
    lines: bool = True,
) -> ScalarMappable:
    """Colour the cells by (S,) numbers, white where there is none; walls nearly black."""
    colours = ScalarMappable(norm, sequential())
    pixels = colours.to_rgba(np.ma.masked_invalid(values))
    pixels[~np.isfinite(values)] = mpl.colors.to_rgba(NOTHING)
    pixels[blocked] = mpl.colors.to_rgba(WALL)
    rows, columns = layout
    # One image, not a square for each cell: large grids stay small files, and no hairlines show between cells.
    axes.imshow(pixels.reshape(rows, columns, 4), interpolation="none", aspect="auto")
    if lines and room.cell >= _LINES_FROM:
        axes.hlines(np.arange(rows - 1) + 0.5, -0.5, columns - 0.5, color="0.55", linewidth=0.4)
        axes.vlines(np.arange(columns - 1) + 0.5, -0.5, rows - 0.5, color="0.55", linewidth=0.4)
    axes.set_xlim(-0.5, columns - 0.5)
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_xticks(counting_ticks(columns))
    axes.set_yticks(counting_ticks(rows))
    axes.set_xlabel("column", labelpad=2)
    axes.set_ylabel("row", labelpad=2)
    axes.tick_params(length=2)
    axes.spines[:].set(visible=True, color=FRAME)
    return colours


def draw_table(
    axes: Axes,
    values: FloatArray,
    norm: Normalize,
    names: Sequence[str] | None = None,
    *,
    most: int = 45,
    words: Callable[[float], str] | None = None,
    **more: Any,
) -> AxesImage:
    """Colour a rectangle of numbers, white where there is none.

    `names` stand beside the rows, or beside some of them where there are more than `most`; `words` in the cells.
    """
    look: dict[str, Any] = {"cmap": sequential(), "norm": norm, "interpolation": "none", "aspect": "auto"}
    image = axes.imshow(np.ma.masked_invalid(values), **look, **more)
    axes.tick_params(length=0)
    if names is not None:
        every = -(-len(names) // most)
        axes.set_yticks(range(0, len(names), every), names[::every], parse_math=False)
    if words is not None:
        for row, column in np.argwhere(np.isfinite(values)):
            shade = "white" if norm(values[row, column]) < 0.35 else "black"
            place: dict[str, Any] = {"horizontalalignment": "center", "verticalalignment": "center_baseline"}
            axes.text(column, row, words(values[row, column]), color=shade, fontsize=8, **place)
    return image


def counting_ticks(n: int) -> IntArray:
    """Return the numbers of some of `n` things, counted from 0: round ones, at most ten."""
    step = next(round_ * 10**power for power in range(12) for round_ in (1, 2, 5) if n <= 10 * round_ * 10**power)
    return np.arange(0, n, step)


def colour_bar(
    axes: Axes, colours: ScalarMappable, label: str, ticks: list[float] | None = None, least: float = _SHORTEST_BAR
) -> Axes:
    """Draw a bar right of `axes`, as high as they are but at least `least` inches, and return its axes."""
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    box = axes.get_position()
    width, height = figure.get_size_inches()
    tall = min(max(box.height * height, least), 3.2)
    place = panel(figure, box.x1 * width + 0.12, box.y1 * height - tall, 0.13, tall)
    bar = figure.colorbar(colours, cax=place, ticks=ticks)
    if ticks is None:
        bar.locator = MaxNLocator(max(1, min(6, math.floor(tall / 0.3))))
        bar.update_ticks()
    bar.outline.set_visible(False)
    place.set_ylabel(label, fontsize=8)
    place.tick_params(length=2)
    return place


def key_of_cells(blocked: BoolArray, empty: BoolArray, empty_words: str) -> list[Patch]:
    """Return the entries of a legend for cells that show no number, of the kinds that there are."""
    entries = []
    if blocked.any():
        entries.append(Patch(facecolor=WALL, edgecolor=FRAME, linewidth=0.6, label="blocked"))
    if (empty & ~blocked).any():
        entries.append(Patch(facecolor=NOTHING, edgecolor=FRAME, linewidth=0.6, label=empty_words))
    return entries


def legend_below(axes: Axes, room: Room, entries: Sequence[Artist], ncols: int, columnspacing: float = 1.0) -> None:
    """Draw a legend under a grid, if there are entries."""
    if entries:
        axes.legend(
            handles=entries,
            loc="upper left",
            bbox_to_anchor=(0, -0.36 / room.height),
            ncols=ncols,
            frameon=False,
            borderpad=0,
            columnspacing=columnspacing,
            handlelength=1.2,
        )


def where(state: int, layout: Layout | None) -> str:
    """Return a state in words: its cell where it has one."""
    if layout is None:
        return f"state {state}"
    return f"row {state // layout[1]}, column {state % layout[1]}"
