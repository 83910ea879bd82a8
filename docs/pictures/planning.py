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
from tests.learners.book_problems import dyna_maze, greedy_length, river_swim, shortcut_maze, shortest_path
from tests.learners.worlds import prioritized_sweeping_twin
from tests.reference.value_iteration import average_reward, model_of

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


SEEDS = 5


def updates_until_short(scale: int) -> tuple[list[int], list[int]]:
    """Return how many updates each seed's Dyna-Q and prioritized sweeping need until a short way is found."""
    problem = dyna_maze(scale)
    settings: dict[str, Any] = {"alpha": 0.5}
    enough = int(1.2 * shortest_path(problem))
    plain, sweeping = [], []
    for seed in range(SEEDS):
        learner = tuckerl.DynaQ(problem, planning_steps=4, seed=seed, **settings)
        while greedy_length(problem, learner.q[0], enough + 1) > enough:
            learner.learn(1)
        plain.append(5 * int(learner.steps.sum()))
        slow = prioritized_sweeping_twin(problem, planning_steps=5, seed=seed, **settings)  # the tests' twin: it counts
        while greedy_length(problem, slow.q, enough + 1) > enough:
            slow.episode(np.ones(problem.n_actions))
        sweeping.append(slow.n_updates)
    return plain, sweeping


def draw_prioritized_sweeping() -> None:
    """Draw example 8.4: updates until a short way is found, in mazes of more and more cells."""
    figure, axes = plt.subplots(figsize=(6.6, 3.4))
    scales = (1, 2, 3)
    n_states = np.array([dyna_maze(scale).n_states for scale in scales])
    found = np.array([updates_until_short(scale) for scale in scales])  # (scale, learner, seed)
    for number, label in enumerate(("Dyna-Q", "Prioritized sweeping")):
        style = ACTION_STYLES[number]
        line(axes, n_states, np.median(found[:, number], axis=1), style, label, 1)
        shifted = np.repeat(n_states[:, None] * (0.97, 1.03)[number], SEEDS, axis=1)
        axes.plot(shifted, found[:, number], style.marker, color=style.colour, markersize=3, alpha=0.5)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(n_states, labels=[str(n) for n in n_states])
    axes.set_yticks([1e3, 1e4, 1e5], labels=["1,000", "10,000", "100,000"])
    axes.minorticks_off()
    plain(axes, "states", "updates")
    save(figure, "prioritized-sweeping")


def draw_r_max() -> None:
    """Draw what R-max and two others earn in RiverSwim, means of 20 agents."""
    figure, axes = plt.subplots(figsize=(6.6, 3.4))
    problem, steps, episodes = river_swim(steps=500), 500, 40
    agents: dict[str, Any] = {
        "R-max, m = 20": tuckerl.RMax(problem, m=20, n_agents=20, seed=0),
        "Q-learning, optimistic": tuckerl.QLearning(problem, initial_q=200_000.0, n_agents=20, seed=0),
        "Q-learning": tuckerl.QLearning(problem, n_agents=20, seed=0),
    }
    for (label, agent), style in zip(agents.items(), ACTION_STYLES, strict=False):
        earned = agent.learn(episodes).returns.mean(axis=1) / steps
        line(axes, steps * np.arange(1, episodes + 1), earned, style, label, 3)
    model = model_of(problem)
    best = average_reward(model, np.ones(6, dtype=np.int64))
    axes.axhline(best, color="0.6", linewidth=1)
    axes.annotate(f"the best: {best:.0f}", (20_900, best), va="center", color=TEXT, fontsize=8, annotation_clip=False)
    axes.set_ylim(-20, 760)
    axes.set_xlim(0, 20_800)
    plain(axes, "step", "reward per step")
    axes.legend(frameon=False, labelcolor=TEXT, loc="lower right", bbox_to_anchor=(1.0, 0.06))
    save(figure, "r-max")


if __name__ == "__main__":
    warnings.simplefilter("ignore", StepCapWarning)
    draw_dyna_q()
    draw_dyna_q_plus()
    draw_prioritized_sweeping()
    draw_r_max()
