"""How variants look, in every figure alike: they differ in dash and marker as well as in colour.

Colours are Okabe and Ito's, safe for the colour-blind. A colour says how many agents there are and what they copy,
a dash which weights: a T-version is solid and bold, a control thin and dashed or dotted in the colour of the T-version
that it belongs to.
"""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Transform
from scipy.optimize import isotonic_regression

from tuckerl.studies.study import Scenario, Variant
from tuckerl.types import FloatArray, IntArray

BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
PURPLE, ORANGE, SKY = "#CC79A7", "#E69F00", "#56B4E9"
COLOUR_NAMES = dict(
    zip(
        (BLACK, BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY),
        ("black", "blue", "vermillion", "green", "purple", "orange", "sky"),
        strict=True,
    )
)
"""What pages call the colours: on a dark screen they have lighter ones of the same hue."""

_COLOURS = {1: BLUE, 2: GREEN, 3: VERMILLION}
_SPARE = (PURPLE, ORANGE, SKY, GREEN)
_MARKERS = {1: "o", 2: "^", 3: "s"}
_DASHES = {"paper": "solid", "constant": "dashed", "permuted": "dotted"}
_OTHER_DASH = "dashdot"

TEXT = "0.1"  # not the line's colour, which can be too pale for letters
LABEL_SIZE = 8.0
LABEL_GAP = 1.25 * LABEL_SIZE


class LineStyle(NamedTuple):
    """The look of a line."""

    colour: str
    dash: str
    marker: str  # "" for none
    width: float


# Told apart by dash, marker and width as well, for they come to lie on one another.
ACTION_STYLES = (
    LineStyle(BLUE, "solid", "o", 2.4),
    LineStyle(VERMILLION, "solid", "s", 1.5),
    LineStyle(GREEN, "dashed", "^", 1.4),
    LineStyle(PURPLE, "solid", "D", 1.5),
    LineStyle(ORANGE, "dashdot", "v", 1.5),
    LineStyle(SKY, "dotted", "P", 1.8),
)
"""The looks of the actions' lines, where there are no more of them."""


class EndLabel(NamedTuple):
    """The name of a line, to be written at its right end."""

    text: str
    y: float
    colour: str


def line_styles(scenario: Scenario) -> dict[str, LineStyle]:
    """Return every variant's look."""
    seen: dict[tuple[str, int], int] = {}
    chosen = {}
    for variant in scenario.variants:
        kind = _kind(variant)
        place = seen.get((kind, variant.n_agents), 0)
        seen[kind, variant.n_agents] = place + 1
        chosen[variant.name] = _look(kind, variant.n_agents, place)
    return chosen


def _kind(variant: Variant) -> str:
    if variant.tensor_step is None:
        return "base"
    weights = variant.tensor_step.weights
    return weights if isinstance(weights, str) else "own"


def _look(kind: str, n_agents: int, place: int) -> LineStyle:
    """Return a look; `place` counts the variants before of the same kind and number of agents."""
    if kind == "base" and place == 0:
        return LineStyle(BLACK, "solid", "", 1.9)
    own = _COLOURS.get(n_agents, SKY)
    colour = own if place == 0 else _SPARE[(place - 1) % len(_SPARE)]
    bold = kind in ("paper", "base")
    marker = _MARKERS.get(n_agents, "D") if bold else ""
    return LineStyle(colour, _DASHES.get(kind, _OTHER_DASH), marker, 1.8 if bold else 1.2)


def plot_line(axes: Axes, x: FloatArray | IntArray, y: FloatArray, look: LineStyle, **more: Any) -> None:
    """Draw a line by its look, its markers edged in white so that they show on other lines."""
    edges: dict[str, Any] = {"linewidth": look.width, "markeredgecolor": "white", "markeredgewidth": 0.6}
    axes.plot(x, y, color=look.colour, linestyle=look.dash, marker=look.marker, **edges, **more)


def count_episodes(axes: Axes, last: int, n_ticks: int = 10) -> None:
    """Let the axis count the episodes finished, from 0 to the last."""
    axes.set_xlim(0, last)
    axes.xaxis.set_major_locator(MaxNLocator(n_ticks, integer=True))
    axes.set_xlabel("episodes finished")


def write(axes: Axes, x: float, y: float, text: str, transform: Transform, **more: Any) -> None:
    """Write small letters, as they are, at a place that `transform` gives a meaning."""
    letters: dict[str, Any] = {"fontsize": LABEL_SIZE, "verticalalignment": "center"}
    axes.text(x, y, text, transform=transform, parse_math=False, **letters | more)


def label_ends(axes: Axes, labels: list[EndLabel]) -> None:
    """Write the labels right of the axes, moved apart where they would overlap, each joined to its line's end.

    To be called when the limits of `axes` are final, and all but such labels is drawn.
    """
    finite = sorted((label for label in labels if np.isfinite(label.y)), key=lambda label: label.y)
    if not finite:
        return
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)  # which finds the height of the axes
    low, high = axes.get_ylim()
    points = axes.get_position().height * figure.get_size_inches()[1] * 72
    steps = LABEL_GAP / points * np.arange(len(finite))
    ends = (np.array([label.y for label in finite]) - low) / (high - low)
    # The nearest heights that keep their order and distance: a regression without decrease of what is left of them.
    heights = np.clip(isotonic_regression(ends - steps).x, 0, max(1 - steps[-1], 0)) + steps
    for label, end, height in zip(finite, ends, heights, strict=True):
        line = axes.plot([1.0, 1.03], [end, height], color=label.colour, linewidth=1, transform=axes.transAxes)[0]
        line.set_clip_on(False)
        write(axes, 1.04, height, label.text, axes.transAxes, color=TEXT)
