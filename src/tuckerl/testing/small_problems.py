"""The small problems that learners are checked on."""

from functools import cache
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Discrete

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator
from tuckerl.rng import uniform
from tuckerl.types import BoolArray, FloatArray, Stream

LENGTH = 5
FORBIDDEN_VALUE = 1e6
"""The initial value of the actions that may not be taken in `masked`: learners must not use it."""


def corridor() -> TabularMDP:
    """Return five places in a row; action 1 goes right, 0 left; coming to the last one pays 1 and ends."""
    return _line([-1, 1], np.ones((LENGTH, 2), dtype=np.bool_))


def slippery() -> TabularMDP:
    """Return six states, three actions with two outcomes each, first states by chance; some outcomes end an episode."""
    rng = np.random.default_rng(0)
    shape = (6, 3, 2)
    probability = rng.dirichlet(np.ones(2), size=shape[:2])
    return TabularMDP(
        rng.integers(6, size=shape),
        rng.normal(size=shape),
        rng.random(shape) < 0.1,
        probability,
        start=np.full(6, 1 / 6),
        max_episode_steps=30,
        heuristic=np.arange(6.0),
    )


def masked() -> TabularMDP:
    """Return the corridor with a third action that may not be taken, and stays."""
    return _line([-1, 1, 0], np.tile([True, True, False], (LENGTH, 1)))


def _line(moves: list[int], allowed: BoolArray) -> TabularMDP:
    """Return the corridor in which actions make these moves."""
    places = np.arange(LENGTH)
    next_state = np.clip(places[:, np.newaxis] + moves, 0, LENGTH - 1)
    ends = next_state == LENGTH - 1
    reward, heuristic = np.where(ends, 1.0, 0.0), LENGTH - 1.0 - places
    return TabularMDP(next_state, reward, ends, max_episode_steps=200, heuristic=heuristic, action_mask=allowed)


def one_step(*, terminated: bool) -> TabularMDP:
    """Return a step from state 0 to state 1 that pays 0.5; there the episode has ended, or is cut off."""
    ends = np.array([[terminated], [False]])
    return TabularMDP([[1], [1]], [[0.5], [0.0]], ends, max_episode_steps=1, heuristic=[1.0, 0.0])


def overflowing() -> TabularMDP:
    """Return a state that pays more at every step than a table can hold."""
    return TabularMDP([[0]], [[1e308]], [[False]], max_episode_steps=50, heuristic=[0.0])


def _drift_reset(parameters: FloatArray, state: FloatArray, rng: Stream) -> None:
    state[0], state[1] = uniform(rng), 0.0


def _drift_step(parameters: FloatArray, state: FloatArray, action: int, rng: Stream) -> tuple[float, bool]:
    state[1] = 0.5 * state[1] + 0.25 * (action - 1) + parameters[0] * (uniform(rng) - 0.5)
    state[0] += state[1]
    return 0.25 - state[0] * state[0], abs(state[0]) > 1.5


def _drift_index(parameters: FloatArray, state: FloatArray) -> int:
    return min(int(abs(state[0]) * 4.0), 5) + (6 if state[1] > 0.0 else 0)


@cache
def drift() -> Simulator:
    """Return a place that drifts on a line, pushed left, not at all or right; leaving the middle ends the episode."""
    return Simulator(
        _drift_reset,
        _drift_step,
        _drift_index,
        n_states=12,
        n_actions=3,
        state_size=2,
        parameters=[0.5],
        max_episode_steps=40,
        heuristic=np.arange(12.0),
    )


class CorridorEnv(gymnasium.Env[Any, Any]):
    """`corridor` under Gymnasium, to be stepped in Python."""

    observation_space = Discrete(LENGTH)
    action_space = Discrete(2)

    def __init__(self) -> None:
        self._place = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        """Go to the first place."""
        super().reset(seed=seed)
        self._place = 0
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Go one place on."""
        self._place = max(self._place - 1, 0) if action == 0 else min(self._place + 1, LENGTH - 1)
        over = self._place == LENGTH - 1
        return self._place, float(over), over, False, {}


def stepped_corridor() -> GymnasiumProblem:
    """Return the corridor as Python steps it."""
    heuristic = corridor().heuristic
    return GymnasiumProblem(CorridorEnv(), "corridor", CorridorEnv, max_episode_steps=200, heuristic=heuristic)
