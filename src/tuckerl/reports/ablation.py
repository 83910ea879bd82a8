"""Where the gain comes from: every step from the base to the whole method as a dot with its interval, and in words."""

import math
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.styles import BLUE, GREEN, VERMILLION, write
from tuckerl.reports.text import amount, amount_interval, counted, tick
from tuckerl.studies.ablation import Ablation, AblationStep
from tuckerl.studies.figure_text import FigureText
from tuckerl.studies.statistics import MEASURES

_ROW, _ABOVE_AND_BELOW = 0.27, 0.69  # inches


class Mark(NamedTuple):
    """The look of a kind of step."""

    colour: str
    marker: str


CHAIN, SHARING, SLOW = Mark(BLUE, "o"), Mark(VERMILLION, "s"), Mark(GREEN, "D")


def draw_ablation(ablation: Ablation) -> Figure:
    """Draw the difference of every step's variant to the base, the base's own place being the line at 0."""
    n = len(ablation.steps)
    figure = Figure(figsize=(WIDTH, _ROW * n + _ABOVE_AND_BELOW), layout="constrained")
    axes = figure.subplots()
    axes.set_ylim(n - 0.5, -0.5)
    axes.axvline(0, color="0.3", linewidth=1, zorder=1)
    for place, one in enumerate(ablation.steps):
        _draw_row(axes, place, one, mark_of(ablation, one))
        if place and mark_of(ablation, ablation.steps[place - 1]) != mark_of(ablation, one):
            axes.axhline(place - 0.5, color="0.8", linewidth=0.7, zorder=0)
    axes.set_yticks(range(n), [one.label for one in ablation.steps], parse_math=False)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: tick(value)))
    unit = "% of its mean"
    if not all(one.difference.relative for one in ablation.steps):
        unit = MEASURES[ablation.scenario.measure].text
        axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel(f"better than {ablation.scenario.algorithm.base} by ({unit})", parse_math=False)
    axes.margins(x=0.06)
    write(axes, 1.04, 1.02, "pairs", axes.transAxes, verticalalignment="bottom")
    look = {"horizontalalignment": "center", "verticalalignment": "bottom"}
    write(axes, 0, 1.02, ablation.scenario.algorithm.base, axes.get_xaxis_transform(), **look)
    return figure


def mark_of(ablation: Ablation, step: AblationStep) -> Mark:
    """Return the look of a step's kind: one more on the chain, a way of sharing, or a slower base."""
    made = ablation.variant_of(step)
    if made.tensor_step is None:
        return SLOW
    return CHAIN if made.n_agents == 1 else SHARING


def _draw_row(axes: Axes, place: int, one: AblationStep, mark: Mark) -> None:
    scale = 100 if one.difference.relative else 1
    mean, low, high = (scale * value for value in one.difference[:3])
    decided = one.difference.verdict != "not decided"
    if not math.isnan(low):
        axes.plot([low, high], [place, place], color=mark.colour, linewidth=1.6, solid_capstyle="butt")
    if math.isnan(mean):
        axes.annotate("no pair left", (0, place), (4, 0), textcoords="offset points", fontsize=8, va="center")
    else:
        face = mark.colour if decided else "white"
        look = {"marker": mark.marker, "markersize": 6, "markeredgewidth": 1.3, "markerfacecolor": face}
        axes.plot([mean], [place], color=mark.colour, **look)  # type: ignore[arg-type]  # of several types
    lost = one.difference.n_diverged
    pairs = f"{one.difference.n_pairs}" + (f" ({lost} lost)" if lost else "")
    write(axes, 1.04, place, pairs, axes.get_yaxis_transform())


def _text(ablation: Ablation) -> FigureText:
    return FigureText(f"ablation-{ablation.scenario.name}", f"{ablation.scenario.title}: the gain taken apart")


def _caption(ablation: Ablation) -> str:
    scenario = ablation.scenario
    runs, instances = counted(scenario.n_runs, "run"), counted(scenario.n_instances, "instance")
    lost = any(one.difference.n_diverged for one in ablation.steps)
    kinds = {mark_of(ablation, one) for one in ablation.steps}
    words = [
        f"How much better than {scenario.algorithm.base} each variant does, with the 95 % interval over pairs ({runs} "
        f"of {instances}, from the same seeds as above); filled where the interval excludes 0, hollow where it covers "
        "0. Circles: one ingredient more at a time."
    ]
    if SHARING in kinds:
        words.append("Squares: the whole method with several agents, by the rule that says whose table is copied.")
    if SLOW in kinds:
        words.append(
            "Diamond: the base with the smaller learning rate from the first episode on, without any tensor step."
        )
    return " ".join(words) + (" Lost: pairs left out because one of their runs diverged." if lost else "")


def _alt(ablation: Ablation) -> str:
    ends = ", ".join(f"{one.label} {amount(one.difference)}" for one in ablation.steps)
    return f"Dots with intervals, one for each step: {ends}."


ABLATION = FigureSpec(Ablation, _text, draw_ablation, _caption, _alt)


def what_works(ablation: Ablation) -> str:
    """Say which steps add a gain, by the intervals of what each adds to the variant that it is added to."""
    steps = [one for one in ablation.steps if ablation.variant_of(one).tensor_step is not None]
    steps = sorted(steps, key=lambda one: -one.added.mean)
    known = [one for one in steps if not math.isnan(one.added.low)]
    helping = [_with_number(one) + _beside_the_base(ablation, one) for one in known if one.added.low > 0]
    harming = [_with_number(one) for one in reversed(known) if one.added.high < 0]
    if not known:
        return "Which ingredient does the work cannot be told: no step has enough pairs for an interval."
    text = "No ingredient adds a gain whose whole interval lies above 0"
    if helping:
        text = f"By the intervals of each step over the one before it, the work is done by: {_listed(helping)}"
    if harming:
        text += f". Worse than the step before: {_listed(harming)}"
    open_ones, unknown = len(known) - len(helping) - len(harming), len(steps) - len(known)
    if open_ones:
        text += f". The interval covers 0 for {counted(open_ones, 'other step')}"
    if unknown:
        text += f". Too few pairs are left for {counted(unknown, 'step')}"
    return text + "."


def without_the_step(ablation: Ablation) -> str:
    """Say what the smaller learning rate does on its own, where that was run."""
    slow = next((one for one in ablation.steps if ablation.variant_of(one).tensor_step is None), None)
    if slow is None or math.isnan(slow.difference.low):
        return ""
    rate = f"{amount(slow.difference)} {amount_interval(slow.difference)}"
    return f"The smaller learning rate alone, from the first episode on and without any tensor step: {rate}."


def _with_number(one: AblationStep) -> str:
    label = one.label.removeprefix("+ ")
    return f"{label} ({amount(one.added)} {amount_interval(one.added)} over {one.before})"


def _beside_the_base(ablation: Ablation, one: AblationStep) -> str:
    """Say so where a gain over the step before only makes good what that step has spoilt."""
    base = ablation.scenario.algorithm.base
    if one.difference.high < 0:
        return f", though still worse than {base}"
    return "" if one.difference.low > 0 else f", though not better than {base} as far as these runs can tell"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{'; '.join(parts[:-1])}; and {parts[-1]}"
