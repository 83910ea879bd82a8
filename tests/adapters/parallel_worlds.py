"""Small PettingZoo environments whose every number can be worked out on paper.

They are strict: `step` refuses actions of agents that are not there, and keeps what it was given in `received`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import Space, spaces
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from tuckerl.types import BoolArray

Agents = dict[str, Any]


def altered(env: Any, **methods: Any) -> Any:
    """Return the same environment with other methods in place of its own."""
    for name, method in methods.items():
        setattr(env, name, method)
    return env


class World(ParallelEnv):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    """What all worlds share: agents, spaces, and a clock; a subclass says what is seen, paid and who leaves."""

    def __init__(self, observations: Mapping[str, Space[Any]], actions: Mapping[str, Space[Any]]) -> None:
        self.metadata = {"name": type(self).__name__, "render_modes": ["ansi"], "render_fps": 4}
        self.render_mode = "ansi"
        self.possible_agents = list(actions)
        self.agents: list[str] = []
        self.observation_spaces, self.action_spaces = dict(observations), dict(actions)
        self.clock = 0
        self.received: list[dict[str, Any]] = []
        self.reset_with: list[tuple[int | None, Any]] = []
        self.closed = 0

    def observation_space(self, agent: str) -> Space[Any]:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space[Any]:
        return self.action_spaces[agent]

    def begin(self, seed: int | None) -> None:
        """Put the world's own things to their places."""

    def observe(self, agent: str) -> Any:
        return np.int64(self.clock)

    def tell(self, agent: str) -> dict[str, Any]:
        return {}

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        """Return rewards, who terminates and who is truncated."""
        raise NotImplementedError

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Agents, Agents]:
        self.agents = self.possible_agents[:]
        self.clock, self.received = 0, []
        self.reset_with.append((seed, options))
        self.begin(seed)
        return {agent: self.observe(agent) for agent in self.agents}, {agent: self.tell(agent) for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[Agents, Agents, Agents, Agents, Agents]:
        if set(actions) != set(self.agents):
            raise ValueError(f"actions of {self.agents} expected, got {actions}")
        self.received.append(dict(actions))
        self.clock += 1
        acted = self.agents[:]
        rewards, terminated, truncated = self.act(actions)
        for agent in terminated | truncated:
            self.agents.remove(agent)  # in place, as many environments do
        return (
            {agent: self.observe(agent) for agent in acted},
            {agent: rewards[agent] for agent in acted},
            {agent: agent in terminated for agent in acted},
            {agent: agent in truncated for agent in acted},
            {agent: self.tell(agent) for agent in acted},
        )

    def render(self) -> str:
        return f"{self.metadata['name']} at {self.clock}"

    def close(self) -> None:
        self.closed += 1


class Meeting(World):
    """Two agents on a line of five cells, at its ends; each goes left (0), stays (1) or goes right (2).

    Both pay 1 a step and receive 10 when they come to stand on one cell, which ends the episode; both see their own
    cell. They may pass through each other. The sixth step is the last.
    """

    def __init__(self) -> None:
        super().__init__(
            {agent: spaces.Discrete(5) for agent in ("west", "east")},
            {agent: spaces.Discrete(3) for agent in ("west", "east")},
        )

    def begin(self, seed: int | None) -> None:
        self.cells = {"west": 0, "east": 4}

    def observe(self, agent: str) -> Any:
        return np.int64(self.cells[agent])

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        for agent, action in actions.items():
            self.cells[agent] = min(max(self.cells[agent] + int(action) - 1, 0), 4)
        met = self.cells["west"] == self.cells["east"]
        everyone = set(self.agents)
        late = everyone if self.clock == 6 and not met else set()
        return dict.fromkeys(everyone, 9.0 if met else -1.0), everyone if met else set(), late


class Leaving(World):
    """Agents that leave after steps of their own: by default a after 1, b after 2, c after 3.

    Each sees how many steps it has made, chooses 0 or 1, and earns (1 + action) times its own unit: 1, 10, 100, ...
    Those in `truncated` are truncated when they leave, those in `both` are truncated and terminated, others terminated.
    """

    def __init__(
        self, steps: Sequence[int] = (1, 2, 3), truncated: Sequence[str] = (), both: Sequence[str] = ()
    ) -> None:
        names = [chr(ord("a") + place) for place in range(len(steps))]
        super().__init__(
            {agent: spaces.Discrete(max(steps) + 1) for agent in names},
            {agent: spaces.Discrete(2) for agent in names},
        )
        self.last_step = dict(zip(names, steps, strict=True))
        self.unit = {agent: 10.0**place for place, agent in enumerate(names)}
        self.truncated, self.both = set(truncated) | set(both), set(both)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        leave = {agent for agent in self.agents if self.last_step[agent] == self.clock}
        rewards = {agent: self.unit[agent] * (1 + int(action)) for agent, action in actions.items()}
        return rewards, {agent for agent in leave if agent not in self.truncated - self.both}, leave & self.truncated


class Unequal(World):
    """Two agents with nothing in common but the clock, which both are shown in their own way; three steps.

    The scout sees -1, 0, 1, 2 and chooses from -1 to 1; the carrier sees the clock's two binary digits and chooses a
    pair. The scout earns its choice, the carrier the sum of its pair.
    """

    def __init__(self) -> None:
        super().__init__(
            {"scout": spaces.Discrete(4, start=-1), "carrier": spaces.MultiBinary(2)},
            {"scout": spaces.Discrete(3, start=-1), "carrier": spaces.MultiDiscrete([2, 4])},
        )

    def observe(self, agent: str) -> Any:
        if agent == "scout":
            return np.int64(self.clock - 1)
        return np.array([self.clock // 2, self.clock % 2], dtype=np.int8)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        end = set(self.agents) if self.clock == 3 else set()
        return {agent: float(np.sum(action)) for agent, action in actions.items()}, end, set()


class Masked(World):
    """Two agents that may choose any of three actions but one: agent i at clock t not (t + i) modulo 3.

    What is forbidden costs 100, all else earns the action's number. Both see the clock; "first" leaves after `first`
    steps, "second" after 4. The masks are in the infos.
    """

    def __init__(self, first: int = 4, truncated: bool = False) -> None:
        super().__init__(
            {agent: spaces.Discrete(5) for agent in ("first", "second")},
            {agent: spaces.Discrete(3) for agent in ("first", "second")},
        )
        self.last_step, self.truncated = {"first": first, "second": 4}, truncated

    def mask(self, agent: str) -> BoolArray:
        allowed: BoolArray = np.arange(3) != (self.clock + self.possible_agents.index(agent)) % 3
        return allowed

    def tell(self, agent: str) -> dict[str, Any]:
        return {"action_mask": self.mask(agent).astype(np.int8), "clock": self.clock}

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        self.clock -= 1  # the masks that these actions were chosen by
        rewards = {agent: float(action) if self.mask(agent)[action] else -100.0 for agent, action in actions.items()}
        self.clock += 1
        leave = {agent for agent in self.agents if self.last_step[agent] == self.clock}
        return rewards, set() if self.truncated else leave, leave if self.truncated else set()


class MaskedInObservation(Masked):
    """The same, with the masks in the observations."""

    def __init__(self, first: int = 4, truncated: bool = False) -> None:
        super().__init__(first, truncated)
        self.observation_spaces = {
            agent: spaces.Dict({"observation": spaces.Discrete(5), "action_mask": spaces.MultiBinary(3)})
            for agent in self.possible_agents
        }

    def observe(self, agent: str) -> Any:
        return {"observation": np.int64(self.clock), "action_mask": self.mask(agent).astype(np.int8)}

    def tell(self, agent: str) -> dict[str, Any]:
        return {}


class Dice(World):
    """Two agents that throw a die each and see it, for ten steps; who guessed the number thrown earns 1."""

    def __init__(self) -> None:
        super().__init__(
            {agent: spaces.Discrete(6) for agent in ("left", "right")},
            {agent: spaces.Discrete(6) for agent in ("left", "right")},
        )
        self.np_random, _ = seeding.np_random()

    def begin(self, seed: int | None) -> None:
        if seed is not None:
            self.np_random, _ = seeding.np_random(seed)
        self.throw()

    def throw(self) -> None:
        self.thrown = {agent: self.np_random.integers(6) for agent in self.possible_agents}

    def observe(self, agent: str) -> Any:
        return self.thrown[agent]

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        self.throw()
        rewards = {agent: float(self.thrown[agent] == action) for agent, action in actions.items()}
        return rewards, set(), set(self.agents) if self.clock == 10 else set()


class Breaking(Leaving):
    """Raises RuntimeError("the bridge broke") at a step of every episode, by default the third."""

    def __init__(self, at: int = 3) -> None:
        super().__init__((9, 9))
        self.at = at

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        if self.clock == self.at:
            raise RuntimeError("the bridge broke")
        return super().act(actions)
