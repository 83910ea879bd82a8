"""What is timed: learners on problems, by name, each for about a quarter of a second."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import tuckerl

SIZES = ((110, 21, 5_000), (1404, 4, 12_000), (36864, 25, 2_000))
"""States and actions of the paper's three tables, and for how many episodes they are played."""

RESCUE = "tuckerl/RobotRescue-v0"

_HORIZON = 500


class Row(NamedTuple):
    """One learner on one problem."""

    kind: str
    world: Callable[[], Any]
    episodes: int
    parameters: dict[str, Any]


def random_table(n_states: int, n_actions: int) -> Any:
    """Return a table without ends, each pair of which leads anywhere, so that every step misses the caches."""
    rng = np.random.default_rng(0)
    next_state = rng.integers(n_states, size=(n_states, n_actions))
    endless = np.zeros(next_state.shape, dtype=np.bool_)
    return tuckerl.TabularMDP(next_state, rng.normal(size=next_state.shape), endless, max_episode_steps=_HORIZON)


def _random_maze() -> Any:
    return tuckerl.random_maze(seed=0)


def rows() -> dict[str, Row]:
    """Return all rows by their names."""
    step = tuckerl.TensorStep(every=10, ranks=(5, 2, 3, 1))
    return {
        "Q-learning, random maze": Row("QLearning", _random_maze, 60_000, {}),
        "SARSA, random maze": Row("Sarsa", _random_maze, 60_000, {}),
        "SARSA(0.9), random maze": Row("SarsaLambda", _random_maze, 50_000, {"lambda_": 0.9}),
        "Dyna-H, 10 planning steps, random maze": Row("DynaH", _random_maze, 15_000, {"planning_steps": 10}),
        "T-Dyna-H, every 10, random maze": Row(
            "DynaH", _random_maze, 1_200, {"planning_steps": 10, "tensor_step": step}
        ),
        "Q-learning, cart pole": Row("QLearning", tuckerl.cart_pole, 12_000, {}),
        "SARSA(lambda), cart pole": Row("SarsaLambda", tuckerl.cart_pole, 7_000, {}),
        "Team-Q, robot rescue": Row("TeamQ", tuckerl.robot_rescue, 60_000, {}),
        "Q-learning, Taxi-v4 with masks": Row("QLearning", lambda: "Taxi-v4", 200_000, {}),
        "Q-learning, MountainCar-v0 stepped": Row("QLearning", lambda: "MountainCar-v0", 80, {"bins": 20}),
        "Q-learning, robot rescue, tables apart": Row("QLearning", lambda: RESCUE, 10, {}),
        "SARSA(lambda), robot rescue, tables apart": Row("SarsaLambda", lambda: RESCUE, 200, {}),
        **{name: row for size in SIZES for name, row in _on_random_table(*size).items()},
    }


def _on_random_table(n_states: int, n_actions: int, episodes: int) -> dict[str, Row]:
    def world() -> Any:
        return random_table(n_states, n_actions)

    where = f"random {n_states} x {n_actions}"
    found = {f"Q-learning, {where}": Row("QLearning", world, episodes, {})}
    for epsilon in (0.1, 1.0):
        parameters = {"lambda_": 0.95, "epsilon": epsilon}
        found[f"SARSA(lambda), {where}, epsilon {epsilon:g}"] = Row("SarsaLambda", world, episodes, parameters)
    return found
