"""The claims under other readings of the paper, as a map of effect sizes."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import FuncNorm, LinearSegmentedColormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FuncFormatter

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.styles import BLACK
from tuckerl.reports.text import amount, signed, tick
from tuckerl.studies.figure_text import FigureText
from tuckerl.studies.sensitivity import DEFAULT, Cell, Sensitivity
from tuckerl.studies.statistics import Difference
from tuckerl.types import FloatArray

# Orange against blue keeps apart for every colour-blindness; in grey, where both ends darken, the printed sign and
# the verdict's triangle tell them apart. The ends are pale enough for black letters.
COLOURS = LinearSegmentedColormap.from_list("orange-blue", ["#d97f2e", "#f2c394", "#fafafa", "#a5c9e4", "#4f95c9"])
LIMITS = (0.04, 0.16, 0.36, 1.0)  # of the colour scale: the first that nine tenths of the cells keep to

VERDICT_MARKERS = {"holds": "^", "does not hold": "v", "not decided": "o"}
_EMPTY: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.75", "hatch": "////"}  # the look of a cell without one
_ROW, _HEADER, _BELOW = 0.4, 1.16, 0.9  # inches
_LETTERS = 8.5  # points: 8 when the page is printed on A4, which is a little narrower than the figure


def draw_sensitivity(sensitivity: Sensitivity) -> Figure:
    """Draw one panel for each scenario: claims down, readings across."""
    cells = sensitivity.cells
    groups = {name: [c for c in cells if c.scenario == name] for name in dict.fromkeys(c.scenario for c in cells)}
    rows = [len({cell.claim.id for cell in group}) for group in groups.values()]
    figure = Figure(figsize=(WIDTH, sum(rows) * _ROW + len(groups) * _HEADER + _BELOW), layout="constrained")
    limit = _limit(cells)
    norm = FuncNorm((_root, _square), -limit, limit)  # effects of a percent and of a hundred are both to be seen
    most = max(len({cell.alternative for cell in group}) for group in groups.values())
    panels = figure.subplots(len(rows), height_ratios=rows, squeeze=False)[:, 0].tolist()
    for axes, group in zip(panels, groups.values(), strict=True):
        _draw_panel(axes, sensitivity, group, norm)
        axes.set_xlim(-0.5, most - 0.5)  # cells of all panels are alike
    _draw_keys(figure, panels, norm, with_empty=any(math.isnan(cell.claim.difference.mean) for cell in cells))
    return figure


def _limit(cells: Sequence[Cell]) -> float:
    sizes = [abs(_effect(cell.claim.difference)) for cell in cells if not math.isnan(cell.claim.difference.mean)]
    reached = float(np.quantile(sizes, 0.9)) if sizes else 0.0
    return next((limit for limit in LIMITS if limit >= reached), LIMITS[-1])


def _effect(difference: Difference) -> float:
    """Return the part of the base's mean that gives a cell its colour; 0 in another unit."""
    return difference.mean if difference.relative else 0.0


def _root(values: FloatArray) -> FloatArray:
    return np.sign(values) * np.sqrt(np.abs(values))


def _square(values: FloatArray) -> FloatArray:
    return np.sign(values) * np.asarray(values) ** 2


def _draw_panel(axes: Axes, sensitivity: Sensitivity, cells: Sequence[Cell], norm: Normalize) -> None:
    claims = list(dict.fromkeys(cell.claim.id for cell in cells))
    alternatives = list(dict.fromkeys(cell.alternative for cell in cells))
    axes.set_ylim(len(claims) - 0.5, -0.5)
    for cell in cells:
        x, y = alternatives.index(cell.alternative), claims.index(cell.claim.id)
        _draw_cell(axes, cell, (x, y), norm)
        if sensitivity.is_changed(cell):
            # Inside the cell: the frames of neighbours stay two.
            corner = (x - 0.45, y - 0.44)
            axes.add_patch(Rectangle(corner, 0.9, 0.88, fill=False, edgecolor=BLACK, linewidth=2, zorder=4))
    axes.set_yticks(range(len(claims)), claims, fontweight="bold")
    axes.xaxis.tick_top()
    axes.set_xticks(
        range(len(alternatives)), alternatives, rotation=32, ha="left", rotation_mode="anchor", fontsize=_LETTERS
    )
    axes.tick_params(length=0)
    axes.tick_params(axis="x", pad=2)
    axes.spines[:].set_visible(False)
    axes.set_title(cells[0].scenario, loc="left", fontweight="bold")


def _draw_cell(axes: Axes, cell: Cell, place: tuple[int, int], norm: Normalize) -> None:
    x, y = place
    difference = cell.claim.difference
    look = _EMPTY
    behind: dict[str, Any] | None = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    if not math.isnan(difference.mean):
        look, behind = {"facecolor": to_rgb(COLOURS(norm(_effect(difference)))[:3]), "edgecolor": "white"}, None
        marker = VERDICT_MARKERS.get(cell.claim.verdict, "o")
        face = "white" if marker == "o" else BLACK
        axes.plot(x, y + 0.27, marker, markersize=4.2, markerfacecolor=face, markeredgecolor=BLACK, markeredgewidth=0.8)
    axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, linewidth=1.2, **look))
    middle: dict[str, Any] = {"horizontalalignment": "center", "verticalalignment": "center"}
    axes.text(x, y - 0.14, cell_words(cell), fontsize=_LETTERS, color=BLACK, bbox=behind, **middle)


def cell_words(cell: Cell) -> str:
    """Return the number of a cell, or why it has none."""
    difference = cell.claim.difference
    if math.isnan(difference.mean):
        return "diverged" if difference.n_diverged else "no pairs"
    return f"{signed(100 * difference.mean)} %" if difference.relative else amount(difference)


def _draw_keys(figure: Figure, panels: list[Axes], norm: Normalize, *, with_empty: bool) -> None:
    place: dict[str, Any] = {"location": "bottom", "anchor": (0.0, 0.0), "shrink": 0.4, "aspect": 22}
    bar = figure.colorbar(ScalarMappable(norm, COLOURS), ax=panels, extend="both", **place)
    bar.ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: tick(round(100 * value))))
    limit = float(norm.vmax or 1.0)
    bar.set_ticks([-limit, -limit / 4, 0, limit / 4, limit])
    bar.set_label("better than the base by (%, root scale)", fontsize=8, labelpad=1)
    dot = {"linestyle": "none", "markersize": 5, "markeredgecolor": BLACK, "markeredgewidth": 0.8}
    keys: list[Line2D | Patch] = [
        Line2D([], [], marker=marker, markerfacecolor="white" if marker == "o" else BLACK, label=verdict, **dot)  # type: ignore[arg-type]  # keywords of several types
        for verdict, marker in VERDICT_MARKERS.items()
    ]
    keys.append(Patch(facecolor="white", edgecolor=BLACK, linewidth=2, label=f"verdict other than {DEFAULT}"))
    if with_empty:
        keys.append(Patch(**_EMPTY, label="no pair left"))
    figure.legend(handles=keys, loc="outside lower left", ncols=len(keys), frameon=False, handletextpad=0.5)


def _caption(sensitivity: Sensitivity) -> str:
    plain = any(not cell.claim.difference.relative for cell in sensitivity.cells)
    return (
        "How much better the claim's candidate does than its base, in percent of the base's mean, when one thing "
        "is read otherwise (across; the first column is the default reading on the same few runs, so that its "
        "verdict can differ from the one above). The sign below a number is the verdict by its 95 % interval; a "
        "heavy frame marks another verdict than the default's. All are on the same seeds."
        + (" A number without a percent sign is in the unit of what is measured, and has no colour." if plain else "")
    )


def _alt(sensitivity: Sensitivity) -> str:
    changed = [f"{c.claim.id} with {c.alternative}" for c in sensitivity.cells if sensitivity.is_changed(c)]
    return "A table in colours, claims down and readings across. " + (
        f"Another verdict than the default's: {', '.join(changed)}." if changed else "No verdict changes."
    )


SENSITIVITY = FigureSpec(
    Sensitivity,
    FigureText("sensitivity", "The claims under other readings of the paper"),
    draw_sensitivity,
    _caption,
    _alt,
    applies=lambda one: bool(one.cells),
)
