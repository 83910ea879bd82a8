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
from matplotlib.ticker import Locator

from tuckerl.problems.parts import Layout
from tuckerl.reports.figure import WIDTH
from tuckerl.reports.inspect.content import Inspection
from tuckerl.types import FloatArray, IntArray

_WALL, _NOTHING, _EDGE = "0.12", "1.0", "0.25"  # of cells without a number, and around the grid
_LARGEST_CELL, _TALLEST, _LEAST = 0.46, 7.0, 0.3  # inches: of a cell, and of a panel's sides
_LINES_FROM = 13.0  # points of a cell that lines are drawn between
_BESIDE, _OVER = 1.7, 0.75  # inches that labels and a colour bar need


class Map(NamedTuple):
    """The numbers of the states, and how they are coloured."""

    values: FloatArray  # (S,) NaN where there is none
    norm: Normalize
    title: str
    bar: str = ""  # the words of a colour bar; "" for none
    ticks: Locator | None = None  # of that bar


class Cell(NamedTuple):
    """A cell's sides in points."""

    across: float
    down: float


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


def cell_of(layout: Layout, across: int = 1, tallest: float = _TALLEST) -> Cell:
    """Return how large cells are where so many grids stand beside one another: squares, unless a side would vanish."""
    rows, columns = layout
    side = min((WIDTH - _BESIDE) / across / columns, tallest / rows, _LARGEST_CELL)
    return Cell(72 * max(side, _LEAST / columns), 72 * max(side, _LEAST / rows))


def draw_maps(
    inspection: Inspection,
    maps: Sequence[Map],
    empty: str,
    *,
    across: int = 2,
    tallest: float = _TALLEST,
    ticks: bool = True,
) -> tuple[Figure, list[Axes], list[Artist]]:
    """Draw maps over the grid of states, so many beside one another; return what a legend says of cells, too."""
    rows, layout = inspection.grid[0], inspection.grid
    across = min(across, len(maps))
    down = math.ceil(len(maps) / across)
    cell = cell_of(layout, across, tallest)
    height = down * (cell.down * rows / 72 + (_OVER if ticks else 0.5)) + 0.3
    figure = Figure(figsize=(WIDTH, height), layout="compressed")
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for axes, shown in zip(panels, maps, strict=False):
        colours = _draw_map(axes, shown, inspection, cell, ticks=ticks)
        if shown.bar:
            colour_bar(axes, colours, shown.bar, ticks=shown.ticks)
    for axes in panels[len(maps) :]:
        axes.remove()
    missing = np.isnan([shown.values for shown in maps]).any(axis=0) & ~inspection.walls
    key = ((_WALL, "blocked", inspection.walls.any()), (_NOTHING, empty, missing.any()))
    patches: list[Artist] = [Patch(facecolor=face, edgecolor=_EDGE, label=words) for face, words, some in key if some]
    return figure, list(panels[: len(maps)]), patches


def _draw_map(axes: Axes, shown: Map, inspection: Inspection, cell: Cell, *, ticks: bool) -> ScalarMappable:
    """Colour the cells by their numbers, white where there is none; walls nearly black."""
    rows, columns = inspection.grid
    colours = ScalarMappable(shown.norm, sequential())
    pixels = colours.to_rgba(np.ma.masked_invalid(shown.values))
    pixels[~np.isfinite(shown.values)] = mpl.colors.to_rgba(_NOTHING)
    pixels[inspection.walls] = mpl.colors.to_rgba(_WALL)
    # One image, not a square for each cell: large grids stay small files, and no hairlines show between cells.
    axes.imshow(pixels.reshape(rows, columns, 4), interpolation="none", aspect="auto")
    axes.set_box_aspect(cell.down * rows / (cell.across * columns))
    if ticks and min(cell) >= _LINES_FROM:
        axes.hlines(np.arange(rows - 1) + 0.5, -0.5, columns - 0.5, color="0.55", linewidth=0.4)
        axes.vlines(np.arange(columns - 1) + 0.5, -0.5, rows - 0.5, color="0.55", linewidth=0.4)
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5), xticks=[], yticks=[])
    if ticks:
        axes.set(xticks=counting_ticks(columns), yticks=counting_ticks(rows), xlabel="column", ylabel="row")
    axes.tick_params(length=2)
    axes.spines[:].set(visible=True, color=_EDGE)
    axes.set_title(shown.title, loc="left", fontsize=9 if ticks else 8)
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
            place: dict[str, Any] = {"ha": "center", "va": "center_baseline", "in_layout": False}
            axes.text(column, row, words(values[row, column]), color=shade, fontsize=8, **place)
    return image


def counting_ticks(n: int) -> IntArray:
    """Return the numbers of some of `n` things, counted from 0: round ones, at most ten."""
    step = next(round_ * 10**power for power in range(12) for round_ in (1, 2, 5) if n <= 10 * round_ * 10**power)
    return np.arange(0, n, step)


def colour_bar(axes: Axes | list[Axes], colours: ScalarMappable, label: str, **more: Any) -> Axes:
    """Draw a bar right of axes and return its own."""
    figure = (axes[0] if isinstance(axes, list) else axes).get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    bar = figure.colorbar(colours, ax=axes, label=label, aspect=18, pad=0.02, **more)
    bar.outline.set_visible(False)
    bar.ax.tick_params(length=2)
    return bar.ax


def with_legend(figure: Figure, entries: Sequence[Artist]) -> Figure:
    """Return the figure with a legend under everything, if there are entries."""
    if entries:
        figure.legend(handles=list(entries), loc="outside lower left", ncols=5, frameon=False, handlelength=1.2)
    return figure


def where(state: int, layout: Layout | None) -> str:
    """Return a state in words: its cell where it has one."""
    if layout is None:
        return f"state {state}"
    return f"row {state // layout[1]}, column {state % layout[1]}"
