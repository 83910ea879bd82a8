"""Environments that Python steps: learning on them against stepping them alone.

The learner's actions are random (epsilon 1), so that both play the same kind of episodes; it looks for the greedy
action and learns from every step all the same. Ours includes numbering observations and everything else that learning
takes; the peer's loop is the shortest there is, its actions drawn beforehand.
"""

from functools import partial
from typing import Any

import gymnasium
import numpy as np

from benchmarks.timing import Row, compare
from tuckerl import QLearning, SarsaLambda
from tuckerl.training.learner import Learner

N_STEPS = 20_000
ENVIRONMENTS: dict[str, dict[str, Any]] = {"MountainCar-v0": {"bins": 20}, "Blackjack-v1": {}}


def rows() -> list[Row]:
    """Time a step of two environments that have no table, with a one-step learner and one with traces."""
    return [
        _row(name, learner, parameters)
        for name, parameters in ENVIRONMENTS.items()
        for learner in (QLearning, SarsaLambda)
    ]


def _row(name: str, learner: type[Learner], parameters: dict[str, Any]) -> Row:
    made = learner(name, epsilon=1.0, seed=0, **parameters).learn(episodes=5)
    return compare(
        f"{learner.__name__} on {name}",
        "step",
        partial(made.learn, steps=N_STEPS),
        "env.step alone, random actions",
        _stepping_alone(name),
        units=N_STEPS,
        repeats=9,
    )


def _stepping_alone(name: str) -> Any:
    env = gymnasium.make(name)
    env.reset(seed=0)
    n_actions = int(env.action_space.n)  # type: ignore[attr-defined]  # both have Discrete actions
    actions = np.random.default_rng(0).integers(n_actions, size=N_STEPS).tolist()

    def play() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return play
