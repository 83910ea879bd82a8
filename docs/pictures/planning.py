"""Draw the pictures of the learners that plan: ``python -m docs.pictures.planning`` writes them beside this file.

What they show is computed, on the book's own problems, as the tests hold them (`tests/learners/book_problems.py`).
"""

import warnings
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import ScalarFormatter
from tests.learners.book_problems import dyna_maze, shortcut_maze

import tuckerl
from tuckerl.errors import StepCapWarning
from tuckerl.reports.styles import ACTION_STYLES, TEXT, LineStyle

HERE = Path(__file__).parent


def save(figure: plt.Figure, name: str) -> None:
    """Write a picture whose bytes depend on nothing but what it shows."""
    figure.savefig(HERE / f"{name}.png", dpi=130, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def line(axes: Axes, x: np.ndarray, y: np.ndarray, style: LineStyle, label: str, every: int) -> None:
    """Draw a line that dash, marker and width tell from others, too."""
    looks = {"color": style.colour, "linestyle": style.dash, "marker": style.marker, "linewidth": style.width}
    axes.plot(x, y, **looks, markevery=every, markersize=5, label=label)


def plain(axes: Axes, x: str, y: str) -> None:
    """Name the axes and take the frame away."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, labelcolor=TEXT)


def draw_dyna_q() -> None:
    """Draw figure 8.2: steps per episode with 0, 5 and 50 planning steps, means of 30 agents."""
    figure, axes = plt.subplots(figsize=(6.6, 3.4))
    for n, style in zip((0, 5, 50), ACTION_STYLES, strict=False):
        agents = tuckerl.DynaQ(dyna_maze(), planning_steps=n, n_agents=30, seed=1).learn(40)
        label = "no planning (Q-learning)" if n == 0 else f"{n} planning steps"
        line(axes, np.arange(2, 41), agents.steps.mean(axis=1)[1:], style, label, 3)
    axes.axhline(14, color="0.6", linewidth=1)
    axes.annotate(
        "shortest way: 14", (40, 14), (0, -11), textcoords="offset points", ha="right", color=TEXT, fontsize=8
    )
    axes.set_yscale("log")
    axes.set_yticks([10, 20, 50, 100, 200, 500], labels=["10", "20", "50", "100", "200", "500"])
    axes.yaxis.set_minor_formatter(ScalarFormatter())
    axes.minorticks_off()
    axes.set_ylim(9, None)
    plain(axes, "episode, from the second on", "steps")
    save(figure, "dyna-q")


def draw_dyna_q_plus() -> None:
    """Draw figure 8.5: cumulative reward in the shortcut maze, means of 10 agents."""
    figure, axes = plt.subplots(figsize=(6.6, 3.4))
    steps = np.arange(6001)
    drawn: tuple[tuple[Any, dict[str, float], str], ...] = (
        (tuckerl.DynaQ, {}, "Dyna-Q"),
        (tuckerl.DynaQPlus, {"kappa": 1e-3}, "Dyna-Q+"),
    )
    for (kind, own, label), style in zip(drawn, ACTION_STYLES, strict=False):
        totals = []
        for seed in range(10):
            agent = kind(shortcut_maze(), planning_steps=50, alpha=1.0, seed=seed, **own).learn(steps=6000)
            totals.append(np.searchsorted(agent.steps[:, 0].cumsum(), steps, side="right"))
        line(axes, steps, np.mean(totals, axis=0), style, label, 500)
    axes.axvline(3000, color="0.6", linewidth=1)
    axes.annotate("a shorter way opens", (3000, 20), (5, 0), textcoords="offset points", color=TEXT, fontsize=8)
    plain(axes, "step", "cumulative reward")
    save(figure, "dyna-q-plus")


if __name__ == "__main__":
    warnings.simplefilter("ignore", StepCapWarning)
    draw_dyna_q()
    draw_dyna_q_plus()
