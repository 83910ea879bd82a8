"""The seeds of an environment's episodes: which are given, and that they go on from a file."""

import json
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TransformReward

from tests.adapters.parallel_worlds import Dice, Leaving
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.seeding import EpisodeSeeds, generator_of
from tuckerl.errors import SavedFileError

SEQUENCE = np.random.SeedSequence(5, spawn_key=(2, 0))


def seed_of(number: int) -> int:
    return int(np.random.SeedSequence(5, spawn_key=(2, 0, number)).generate_state(1)[0])


class Draws(gymnasium.Env[Any, Any]):
    """Observes what it draws from its generator; keeps the seeds that it was given."""

    def __init__(self, kind: Any = np.random.PCG64) -> None:
        self.seeds: list[int | None] = []
        self.kind = kind

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        self.seeds.append(seed)
        if seed is not None:
            self._np_random = np.random.Generator(self.kind(seed))
        return int(self.np_random.integers(2**60)), {}


class Forgets(Draws):
    """Draws from a generator that is made anew by every seed and that nobody may look at."""

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        self.seeds.append(seed)
        if seed is not None:
            self._hidden = np.random.default_rng(seed)
        return int(self._hidden.integers(2**60)), {}


def begun(env: Any) -> EpisodeSeeds:
    seeds = EpisodeSeeds(env)
    seeds.sequence = SEQUENCE
    return seeds


def test_an_environment_with_a_generator_gets_one_seed() -> None:
    env = Draws()
    seeds = begun(env)
    seen = [seeds.reset()[0] for _ in range(3)]
    assert env.seeds == [seed_of(0), None, None]
    rng = np.random.default_rng(seed_of(0))
    assert seen == [int(rng.integers(2**60)) for _ in range(3)]


def test_an_environment_without_one_gets_a_seed_each_time() -> None:
    env = Forgets()
    seeds = begun(env)
    for _ in range(3):
        seeds.reset()
    assert env.seeds == [seed_of(0), seed_of(1), seed_of(2)]
    assert len(set(env.seeds)) == 3


@pytest.mark.parametrize("kind", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64])
@pytest.mark.parametrize("n_before", [0, 1, 4])
def test_resets_go_on_through_json(kind: Any, n_before: int) -> None:
    for make in (lambda: Draws(kind), lambda: Forgets(kind), lambda: TransformReward(Draws(kind), float)):
        seeds = begun(make())
        for _ in range(n_before):
            seeds.reset()
        text = json.dumps(seeds.saved())
        again = begun(make())
        again.restore(json.loads(text))
        assert [again.reset()[0] for _ in range(3)] == [seeds.reset()[0] for _ in range(3)]


def test_another_generator_is_refused() -> None:
    seeds = begun(Draws())
    seeds.reset()
    for other in (Draws(np.random.SFC64), Forgets()):
        with pytest.raises(SavedFileError, match="drew from np_random, a PCG64; this one does not: load with the same"):
            begun(other).restore(seeds.saved())


def test_what_decides_in_a_joint_environment_is_inside_of_it() -> None:
    dice = Dice()
    assert generator_of(JointEnv(dice)) is dice.np_random
    assert generator_of(dice) is dice.np_random
    joint = JointEnv(Leaving())
    joint.reset(seed=3)  # seeds a generator of its own, from which nothing is drawn
    assert generator_of(joint) is None


def test_asking_for_a_generator_makes_none() -> None:
    env = Draws()
    assert generator_of(env) is None
    assert env._np_random is None


def test_places_are_named() -> None:
    seeds = begun(Draws())
    seeds.reset()
    assert seeds.where(0) == f"in reset of episode 0 of this environment (seed {seed_of(0)})"
    seeds.reset()
    assert seeds.where(7) == f"in step 7 of episode 1 of this environment (seed {seed_of(0)})"
