"""Draw the pictures of four learners' pages: ``python -m docs.pictures.traces_and_averages [NAME ...]``.

Without names all are drawn. Lines differ in dash, marker and grey as well as in colour.
"""

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
import numpy as np
from matplotlib.axes import Axes
from tests.learners.average_reward import access_control, best_average, queue_chances

import tuckerl
from tuckerl.reports.styles import ACTION_STYLES

HERE = Path(__file__).parent


def save(figure: plt.Figure, name: str) -> None:
    """Write a picture whose bytes depend on nothing but what it shows."""
    figure.savefig(HERE / f"{name}.png", dpi=130, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def line(axes: Axes, x: Any, y: Any, number: int, label: str, every: int = 1) -> None:
    """Draw a line in the look of this number."""
    style = ACTION_STYLES[number]
    looks: dict[str, Any] = {"color": style.colour, "linestyle": style.dash, "linewidth": style.width}
    axes.plot(x, y, label=label, marker=style.marker, markevery=every, markersize=4.5, **looks)


def plain(axes: Axes, x: str, y: str) -> None:
    """Name the axes, and leave out the frame."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def draw_watkins() -> None:
    """Draw steps to the goal of Sutton's maze with no, cut and uncut traces."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    kinds: list[tuple[Any, dict[str, float], str]] = [
        (tuckerl.QLearning, {}, "Q-learning"),
        (tuckerl.WatkinsQLambda, {"lambda_": 0.9}, "Watkins' Q(λ)"),
        (tuckerl.SarsaLambda, {"lambda_": 0.9}, "SARSA(λ)"),
    ]
    for number, (kind, own, label) in enumerate(kinds):
        agent = kind(tuckerl.sutton_maze(), alpha=0.1, n_agents=50, seed=0, **own).learn(30)
        line(axes, np.arange(1, 31), agent.steps.mean(axis=1), number, label, every=3)
    axes.set_yscale("log")
    axes.set_yticks([30, 100, 300], ["30", "100", "300"])
    axes.minorticks_off()
    plain(axes, "episode", "steps to the goal")
    axes.legend(frameon=False, fontsize=8)
    save(figure, "watkins")


def random_walk() -> tuckerl.TabularMDP:
    """Return Sutton and Barto's random walk of 19 states (example 7.1)."""
    places = np.arange(19)
    there = np.stack([np.maximum(places - 1, 0), np.minimum(places + 1, 18)], axis=1)[:, None, :]
    rewards, ends = np.zeros((19, 1, 2)), np.zeros((19, 1, 2), dtype=np.bool_)
    rewards[0, 0, 0], rewards[18, 0, 1] = -1.0, 1.0
    ends[0, 0, 0] = ends[18, 0, 1] = True
    return tuckerl.TabularMDP(there, rewards, ends, np.full((19, 1, 2), 0.5), start=9)


def error(kind: Any, alpha: float, lambda_: float, **own: str) -> float:
    """Return the root mean square error over the first 10 episodes, the mean of 100 runs; infinite if one diverged."""
    agent = kind(random_walk(), alpha=alpha, gamma=1.0, lambda_=lambda_, n_agents=100, seed=0, **own)
    values, errors = (np.arange(19) - 9) / 10, []
    for _ in range(10):
        agent.learn(1)
        if agent.diverged_at is not None:
            return float("inf")
        errors.append(np.sqrt(((agent.q[:, :, 0] - values) ** 2).mean(axis=1)).mean())
    return float(np.mean(errors))


def draw_true_online() -> None:
    """Draw the random walk's error against alpha and lambda (Sutton and Barto, figures 12.6 and 12.8)."""
    warnings.simplefilter("ignore", tuckerl.errors.DivergenceWarning)
    figure, both = plt.subplots(1, 2, figsize=(8.4, 3.4), sharey=True, layout="constrained")
    alphas = np.array([0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    kinds: list[tuple[Any, dict[str, str], str]] = [
        (tuckerl.TrueOnlineSarsaLambda, {}, "true online"),
        (tuckerl.SarsaLambda, {"trace": "accumulating"}, "accumulating traces"),
    ]
    for axes, (kind, own, title) in zip(both, kinds, strict=True):
        for number, lambda_ in enumerate((0.0, 0.4, 0.8, 0.9, 0.95)):
            found = [error(kind, float(alpha), lambda_, **own) for alpha in alphas]
            line(axes, alphas, found, number, f"λ {lambda_:g}", every=2)
        plain(axes, "alpha", "")
        axes.set_title(title, fontsize=10)
        axes.set_ylim(0.2, 0.58)
    both[0].set_ylabel("error over the first 10 episodes")
    both[0].legend(frameon=False, fontsize=8, ncols=2, loc="upper center")
    save(figure, "true-online")


def draw_r_learning() -> None:
    """Draw how the average of the access-control queue is learned, and whom the learned and the best policy accept."""
    chances, rewards, mask = queue_chances()
    gain, _, policy = best_average(chances, rewards, mask)
    begin = tuckerl.RLearning(access_control(200), alpha=0.05, beta=0.005, n_agents=4, seed=0)
    averages = [begin.learn(1).rho for _ in range(50)]
    slower = {"alpha": tuckerl.Harmonic(0.05, 10), "beta": tuckerl.Harmonic(0.002, 10)}
    agent = tuckerl.RLearning(access_control(10_000), n_agents=4, seed=0, **slower).learn(30)
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.2), layout="constrained")
    for number, rho in enumerate(np.transpose(averages)):
        line(left, 200 * np.arange(1, 51), rho, number, f"rho of agent {number}", every=8)
    left.axhline(gain, color="0.1", linewidth=1.0)
    left.text(10_000, 3.3, f"black line: exact, {gain:.3f}", ha="right", fontsize=8)
    left.set_ylim(0, 3.6)
    left.legend(frameon=False, fontsize=8, loc="lower right")
    plain(left, "steps", "reward a step")
    learned = np.where(mask, agent.q.mean(axis=0), -np.inf).argmax(axis=1)
    _draw_accepted(right, learned.reshape(11, 4).T, policy.reshape(11, 4).T)
    save(figure, "r-learning")


def _draw_accepted(axes: Axes, learned: Any, exact: Any) -> None:
    """Draw a field for each priority and number of free servers: shaded where learned to accept, marked where best."""
    axes.imshow(learned, cmap="Greys", vmin=0, vmax=2.2, aspect="auto", origin="lower")
    priority, free = np.nonzero(exact)
    axes.plot(free, priority, linestyle="", marker="o", color="0.1", markersize=4.5)
    axes.set_yticks(range(4), ["1", "2", "4", "8"])
    axes.set_xticks(range(11))
    plain(axes, "free servers", "the customer pays")
    axes.set_title("accepted: grey as learned, dots as is best", fontsize=9)


def draw_haql() -> None:
    """Draw steps to the goal of ten random mazes with and without a heuristic in the choice of actions."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    kinds: list[tuple[Any, dict[str, Any], str]] = [
        (tuckerl.QLearning, {}, "Q-learning"),
        (tuckerl.HAQL, {"xi": 0.5}, "HAQL, ξ 0.5"),
        (tuckerl.HAQL, {"xi": 1.0}, "HAQL, ξ 1"),
    ]
    for number, (kind, own, label) in enumerate(kinds):
        steps = []
        for seed in range(10):
            maze = tuckerl.random_maze(seed=seed).to_mdp(max_episode_steps=2000)
            steps.append(kind(maze, n_agents=5, seed=seed, **own).learn(100).steps.mean(axis=1))
        line(axes, np.arange(1, 101), np.mean(steps, axis=0), number, label, every=10)
    axes.set_yscale("log")
    axes.set_yticks([100, 300, 1000, 2000], ["100", "300", "1000", "2000"])
    axes.minorticks_off()
    plain(axes, "episode", "steps to the goal, at most 2000")
    axes.legend(frameon=False, fontsize=8, loc=(0.35, 0.6))
    save(figure, "haql")


PICTURES: dict[str, Callable[[], None]] = {
    "watkins": draw_watkins,
    "true-online": draw_true_online,
    "r-learning": draw_r_learning,
    "haql": draw_haql,
}


if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
