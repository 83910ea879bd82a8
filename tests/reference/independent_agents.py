"""Independent learners line by line: everybody in one world, everybody with a table and a stream of their own."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tests.reference.q_learning import QLearner, Table
from tests.reference.rng import Stream

Code = Callable[[str, Any], int]


class Seat:
    """What an agent knows of the world: how many actions it has, and which of them it may take where."""

    def __init__(self, n_actions: int) -> None:
        self.n_actions = n_actions
        self.masks: dict[int, Sequence[int]] = {}  # the latest of each state

    def allowed(self, state: int) -> list[int]:
        mask = self.masks.get(state, [1] * self.n_actions)
        return [a for a in range(self.n_actions) if mask[a]] or list(range(self.n_actions))


class SpaceEncoder(NamedTuple):
    """How observations and actions are numbered."""

    state: Code
    action: Callable[[str, int], Any]
    sizes: Mapping[str, tuple[int, int]]  # (states, actions) of each agent


def numbers(env: Any) -> SpaceEncoder:
    """Of an environment whose agents' spaces are Discrete from 0."""
    sizes = {a: (int(env.observation_space(a).n), int(env.action_space(a).n)) for a in env.possible_agents}
    return SpaceEncoder(lambda agent, seen: int(seen), lambda agent, a: a, sizes)


class IndependentAgent(QLearner):
    """One agent; `sarsa` says which of the two rules it learns by."""

    def __init__(self, seat: Seat, stream: Stream, shape: tuple[int, int], sarsa: bool, **numbers: Any) -> None:
        super().__init__(seat, stream, q=np.zeros(shape), **numbers)  # type: ignore[arg-type]  # a seat will do
        self.sarsa, self.seat = sarsa, seat
        self.state = self.action = 0
        self.game: Any = None

    def learn(self, reward: float, s2: int, terminated: bool, ended: bool, omega: Table) -> None:
        if self.sarsa:
            a2 = self.policy(s2)
            delta = reward + (0.0 if terminated else self.gamma) * self.q[s2, a2] - self.q[self.state, self.action]
            self.q[self.state, self.action] += self.alpha * omega[self.action] * delta
        else:
            self.update(self.state, self.action, reward, s2, terminated, omega)
            a2 = 0 if ended else self.policy(s2)
        self.state, self.action = s2, a2

    def episode(self, omega: Table) -> tuple[int, float]:
        """Its part of the game's next episode; the tensor step's twin asks one agent after the other."""
        result: tuple[int, float] = self.game.part(self, omega)
        return result


class Game:
    """A world and its agents."""

    def __init__(
        self, env: Any, seed: int, sarsa: bool = False, encoder: SpaceEncoder | None = None, **numbers_: Any
    ) -> None:
        self.env, self.encoder = env, encoder or numbers(env)
        shape = tuple(max(sizes) for sizes in zip(*self.encoder.sizes.values(), strict=True))
        self.agents = {
            name: IndependentAgent(
                Seat(self.encoder.sizes[name][1]), Stream(seed, j), (shape[0], shape[1]), sarsa, **numbers_
            )
            for j, name in enumerate(env.possible_agents)
        }
        for agent in self.agents.values():
            agent.game = self
        # The world's own seed is the first child of the first child of the first child.
        self.first_seed = int(np.random.SeedSequence(seed, spawn_key=(0, 0, 0)).generate_state(1)[0])
        self.n_episodes = 0
        self.parts: dict[int, tuple[int, float]] = {}

    def look(self, name: str, observation: Any, info: Any) -> int:
        mask = info.get("action_mask")
        if isinstance(observation, dict):
            observation, mask = observation["observation"], observation["action_mask"]
        state = self.encoder.state(name, observation)
        if mask is not None:
            self.agents[name].seat.masks[state] = mask
        return state

    def episode(self, omega: Table) -> dict[str, tuple[int, float]]:
        """Steps and return of each agent."""
        seed = self.first_seed if self.n_episodes == 0 else None
        observations, infos = self.env.reset(seed=seed)
        self.n_episodes += 1
        done = dict.fromkeys(self.agents, (0, 0.0))
        playing = [name for name in self.agents if name in observations]
        for name in playing:
            agent = self.agents[name]
            agent.state = self.look(name, observations[name], infos[name])
            agent.action = agent.policy(agent.state)
        while playing:
            chosen = {name: self.encoder.action(name, self.agents[name].action) for name in playing}
            observations, rewards, terminated, truncated, infos = self.env.step(chosen)
            for name in playing:
                ended = terminated[name] or truncated[name]
                s2 = self.look(name, observations[name], infos[name])
                self.agents[name].learn(rewards[name], s2, terminated[name], ended, omega)
                done[name] = done[name][0] + 1, done[name][1] + rewards[name]
            playing = [name for name in playing if not terminated[name] and not truncated[name]]
        for agent in self.agents.values():
            agent.epsilon *= agent.decay
        return done

    def part(self, agent: IndependentAgent, omega: Table) -> tuple[int, float]:
        if id(agent) not in self.parts:
            done = self.episode(omega)
            self.parts = {id(self.agents[name]): part for name, part in done.items()}
        return self.parts.pop(id(agent))
