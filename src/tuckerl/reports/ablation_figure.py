"""Where the gain comes from: every step from the base to the whole method as a dot with its interval."""

import math
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from tuckerl.reports import text as wording
from tuckerl.reports.picture import Shown, render
from tuckerl.reports.styles import BLACK, BLUE, GREEN, VERMILLION
from tuckerl.studies.ablation import Ablation, AblationStep
from tuckerl.studies.study import Scenario

_ROW = 0.27  # inches


class Mark(NamedTuple):
    """How a kind of ingredient is drawn."""

    colour: str
    marker: str


CHAIN, SHARING, SLOW = Mark(BLUE, "o"), Mark(VERMILLION, "s"), Mark(GREEN, "D")


def show_gain(gain: Ablation) -> Shown:
    """Draw a scenario's gain, taken apart."""
    scenario = gain.scenario
    ends = ", ".join(f"{one.label} {wording.percent(one.difference)}" for one in gain.ingredients)
    return Shown(
        f"gain-{scenario.name}",
        f"{scenario.title}: the gain taken apart",
        _caption(gain),
        f"Dots with intervals, one for each ingredient: {ends}.",
        render(lambda: draw_gain(gain)),
    )


def draw_gain(gain: Ablation) -> Figure:
    """Draw the difference of every ingredient's variant to the base, the base's own place being the line at 0."""
    n = len(gain.ingredients)
    height = _ROW * n + 0.45 + 0.24  # inches: rows, what stands below and above them
    figure = Figure(figsize=(6.9, height))
    axes = figure.add_axes((0.31, 0.45 / height, 0.53, _ROW * n / height))
    axes.set_ylim(n - 0.5, -0.5)
    axes.axvline(0, color="0.3", linewidth=1, zorder=1)
    for place, one in enumerate(gain.ingredients):
        _draw_row(axes, place, one, mark_of(gain.scenario, one))
        if place and mark_of(gain.scenario, gain.ingredients[place - 1]) != mark_of(gain.scenario, one):
            axes.axhline(place - 0.5, color="0.8", linewidth=0.7, zorder=0)
    axes.set_yticks(range(n), [one.label for one in gain.ingredients], parse_math=False)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: wording.tick(value)))
    axes.set_xlabel(f"better than {gain.scenario.family.base} by (% of its mean)", parse_math=False)
    axes.margins(x=0.06)
    axes.text(1.04, 1.02, "pairs", fontsize=8, transform=axes.transAxes, verticalalignment="bottom")
    axes.text(
        0,
        1.02,
        gain.scenario.family.base,
        fontsize=8,
        transform=axes.get_xaxis_transform(),
        horizontalalignment="center",
        verticalalignment="bottom",
        parse_math=False,
    )
    return figure


def mark_of(scenario: Scenario, ingredient: AblationStep) -> Mark:
    """Return the look of an ingredient's kind: one more on the chain, a way of sharing, or a slower base."""
    made = next(variant for variant in scenario.variants if variant.name == ingredient.variant)
    if made.tensor_step is None:
        return SLOW
    return CHAIN if made.n_agents == 1 else SHARING


def _draw_row(axes: Axes, place: int, one: AblationStep, mark: Mark) -> None:
    mean, low, high = (100 * value for value in one.difference[:3])
    decided = one.difference.verdict != "not decided"
    if not math.isnan(low):
        axes.plot([low, high], [place, place], color=mark.colour, linewidth=1.6, solid_capstyle="butt")
    if math.isnan(mean):
        axes.annotate("no pair left", (0, place), (4, 0), textcoords="offset points", fontsize=8, va="center")
    else:
        axes.plot(
            [mean],
            [place],
            marker=mark.marker,
            color=mark.colour,
            markersize=6,
            markeredgewidth=1.3,
            markerfacecolor=mark.colour if decided else "white",
        )
    lost = one.difference.n_diverged
    axes.text(
        1.04,
        place,
        f"{one.difference.n_pairs}" + (f" ({lost} lost)" if lost else ""),
        color=BLACK,
        fontsize=8,
        verticalalignment="center",
        transform=axes.get_yaxis_transform(),
    )


def _caption(gain: Ablation) -> str:
    scenario = gain.scenario
    runs, instances = wording.counted(scenario.n_runs, "run"), wording.counted(scenario.n_instances, "instance")
    lost = any(one.difference.n_diverged for one in gain.ingredients)
    return (
        f"How much better than {scenario.family.base} each variant does, with the 95 % interval over pairs ({runs} of "
        f"{instances}, from the same seeds as above); filled where the interval excludes 0, hollow where it covers 0. "
        "Circles: one ingredient more at a time. Squares: the whole method with several agents, by the rule that says "
        "whose table is copied. Diamond: the base with the smaller learning rate from the first episode on, without "
        "any tensor step." + (" Lost: pairs left out because one of their runs diverged." if lost else "")
    )
