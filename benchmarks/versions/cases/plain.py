"""Every learner on tables and on a simulator, and all parameters that learners share."""

from collections.abc import Iterator
from typing import Any

import numpy as np

import tuckerl
from benchmarks.versions.cases.case import VARIANTS, Case, Folders, World, evaluated, learning, named
from benchmarks.versions.cases.worlds import drift, random_table
from benchmarks.versions.names import Arrays, recorded

WORLDS = {
    "Sutton's maze": World(tuckerl.sutton_maze, 60, has_heuristic=True),
    "a random maze": World(lambda: tuckerl.random_maze(seed=1), 12, has_heuristic=True),
    "cart pole": World(tuckerl.cart_pole, 60),
    "cart pole, uniform start": World(lambda: tuckerl.cart_pole(start="uniform", reward="sign"), 60),
    "drift": World(drift, 60),
    "robot rescue": World(tuckerl.robot_rescue, 8),
    "FrozenLake-v1": World(lambda: "FrozenLake-v1", 200, {"initial_q": 0.5}),
    "Taxi-v4": World(lambda: "Taxi-v4", 60),
    "CliffWalking-v1": World(lambda: "CliffWalking-v1", 40),
    "a random table": World(lambda: random_table(1, masked=False), 100, has_heuristic=True),
    "a random table with masks": World(lambda: random_table(2), 100, has_heuristic=True),
}

OPTIONS: dict[str, dict[str, Any]] = {
    "first of ties": {"ties": "first"},
    "linear": {"alpha": tuckerl.Linear(0.5, 0.1, 40), "epsilon": tuckerl.Linear(1.0, 0.05, 30)},
    "exponential": {"alpha": tuckerl.Exponential(0.5, 0.98), "epsilon": tuckerl.Exponential(1.0, 0.95, 0.01)},
    "harmonic": {"alpha": tuckerl.Harmonic(0.5, 20), "epsilon": tuckerl.Harmonic(1.0, 10)},
    "epsilon decays": {"epsilon": 0.9, "epsilon_decay": 0.97},
    "always random": {"epsilon": 1.0},
    "always greedy": {"epsilon": 0.0, "initial_q": 2.0},
    "terminal states are bootstrapped": {"bootstrap_terminal": True},
    "a first table": {"initial_q": np.linspace(-1.0, 1.0, 72).reshape(12, 6)},
    "no discount": {"gamma": 1.0, "alpha": 0.02},
    "three agents": {"n_agents": 3},
    "diverging": {"alpha": 1.0, "gamma": 1.0, "epsilon": 0.5},
}


def cases() -> Iterator[Case]:
    """Give all cases of this module."""
    for where, world in WORLDS.items():
        for what, (kind, parameters) in VARIANTS.items():
            yield learning(f"{what} on {where}", world, kind, parameters, shown=True)
    masked = WORLDS["a random table with masks"]
    huge = World(lambda: random_table(3, scale=1e307), 100, has_heuristic=True)
    for how, options in OPTIONS.items():
        for what, (kind, parameters) in VARIANTS.items():
            yield learning(f"{what}, {how}", huge if how == "diverging" else masked, kind, parameters | options)
    for what, (kind, parameters) in VARIANTS.items():
        yield _by_steps(f"{what}, steps instead of episodes", kind, parameters)
        yield _called_back(f"{what}, stopped by a callback", kind, parameters)


def _by_steps(name: str, kind: str, parameters: dict[str, Any]) -> Case:
    def record(_: Folders) -> Arrays:
        learner = WORLDS["a random maze"].learner(kind, name, n_agents=3, **parameters)
        learner.learn(steps=3000)
        between = recorded(learner)
        return recorded(learner.learn(steps=1).learn(steps=2000)) | named("between", between)

    return Case(name, record)


def _called_back(name: str, kind: str, parameters: dict[str, Any]) -> Case:
    def record(_: Folders) -> Arrays:
        seen: list[int] = []

        def follow(learner: Any) -> bool:
            seen.append(learner.episodes)
            return len(seen) < 3

        learner = WORLDS["FrozenLake-v1"].learner(kind, name, **parameters).learn(1000, callbacks=[follow])
        arrays = recorded(learner) | evaluated(learner, 30, seed=5)
        return arrays | {"called at": np.array(seen)}

    return Case(name, record)
