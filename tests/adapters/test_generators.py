"""Generators that an environment keeps besides np_random: decided by the learner's seed, and saved with it."""

import random
from collections import deque
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Discrete, Tuple

import tuckerl
from tuckerl.adapters.generators import own_generators
from tuckerl.errors import EnvironmentFaultError, ResumeWarning, SavedFileError

KINDS: dict[str, Any] = {
    "Generator": np.random.default_rng,
    "MT19937": lambda: np.random.Generator(np.random.MT19937()),
    "RandomState": np.random.RandomState,
    "random": random.Random,
}


class Own(gymnasium.Env[Any, Any]):
    """Draws from whatever generator it was given, and seeds np_random besides."""

    def __init__(self, rng: Any) -> None:
        self.observation_space, self.action_space = Discrete(4), Discrete(2)
        self.nested = {"deep": [rng]}

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.time = 0
        return self.draw(), {}

    def draw(self) -> int:
        rng = self.nested["deep"][0]
        return int(4 * (rng.random() if hasattr(rng, "random") else rng.random_sample()))

    def step(self, action: Any) -> Any:
        self.time += 1
        return self.draw(), float(self.draw()), False, self.time >= 5, {}


class Samples(Own):
    """Draws from its space, which no reset seeds."""

    def __init__(self) -> None:
        super().__init__(None)

    def draw(self) -> int:
        return int(self.observation_space.sample())


class Global(Own):
    def __init__(self) -> None:
        super().__init__(np.random)

    def draw(self) -> int:
        return int(4 * np.random.random_sample())  # noqa: NPY002  # that is the point


def learned(env: Any, **parameters: Any) -> tuckerl.QLearning:
    return tuckerl.QLearning(env, seed=0, **parameters)


@pytest.mark.parametrize("kind", [*KINDS, "space"])
def test_they_are_decided_by_the_seed_and_go_on_from_a_file(kind: str, tmp_path: Path) -> None:
    def made() -> Any:
        return Samples() if kind == "space" else gymnasium.wrappers.TransformReward(Own(KINDS[kind]()), float)

    whole = learned(made()).learn(20)
    part = learned(made()).learn(8)
    part.save(tmp_path / "agent")
    again = tuckerl.QLearning.load(tmp_path / "agent", env=made()).learn(12)
    assert np.array_equal(whole.returns, again.returns)
    assert np.array_equal(whole.q, again.q)
    assert not np.array_equal(whole.returns[:8], whole.returns[8:16])
    both = learned(made(), n_agents=2).learn(8)
    assert not np.array_equal(both.returns[:, 0], both.returns[:, 1])
    assert np.array_equal(whole.evaluate(5, seed=1).returns, again.evaluate(5, seed=1).returns)


class Fails(Own):
    """Raises once, in its step of this number."""

    fails_in: int | None = None
    steps = 0

    def step(self, action: Any) -> Any:
        self.steps += 1
        if self.steps == self.fails_in:
            raise OSError("once")
        return super().step(action)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("fails_in", [2, 23])  # in the first episode, and later
def test_an_episode_that_was_broken_off_is_played_again(kind: str, fails_in: int) -> None:
    whole = learned(Own(KINDS[kind]())).learn(10)
    env = Fails(KINDS[kind]())
    env.fails_in = fails_in
    agent = learned(env)
    with pytest.raises(EnvironmentFaultError, match="once"):
        agent.learn(10)
    agent.learn(10 - agent.episodes)
    assert np.array_equal(whole.returns, agent.returns)


def test_another_kind_of_generator_is_refused(tmp_path: Path) -> None:
    learned(Own(KINDS["random"]())).learn(2).save(tmp_path / "agent")
    for other in (Own(np.random.default_rng()), Samples()):
        with pytest.raises(SavedFileError, match=r"drew from env.nested\['deep'\]\[0\], a random.Random; this one"):
            tuckerl.QLearning.load(tmp_path / "agent", env=other)


@pytest.mark.parametrize(
    ("env", "reason"),
    [
        (Global(), "it draws from the global generator of NumPy or of random"),
        (Own(random.SystemRandom()), r"env.nested\['deep'\]\[0\] draws from the operating system"),
    ],
)
def test_what_cannot_be_repeated_is_named_once(env: Any, reason: str, tmp_path: Path) -> None:
    agent = learned(env).learn(4)
    with pytest.warns(ResumeWarning, match=f"cannot go on from a file to the last bit: {reason}"):
        agent.save(tmp_path / "agent")
    agent.save(tmp_path / "agent")  # a second warning would be an error


def test_they_are_found_wherever_they_are() -> None:
    env = Own(KINDS["random"]())
    env.observation_space = Tuple([Discrete(2)])
    assert {place for place in own_generators(env).generators if "space" in place} == {
        "env.observation_space._np_random",
        "env.observation_space.spaces[0]._np_random",
        "env.action_space._np_random",
    }
    assert "env.nested['deep'][0]" in own_generators(env).generators
    assert not any("nested" in place for place in own_generators(Global()).generators)


class Slotted:
    __slots__ = ("__rng",)

    def __init__(self) -> None:
        self.__rng = np.random.default_rng()


def test_they_are_found_in_slots_and_containers_of_all_kinds() -> None:
    env = Own({"slotted": deque([Slotted()]), "set": {np.random.default_rng()}, "numbers": list(range(10**6))})
    found = own_generators(env)
    prefix = "env.nested['deep'][0]"
    assert {f"{prefix}['slotted'][0]._Slotted__rng", f"{prefix}['set']<0>"} <= found.generators.keys()
    assert found.reason is not None
    assert "stands where it cannot be found again" in found.reason
    many = own_generators(Own([np.random.default_rng(), {i: (i, i) for i in range(10**6)}]))
    assert f"{prefix}[0]" in many.generators
    assert many.reason == "it holds too many objects to look for generators in all of them"


class MapOfTheAuthor(Own):
    """Draws its map when it is first reset, from a generator that its author seeded."""

    maps: list[list[int]] = []  # noqa: RUF012  # of all of them

    def __init__(self) -> None:
        super().__init__(np.random.default_rng(42))
        self.map: list[int] = []

    def reset(self, **given: Any) -> Any:
        if not self.map:
            self.map = self.nested["deep"][0].permutation(9).tolist()
            self.maps.append(self.map)
        return super().reset(**given)


def test_what_the_author_seeded_is_left_alone() -> None:
    agent = learned(MapOfTheAuthor).learn(2)
    for seed in range(2):
        agent.evaluate(2, seed=seed)
    assert len(MapOfTheAuthor.maps) > 3
    assert all(one == np.random.default_rng(42).permutation(9).tolist() for one in MapOfTheAuthor.maps)


class MadeInReset(Own):
    """Makes its generator in every reset from the seed it is given, or once without one."""

    def __init__(self, is_lazy: bool) -> None:
        super().__init__(None)
        self.is_lazy = is_lazy

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        if not self.is_lazy or self.nested["deep"][0] is None:
            self.nested["deep"][0] = np.random.default_rng(None if self.is_lazy else seed)
        return super().reset(seed=seed, options=options)


@pytest.mark.parametrize("is_lazy", [True, False])
@pytest.mark.parametrize("given", [lambda make: make(), lambda make: make])
@pytest.mark.parametrize("n", [1, 2, 6])
def test_those_made_in_resets_are_decided_too(is_lazy: bool, given: Any, n: int, tmp_path: Path) -> None:
    def make() -> Any:
        return MadeInReset(is_lazy)

    whole, part = learned(given(make)).learn(12), learned(given(make)).learn(n)
    part.save(tmp_path / "agent")
    again = tuckerl.QLearning.load(tmp_path / "agent", env=given(make)).learn(12 - n)
    assert np.array_equal(whole.returns, again.returns)
    assert len(np.unique(whole.returns)) > 3
    assert whole.evaluate(5, seed=1).mean == again.evaluate(5, seed=1).mean
