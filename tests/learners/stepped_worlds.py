"""Environments that are stepped in Python, for the tests of learners."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.wrappers import TimeLimit

from tuckerl import TabularMDP
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.problems.maze import sutton_maze
from tuckerl.rng import seed_sequence, stream, uniform
from tuckerl.types import FloatArray, Stream

Env = gymnasium.Env[Any, Any]


def small_maze() -> Env:
    maze = sutton_maze()
    return TimeLimit(DynaMazeEnv(maze.walls, start=maze.start, goal=maze.goal), 40)


def cliff() -> Env:
    return gymnasium.make("CliffWalking-v1", max_episode_steps=40)


def dry_lake() -> Env:
    return gymnasium.make("FrozenLake-v1", is_slippery=False, max_episode_steps=30)


def dry_taxi() -> Env:
    """A taxi whose episodes all begin alike; it gives masks."""
    env = gymnasium.make("Taxi-v4", max_episode_steps=40)
    env.unwrapped.initial_state_distrib = np.eye(500)[328]  # type: ignore[attr-defined]  # a taxi's own
    return env


DETERMINISTIC: dict[str, Callable[[], Env]] = {"maze": small_maze, "cliff": cliff, "lake": dry_lake, "taxi": dry_taxi}


class TableEnv(gymnasium.Env[Any, Any]):
    """The transitions of a finite MDP, drawn from a stream as kernels draw them; the table itself is out of sight.

    Without a stream of somebody else's it draws from one that every reset seeds, so that it has no generator to keep.
    """

    def __init__(self, mdp: TabularMDP, *, with_masks: bool | None = None) -> None:
        self._arrays, self.words = mdp.arrays, stream(seed_sequence(0))
        self._own = True
        self._with_masks = mdp.arrays.action_mask.size > 0 if with_masks is None else with_masks
        self._clock, self._limit = 0, mdp.arrays.max_episode_steps
        self.observation_space, self.action_space = spaces.Discrete(mdp.n_states), spaces.Discrete(mdp.n_actions)
        self.state = 0

    def draw_from(self, words: Stream) -> None:
        self.words, self._own = words, False

    def _draw(self, cumulative: FloatArray) -> int:
        if cumulative.size == 1:
            return 0
        return min(int(np.searchsorted(cumulative, uniform(self.words), side="right")), cumulative.size - 1)

    def _info(self) -> dict[str, Any]:
        return {"action_mask": self._arrays.action_mask[self.state].astype(np.int8)} if self._with_masks else {}

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        if seed is not None and self._own:
            self.words = stream(seed_sequence(seed))
        self._clock = 0
        self.state = int(self._arrays.start_state[self._draw(self._arrays.start_cumulative)])
        return self.state, self._info()

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        arrays, pair = self._arrays, self.state * self._arrays.n_actions + action
        if arrays.offsets.size:
            low = int(arrays.offsets[pair])
            pair = low + self._draw(arrays.cumulative[low : arrays.offsets[pair + 1]])
        self.state = int(arrays.next_state[pair])
        self._clock += 1
        late = self._clock >= self._limit
        return self.state, float(arrays.reward[pair]), bool(arrays.terminated[pair]), late, self._info()


class SeededTableEnv(TableEnv):
    """The same, with a generator that it keeps from one episode to the next, as Gymnasium's environments have."""

    def _draw(self, cumulative: FloatArray) -> int:
        return min(int(np.searchsorted(cumulative, self.np_random.random(), side="right")), cumulative.size - 1)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        gymnasium.Env.reset(self, seed=seed)
        return super().reset(seed=seed)
