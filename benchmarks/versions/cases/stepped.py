"""Environments that Python steps: Gymnasium's, PettingZoo's with tables of their own, and teams."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pettingzoo

import tuckerl
from benchmarks.versions.cases.case import VARIANTS, Case, World, learning
from benchmarks.versions.cases.worlds import Party, Wander

RESCUE = "tuckerl/RobotRescue-v0"


def _of_samples(make: Callable[[], Any]) -> Callable[[Any, bool], np.ndarray]:
    """Return what asks a learner for its actions at some observations of a Gymnasium environment."""

    def look(learner: Any, greedy: bool) -> np.ndarray:
        space = make().observation_space
        space.seed(0)
        return np.array([learner.predict(space.sample(), deterministic=greedy)[0] for _ in range(50)])

    return look


def _of_agents(make: Callable[[], Any]) -> Callable[[Any, bool], np.ndarray]:
    """Return what asks for the actions of all agents of a PettingZoo environment."""

    def look(learner: Any, greedy: bool) -> np.ndarray:
        env, rng = make(), np.random.default_rng(0)
        asked = [
            {name: int(rng.integers(env.observation_space(name).n)) for name in env.possible_agents} for _ in range(50)
        ]
        answers = [learner.predict(observations, deterministic=greedy)[0] for observations in asked]
        return np.array([[answer[name] for name in env.possible_agents] for answer in answers])

    return look


def _named(name: str, episodes: int, **parameters: Any) -> World:
    return World(lambda: name, episodes, parameters, _of_samples(lambda: gymnasium.make(name)))


def _party(**how: bool) -> Any:
    return Party({"a": 5, "b": 3, "c": 9}, 4, 3, **how)


def _of_rescue(make: Callable[[], Any] | None = None) -> Callable[[Any, bool], np.ndarray]:
    return _of_agents(lambda: pettingzoo.make("parallel", RESCUE))


WORLDS = {
    "MountainCar-v0": _named("MountainCar-v0", 8, bins=8),
    "CartPole-v1": _named("CartPole-v1", 20, bins=[[-1, 1], [-0.5, 0.5], [-0.1, 0.0, 0.1], [-1, 1]]),
    "Blackjack-v1": _named("Blackjack-v1", 300),
    "Taxi-v4, stepped": _named("Taxi-v4", 10, compiled=False),
    "FrozenLake-v1, stepped": _named("FrozenLake-v1", 60, compiled=False, initial_q=0.5),
    "a ring with masks": World(
        lambda: Wander(9, 4, masked=True), 60, look=_of_samples(lambda: Wander(9, 4, masked=True))
    ),
    "a ring that is always seeded": World(lambda: Wander(9, 4, keeps_generator=False), 60),
}

PLAYERS = {
    "robot rescue, tables apart": World(lambda: RESCUE, 6, look=_of_rescue()),
    "a party": World(_party, 60, look=_of_agents(_party)),
    "a party with masks": World(lambda: _party(masked=True, truncated=True), 60, look=_of_agents(_party)),
}

TEAMS = {
    "robot rescue, a team": World(lambda: RESCUE, 4, {"team_reward": "sum"}, _of_rescue()),
    "robot rescue, lifted": World(lambda: RESCUE, 8),
    "a party, a team": World(_party, 60, {"team_reward": "sum"}, _of_agents(_party)),
    "a party, paid as one": World(lambda: _party(masked=True), 60, {"team_reward": "b"}, _of_agents(_party)),
    "a party, joined": World(lambda: tuckerl.JointEnv(_party(truncated=True)), 60, look=_of_agents(_party)),
}

FEW = ("Q-learning", "SARSA(0.9)", "Dyna-H, random", "Team-Q, joint, cut")
"""Variants for options that no kernel depends on."""


def cases() -> Iterator[Case]:
    """Give all cases of this module."""
    for where, world in WORLDS.items():
        for what, (kind, parameters) in VARIANTS.items():
            yield learning(f"{what} on {where}", world, kind, parameters, shown=True)
    for where, world in PLAYERS.items():
        for what, (kind, parameters) in VARIANTS.items():
            if kind != "TeamQ":
                yield learning(f"{what} on {where}", world, kind, parameters, shown=True)
    for where, world in TEAMS.items():
        for what, (kind, parameters) in VARIANTS.items():
            if kind == "TeamQ":
                yield learning(f"{what} on {where}", world, kind, parameters, shown=True)
    for what in FEW:
        kind, parameters = VARIANTS[what]
        for how, options in OPTIONS.items():
            yield learning(f"{what} on a ring, {how}", WORLDS["a ring with masks"], kind, parameters | options)


OPTIONS: dict[str, dict[str, Any]] = {
    "first of ties": {"ties": "first"},
    "schedules": {"alpha": tuckerl.Harmonic(0.5, 20), "epsilon": tuckerl.Linear(1.0, 0.05, 30)},
    "terminal states are bootstrapped": {"bootstrap_terminal": True, "initial_q": 1.0},
    "three agents": {"n_agents": 3},
}
