"""Draw the pictures of five learners' pages: ``python -m docs.pictures.waiting [NAME ...]``.

Without names all are drawn, in some minutes. Lines differ in dash, marker and grey as well as in colour.
"""

import sys
import warnings
from collections.abc import Callable
from typing import Any

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
import numpy as np
from docs.pictures.traces_and_averages import line, plain, save
from tests.learners.textbook import maximisation_bias, random_walk

import tuckerl


def draw_expected_sarsa() -> None:
    """Draw the return beside a cliff, as the book's figure 6.3 does: early and late, by the learning rate."""
    figure, axes = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
    alphas = np.arange(1, 11) / 10
    for number, kind in enumerate((tuckerl.ExpectedSarsa, tuckerl.Sarsa, tuckerl.QLearning)):
        early, late = [], []
        for alpha in alphas:
            agents = kind("CliffWalking-v1", alpha=alpha, gamma=1.0, epsilon=0.1, n_agents=30, seed=0).learn(600)
            early.append(agents.returns[:100].mean())
            late.append(agents.returns[-100:].mean())
        name = {"ExpectedSarsa": "Expected SARSA", "Sarsa": "SARSA", "QLearning": "Q-learning"}[kind.__name__]
        line(axes, alphas, np.array(late), number, f"{name}, episodes 501 to 600")
        line(axes, alphas, np.array(early), number + 3, f"{name}, episodes 1 to 100")
    axes.set_ylim(-160, 0)
    plain(axes, "learning rate alpha", "mean return of an episode")
    axes.legend(frameon=False, fontsize=7.5, ncols=2, loc="lower center")
    save(figure, "expected-sarsa")


def draw_double_q_learning() -> None:
    """Draw how often the agents go left in example 6.7."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    kinds: list[tuple[Any, str]] = [(tuckerl.QLearning, "Q-learning"), (tuckerl.DoubleQLearning, "Double Q-learning")]
    for number, (kind, label) in enumerate(kinds):
        agents = kind(maximisation_bias(), alpha=0.1, gamma=1.0, epsilon=0.1, n_agents=5000, seed=0).learn(300)
        left = (agents.steps == 2).mean(axis=1)
        line(axes, np.arange(1, 301), 100 * left, number, label, every=25)
    axes.axhline(5.0, color="0.35", linestyle="dotted", linewidth=1.2)
    axes.text(302, 1, "best: 5 %", ha="right", fontsize=8)
    axes.set_ylim(0, 100)
    plain(axes, "episode", "agents that go left, %")
    axes.legend(frameon=False, fontsize=8)
    save(figure, "double-q-learning")


def draw_n_step_sarsa() -> None:
    """Draw the error on the walk of 19 states by n and alpha, as the book's figure 7.2 does."""
    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    walk, true, alphas = random_walk(19, left=-1.0), np.arange(-9, 10) / 10, np.arange(1, 11) / 10
    for number, n in enumerate((1, 2, 4, 8, 32, 128)):
        errors = []
        for alpha in alphas:
            agents = tuckerl.NStepSarsa(walk, n=n, alpha=alpha, gamma=1.0, n_agents=100, seed=0)
            each = [np.sqrt(((agents.learn(1).q[:, :, 0] - true) ** 2).mean(axis=1)).mean() for _ in range(10)]
            errors.append(np.mean(each))
        line(axes, alphas, np.array(errors), number, f"n = {n}")
    axes.set_ylim(0.2, 0.6)
    plain(axes, "learning rate alpha", "RMS error, first 10 episodes")
    axes.legend(frameon=False, fontsize=8, ncols=6, loc="lower center")
    save(figure, "n-step-sarsa")


def draw_tree_backup() -> None:
    """Draw steps to the goal of Sutton's maze for some n, by agents that explore much."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    for number, n in enumerate((1, 2, 4, 16)):
        maze = tuckerl.sutton_maze()
        agents = tuckerl.TreeBackup(maze, n=n, alpha=0.2, epsilon=0.2, n_agents=100, seed=0).learn(40)
        line(axes, np.arange(1, 41), agents.steps.mean(axis=1), number, f"n = {n}", every=4)
    axes.set_yscale("log")
    axes.set_yticks([30, 100, 300], ["30", "100", "300"])
    axes.minorticks_off()
    plain(axes, "episode", "steps to the goal")
    axes.legend(frameon=False, fontsize=8)
    save(figure, "tree-backup")


def draw_monte_carlo() -> None:
    """Draw how the error on the walk of 5 states falls with the episodes: means of returns, and one step ahead."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    kinds: list[tuple[Any, dict[str, Any], str]] = [
        (tuckerl.MonteCarlo, {}, "first visits, means"),
        (tuckerl.MonteCarlo, {"visits": "every"}, "every visit, means"),
        (tuckerl.MonteCarlo, {"visits": "every", "alpha": 0.03}, "every visit, alpha = 0.03"),
        (tuckerl.ExpectedSarsa, {"alpha": 0.1}, "one step ahead, alpha = 0.1"),
    ]
    for number, (kind, own, label) in enumerate(kinds):
        agents = kind(random_walk(5), gamma=1.0, initial_q=0.5, n_agents=300, seed=0, **own)
        errors = []
        for _ in range(100):
            q = agents.learn(1).q[:, :, 0]
            errors.append(np.sqrt(((q - np.arange(1, 6) / 6) ** 2).mean(axis=1)).mean())
        line(axes, np.arange(1, 101), np.array(errors), number, label, every=10)
    axes.set_ylim(0, 0.35)
    plain(axes, "episode", "RMS error of the five values")
    axes.legend(frameon=False, fontsize=8)
    save(figure, "monte-carlo")


DRAWN: dict[str, Callable[[], None]] = {
    "expected-sarsa": draw_expected_sarsa,
    "double-q-learning": draw_double_q_learning,
    "n-step-sarsa": draw_n_step_sarsa,
    "tree-backup": draw_tree_backup,
    "monte-carlo": draw_monte_carlo,
}

if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in sys.argv[1:] or DRAWN:
            DRAWN[name]()
