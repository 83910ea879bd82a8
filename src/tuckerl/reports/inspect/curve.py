"""The learning curve: steps and return of each episode, and a running mean."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.styles import BLUE
from tuckerl.reports.text import counted, number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

_PART = 20  # a running mean spans this part of all episodes, within
_SHORTEST, _LONGEST = 5, 100
_POINTS = 600  # of a line


def window_of(n_episodes: int) -> int:
    """Return over how many episodes the running mean is taken: a twentieth of all, 5 to 100, but no more than all."""
    return max(1, min(n_episodes, _LONGEST, max(_SHORTEST, n_episodes // _PART)))


def running_mean(values: FloatArray, window: int) -> FloatArray:
    """Return the mean over each `window` rows up to and with each from the window-th on: (E - window + 1, ...)."""
    views = np.lib.stride_tricks.sliding_window_view(values, window, axis=0)
    mean: FloatArray = views.mean(axis=-1)
    return mean


def draw_curve(inspection: Inspection) -> Figure:
    """Draw steps and returns beside one another."""
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    steps, returns = figure.subplots(1, 2)
    _draw_panel(steps, inspection.steps.astype(np.float64), "steps")
    _draw_panel(returns, inspection.returns, "return (undiscounted)")
    figure.legend(*steps.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)
    return figure


def blocks(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the means of (E,) numbers over blocks of equally many episodes, and the episode that each is drawn at.

    One block holds one episode, unless there are more than are drawn; the last can be shorter.
    """
    size = block_of(len(values))
    begins = np.arange(0, len(values), size)
    counts = np.diff(np.append(begins, len(values)))
    return begins + (counts + 1) / 2, np.add.reduceat(values, begins) / counts


def block_of(n_episodes: int) -> int:
    """Return how many episodes a point of the grey line stands for."""
    return -(-n_episodes // _POINTS)


def _draw_panel(axes: Axes, values: FloatArray, label: str) -> None:
    n_episodes, n_agents = values.shape
    window, size = window_of(n_episodes), block_of(n_episodes)
    smooth = running_mean(values, window)[::-1][::size][::-1]
    episode = np.arange(window, n_episodes + 1)[::-1][::size][::-1]
    at, means = blocks(values.mean(axis=1))
    name = "each episode" if size == 1 else f"mean of each {size} episodes"
    agents = "" if n_agents == 1 else f", {n_agents} agents"
    axes.plot(at, means, color="0.68", linewidth=0.7, marker="o" if n_episodes == 1 else "", label=f"{name}{agents}")
    if n_agents > 1 and window > 1:
        low, high = smooth.min(axis=1), smooth.max(axis=1)
        axes.fill_between(
            episode, low, high, color=BLUE, alpha=0.35, linewidth=0, zorder=2.1, label="lowest to highest agent"
        )
    if window > 1:
        mean_name = f"running mean, {window} episodes"
        axes.plot(episode, smooth.mean(axis=1), color=BLUE, linewidth=1.6, zorder=2.2, label=mean_name)
    axes.set_xlim(min(1, n_episodes - 1), n_episodes if n_episodes > 1 else 2)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.set_xlabel("episode")
    axes.set_title(label, loc="left")


def _ends(values: FloatArray | IntArray) -> str:
    window = window_of(len(values))
    smooth = running_mean(np.asarray(values, dtype=np.float64), window).mean(axis=1)
    return f"{number(float(smooth[0]))} over the first and {number(float(smooth[-1]))} over the last"


def _caption(inspection: Inspection) -> str:
    window = window_of(len(inspection.steps))
    agents = f", {inspection.n_agents} agents averaged" if inspection.n_agents > 1 else ""
    text = f"{counted(len(inspection.steps), 'episode')} of learning, exploration included{agents}"
    if window > 1:
        text += (
            f". Grey: {_grey(len(inspection.steps))}. Blue: the mean of the {window} episodes up to and with each, "
            f"drawn from episode {window} on"
        )
    if window > 1 and inspection.n_agents > 1:
        text += "; shaded, from the lowest to the highest agent's such mean (a range, no interval of confidence)"
    means = counted(window, "episode")
    return f"{text}. Mean steps: {_ends(inspection.steps)} {means}; mean return: {_ends(inspection.returns)}."


def _grey(n_episodes: int) -> str:
    size = block_of(n_episodes)
    return "each episode" if size == 1 else f"the mean of each {size} episodes"


def _alt(inspection: Inspection) -> str:
    means = counted(window_of(len(inspection.steps)), "episode")
    return (
        f"Curves of steps and return by episode. Mean steps are {_ends(inspection.steps)} {means}, the mean return "
        f"{_ends(inspection.returns)}."
    )


CURVE = FigureSpec(
    Inspection,
    FigureText("learning-curve", "Learning curve"),
    draw_curve,
    _caption,
    _alt,
    applies=lambda one: len(one.steps) > 0,
)
