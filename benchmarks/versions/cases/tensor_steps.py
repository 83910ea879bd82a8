"""The tensor step: all weightings and rules of sharing, functions of a user's own, and every learner with it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

import tuckerl
from benchmarks.versions.cases import plain, stepped
from benchmarks.versions.cases.case import VARIANTS, Case, World, learning
from benchmarks.versions.cases.worlds import random_table

WEIGHTS = ("paper", "relative", "constant", "permuted", "none")
SHARES = ("max", "min", "best", "random", "mean", "consensus", "none")


def step(every: int = 5, **settings: Any) -> Any:
    """Return a tensor step of small windows."""
    return tuckerl.TensorStep(every=every, ranks=settings.pop("ranks", (4, 3, 3, 2)), **settings)


def own_weights(decomposition: Any) -> Any:
    """Weigh actions by the largest entry of their row, to have a function of a user's own."""
    return 0.1 + np.abs(decomposition.factors[1]).max(axis=1)


def own_share(context: Any) -> Any:
    """Mix tables by the rank of their agents' mean returns, to have a function of a user's own."""
    places = 1.0 + np.argsort(np.argsort(context.returns.mean(axis=0)))
    return places / places.sum()


STEPS: dict[str, Any] = {
    "paper, max": step(),
    "paper, min, floor": step(share="min", floor=0.2),
    "relative, consensus": step(weights="relative", share="consensus"),
    "permuted, mean": step(weights="permuted", share="mean", floor=0.1),
    "constant, best": step(weights="constant", share="best"),
    "none, random": step(weights="none", share="random"),
    "own weights, own share": step(weights=own_weights, share=own_share),
}

SETTINGS: dict[str, Any] = {
    "truncated": step(max_iterations=0),
    "to the end": step(tol=0.0, max_iterations=20),
    "ranks too large": step(ranks=(50, 50, 50, 50), weights="relative"),
    "ranks of one": step(ranks=(1, 1, 1, 1), share="consensus"),
    "every episode": step(every=1, weights="relative"),
    "chosen by a function": step(share=lambda context: int(np.argmin(context.returns[-1]))),
    "shared by nobody": step(weights=own_weights, share=lambda context: None),
}

WORLDS: dict[str, tuple[World, dict[str, Any]]] = {
    "Sutton's maze": (plain.WORLDS["Sutton's maze"], {"n_agents": 3}),
    "cart pole": (plain.WORLDS["cart pole, uniform start"], {"n_agents": 2}),
    "robot rescue": (plain.WORLDS["robot rescue"], {"n_agents": 2, "alpha": 0.5}),
    "Taxi-v4": (plain.WORLDS["Taxi-v4"], {"n_agents": 2}),
    "a ring with masks": (stepped.WORLDS["a ring with masks"], {"n_agents": 2}),
    "a huge random table": (World(lambda: random_table(3, scale=1e307), 60, has_heuristic=True), {"n_agents": 2}),
}


def cases() -> Iterator[Case]:
    """Give all cases of this module."""
    table = plain.WORLDS["a random table with masks"]
    for weights in WEIGHTS:
        for share in SHARES:
            chosen = {"n_agents": 3, "tensor_step": step(weights=weights, share=share)}
            yield learning(f"T-Q-learning, weights {weights}, share {share}", table, "QLearning", chosen)
    for how, tensor_step in SETTINGS.items():
        chosen = {"n_agents": 2, "tensor_step": tensor_step}
        yield learning(f"T-Q-learning, {how}", plain.WORLDS["FrozenLake-v1"], "QLearning", chosen)
    for what, (kind, parameters) in VARIANTS.items():
        for how, tensor_step in STEPS.items():
            chosen = {"n_agents": 3, "tensor_step": tensor_step}
            yield learning(f"T-{what}, {how}", table, kind, parameters | chosen)
        for where, (world, options) in WORLDS.items():
            chosen = {"tensor_step": step(every=4, weights="relative"), **options}
            yield learning(f"T-{what} on {where}", world, kind, parameters | chosen, shown="huge" not in where)
    for what, (kind, parameters) in VARIANTS.items():
        chosen = parameters | {"tensor_step": step(floor=0.1)}
        for where, world in (stepped.TEAMS if kind == "TeamQ" else stepped.PLAYERS).items():
            yield learning(f"T-{what} on {where}", world, kind, chosen)
