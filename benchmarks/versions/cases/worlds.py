"""Problems that no library ships: a random table, a simulator, and environments that Python steps."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

import tuckerl


def random_table(seed: int, *, sizes: tuple[int, ...] = (2, 3), scale: float = 1.0, masked: bool = True) -> Any:
    """Return a table of three outcomes a pair, random starts and rare ends; members' masks are independent.

    Parameters
    ----------
    seed : int
    sizes : tuple of int
        How many actions each member has.
    scale : float
        Of the rewards.
    masked : bool
        Whether some actions may not be taken.
    """
    rng = np.random.default_rng(seed)
    n_states, shape = 12, (12, int(np.prod(sizes)), 3)
    allowed = np.ones((n_states, 1), dtype=np.bool_)
    for size in sizes:
        own = rng.random((n_states, size)) < 0.6
        own[np.arange(n_states), rng.integers(size, size=n_states)] = True
        allowed = (allowed[:, :, np.newaxis] & own[:, np.newaxis, :]).reshape(n_states, -1)
    return tuckerl.TabularMDP(
        rng.integers(n_states, size=shape),
        scale * rng.normal(size=shape),
        rng.random(shape) < 0.08,
        rng.dirichlet(np.ones(3), size=shape[:2]),
        start=rng.dirichlet(np.ones(n_states)),
        max_episode_steps=50,
        heuristic=rng.integers(4, size=n_states).astype(np.float64),
        action_sizes=sizes,
        action_mask=allowed if masked else None,
    )


@tuckerl.kernel
def _uniform(words: Any) -> float:
    """Draw from [0, 1), as the library's own simulators do (xoshiro256++); that function's place may change."""
    s0, s1, s2, s3 = words[0], words[1], words[2], words[3]
    total = s0 + s3
    result = ((total << np.uint64(23)) | (total >> np.uint64(41))) + s0
    s2 ^= s0
    s3 ^= s1
    words[0] = s0 ^ s3
    words[1] = s1 ^ s2
    words[2] = s2 ^ (s1 << np.uint64(17))
    words[3] = (s3 << np.uint64(45)) | (s3 >> np.uint64(19))
    return float(result >> np.uint64(11)) * (1.0 / 9007199254740992.0)


def _reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = _uniform(rng)
    state[1] = 0.0


def _step(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[1] = 0.5 * state[1] + 0.25 * (action - 1) + parameters[0] * (_uniform(rng) - 0.5)
    state[0] += state[1]
    return 0.25 - state[0] * state[0], abs(state[0]) > 1.5


def _index(parameters: Any, state: Any) -> int:
    return min(int(abs(state[0]) * 4.0), 5) + (6 if state[1] > 0.0 else 0)


@cache  # its functions are compiled once
def drift() -> Any:
    """Return the simulator that kept files were learned on: a place on a line, pushed left, not at all or right."""
    return tuckerl.Simulator(
        _reset, _step, _index, n_states=12, n_actions=3, state_size=2, parameters=[0.5], max_episode_steps=80
    )


class Wander(gymnasium.Env[Any, Any]):
    """States in a ring; an action goes on by its number and some more. Episodes end at random, or after 30 steps.

    Parameters
    ----------
    n_states, n_actions : int
    masked : bool
        Whether one action may not be taken in each state.
    keeps_generator : bool
        Whether draws go on from one episode to the next, as Gymnasium's environments do it; otherwise every reset must
        give a seed.
    """

    def __init__(self, n_states: int, n_actions: int, *, masked: bool = False, keeps_generator: bool = True) -> None:
        self.observation_space, self.action_space = spaces.Discrete(n_states), spaces.Discrete(n_actions)
        self._sizes, self._masked, self._keeps = (n_states, n_actions), masked, keeps_generator
        self._draws = np.random.default_rng(0)
        self._state = self._clock = 0

    def _told(self) -> dict[str, Any]:
        mask = (np.arange(self._sizes[1]) != self._state % self._sizes[1]).astype(np.int8)
        return {"action_mask": mask} if self._masked else {}

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        """Begin anywhere."""
        if self._keeps:
            super().reset(seed=seed)
            self._draws = self.np_random
        elif seed is not None:
            self._draws = np.random.default_rng(seed)
        self._state, self._clock = int(self._draws.integers(self._sizes[0])), 0
        return self._state, self._told()

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Go on along the ring."""
        reward = float(self._draws.normal()) - 0.1 * self._state
        self._state = (self._state + int(action) + int(self._draws.integers(3))) % self._sizes[0]
        self._clock += 1
        return self._state, reward, bool(self._draws.random() < 0.05), self._clock == 30, self._told()


class Party(ParallelEnv):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    """Agents that see dice, are paid by what they saw and chose, and leave after steps of their own.

    Parameters
    ----------
    leave_after : mapping from str to int
    n_observations, n_actions : int
    masked : bool
        Whether each agent has one action at a time that it may not take.
    truncated : bool
        Whether agents that leave are truncated instead of terminated.
    """

    def __init__(
        self,
        leave_after: Mapping[str, int],
        n_observations: int,
        n_actions: int,
        *,
        masked: bool = False,
        truncated: bool = False,
    ) -> None:
        self.metadata = {"name": "Party"}
        self.render_mode = None
        self.possible_agents, self.agents = list(leave_after), list[str]()
        self.observation_spaces = {name: spaces.Discrete(n_observations) for name in leave_after}
        self.action_spaces = {name: spaces.Discrete(n_actions) for name in leave_after}
        self.np_random = np.random.default_rng(0)
        self._leave_after, self._masked, self._truncated = leave_after, masked, truncated
        self._sizes, self._clock = (n_observations, n_actions), 0
        self._seen: dict[str, int] = {}

    def observation_space(self, agent: str) -> Any:
        """Return the same space at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the same space at every call."""
        return self.action_spaces[agent]

    def _throw(self, agents: list[str]) -> dict[str, int]:
        self._seen = {name: int(self.np_random.integers(self._sizes[0])) for name in agents}
        return dict(self._seen)

    def _told(self, agents: list[str]) -> dict[str, dict[str, Any]]:
        if not self._masked:
            return {name: {} for name in agents}
        return {
            name: {"action_mask": (np.arange(self._sizes[1]) != self._seen[name] % self._sizes[1]).astype(np.int8)}
            for name in agents
        }

    def reset(self, seed: int | None = None, options: Any = None) -> tuple[dict[str, int], dict[str, dict[str, Any]]]:
        """Let everybody in."""
        if seed is not None:
            self.np_random = np.random.default_rng(seed)
        self.agents, self._clock = list(self.possible_agents), 0
        return self._throw(self.agents), self._told(self.agents)

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Pay everybody, throw the dice again, and let those leave whose time has come."""
        acted, before, self._clock = list(self.agents), self._seen, self._clock + 1
        rewards = {name: 1.0 / (1 + abs(before[name] - int(actions[name]))) for name in acted}
        leaving = {name: self._leave_after[name] == self._clock for name in acted}
        self.agents = [name for name in acted if not leaving[name]]
        staying = dict.fromkeys(acted, False)
        ends = (staying, leaving) if self._truncated else (leaving, staying)
        return self._throw(acted), rewards, *ends, self._told(acted)
