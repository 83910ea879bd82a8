"""Edges at the quantiles of random play."""

import math
import random
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary

import tuckerl
from tests.adapters.parallel_worlds import World
from tuckerl import quantile_edges
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError, SpaceError, UnknownNameError
from tuckerl.spaces.bins import value_edges
from tuckerl.spaces.encoder import check_countable, space_encoder


class Ramp(gymnasium.Env[Any, Any]):
    """Observes (steps since the reset, 7, the last action); counts its closings and remembers its seeds and actions."""

    def __init__(self, length: int = 4, shown: Any = None) -> None:
        self.observation_space = Box(-np.inf, np.inf, (3,))
        self.action_space = Discrete(10)
        self.length = length
        self.shown = shown
        self.closed = 0
        self.seeds: list[int | None] = []
        self.actions: list[int] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        self.seeds.append(seed)
        self.time = 0
        return np.array([0.0, 7.0, -1.0]), {"action_mask": np.arange(10) % 2 == 0}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.time += 1
        self.actions.append(int(action))
        observation = np.array([self.time, 7.0, action]) if self.shown is None else self.shown
        return observation, 0.0, False, self.time == self.length, {}

    def close(self) -> None:
        self.closed += 1


def test_quantiles_by_hand() -> None:
    env = Ramp(4)
    edges = quantile_edges(env, [5, 3, 1], steps=20)
    # Five episodes of 0 to 4 and the 0 after the last: quantiles of six 0s and five each of 1, 2, 3, 4.
    seen = [0.0] * 6 + [1.0] * 5 + [2.0] * 5 + [3.0] * 5 + [4.0] * 5
    assert edges[0].tolist() == np.quantile(seen, [0.2, 0.4, 0.6, 0.8]).tolist()[1:]  # the first, 0, has none below
    assert edges[1].tolist() == []  # always 7
    assert edges[2].tolist() == []  # one bin
    assert space_encoder(env.observation_space, edges).sizes == (4, 1, 1)


def test_bins_fill_evenly() -> None:
    edges = quantile_edges("MountainCar-v0", 5, steps=3000, seed=1)
    env = gymnasium.make("MountainCar-v0")
    assert isinstance(env.observation_space, Box)
    env.action_space.seed(99)
    seen = [env.reset(seed=99)[0]]
    for _ in range(3000):
        observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
        seen.append(observation)
        if terminated or truncated:
            seen.append(env.reset()[0])
    code = space_encoder(env.observation_space, edges)
    assert code.layout == (5, 5)
    rows, columns = np.divmod(code.encode_many(np.array(seen)), 5)
    assert np.bincount(rows, minlength=5).min() > 0.1 * len(seen)
    assert np.bincount(columns, minlength=5).min() > 0.1 * len(seen)


def test_seeds_repeat_and_differ() -> None:
    first, again, other = (quantile_edges("CartPole-v1", 4, steps=300, seed=seed) for seed in (0, 0, 1))
    assert all(map(np.array_equal, first, again))
    assert not any(map(np.array_equal, first, other))
    sequence = np.random.SeedSequence(0)
    assert all(map(np.array_equal, first, quantile_edges("CartPole-v1", 4, steps=300, seed=sequence)))


def test_actions_and_environment_have_seeds_of_their_own_and_no_global_one() -> None:
    np.random.seed(3)  # noqa: NPY002  # to see that it is left alone
    before = np.random.get_state()[1].tolist()  # type: ignore[index]  # noqa: NPY002
    env, again = Ramp(), Ramp()
    quantile_edges(env, 2, steps=50, seed=5)
    quantile_edges(again, 2, steps=50, seed=5)
    assert np.random.get_state()[1].tolist() == before  # type: ignore[index]  # noqa: NPY002
    assert env.actions == again.actions
    assert env.seeds == again.seeds
    assert None not in env.seeds, "each reset is given one where no generator goes on from one to the next"
    assert len(set(env.seeds)) == len(env.seeds)
    assert len(set(env.actions)) == 10
    even = np.array([1, 0] * 5, np.int8)
    for seed in env.seeds:
        twin = Discrete(10, seed=seed)
        assert env.actions != [int(twin.sample(even if i % 4 == 0 else None)) for i in range(50)]


class Drifting(Ramp):
    """Draws from generators of its own, of which no reset knows."""

    def __init__(self) -> None:
        super().__init__()
        self.rng, self.noise = np.random.default_rng(), random.Random()  # noqa: S311  # a toy

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        _, *result = super().step(action)
        return np.array([self.rng.normal(), self.noise.random(), 7.0]), *result  # type: ignore[return-value]  # a tuple of as many


class DriftingTeam(World):
    """Two agents that are shown what such generators give."""

    def __init__(self) -> None:
        super().__init__({agent: Box(-np.inf, np.inf, (1,)) for agent in "ab"}, {agent: Discrete(2) for agent in "ab"})
        self.rng = np.random.default_rng()

    def observe(self, agent: str) -> Any:
        return self.rng.normal(size=1)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        return dict.fromkeys("ab", 0.0), set(), set("ab") if self.clock == 3 else set()


def test_a_seed_decides_what_generators_of_an_environments_own_draw() -> None:
    first, again, other = (quantile_edges(Drifting(), 3, steps=40, seed=seed) for seed in (0, 0, 1))
    assert all(map(np.array_equal, first, again))
    assert not np.array_equal(first[0], other[0])
    assert not np.array_equal(first[1], other[1])
    team: list[Any] = [quantile_edges(DriftingTeam(), 3, steps=40, seed=seed) for seed in (0, 0, 1)]
    assert all(np.array_equal(*(edges[agent] for edges in team[:2])) for agent in "ab")
    assert not np.array_equal(team[0]["a"], team[2]["a"])


def test_masked_actions_are_not_taken() -> None:
    env = Ramp(length=1)  # every action is the first after a reset, where the odd ones are masked
    quantile_edges(env, 2, steps=50)
    assert set(env.actions) == {0, 2, 4, 6, 8}


class MaskedRamp(Ramp):
    """The same, with its masks in what it observes."""

    def __init__(self, length: int = 4) -> None:
        super().__init__(length)
        self.ramp = self.observation_space
        self.observation_space = Dict(observation=self.ramp, action_mask=MultiBinary(10))

    def reset(self, **given: Any) -> tuple[Any, dict[str, Any]]:
        observation, info = super().reset(**given)
        return {"observation": observation} | info, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, *others = super().step(action)
        return {"observation": observation, "action_mask": np.arange(10) < 3}, *others  # type: ignore[return-value]  # a tuple of as many


def test_a_box_may_lie_beside_a_mask() -> None:
    env = MaskedRamp()
    edges = quantile_edges(env, [5, 3, 1], steps=20)
    plain = quantile_edges(Ramp(), [5, 3, 1], steps=20)
    assert all(map(np.array_equal, edges, plain))
    assert {action % 2 for action in env.actions[::4]} == {0}, "the even ones after a reset"
    assert set(env.actions) - set(env.actions[::4]) <= {0, 1, 2}
    assert tuckerl.QLearning(MaskedRamp(), bins=edges, seed=0).learn(2).q.shape == (1, 4, 10)


def test_what_is_made_is_closed_and_what_is_given_is_not() -> None:
    env = Ramp()
    quantile_edges(env, 2, steps=5)
    assert env.closed == 0
    quantile_edges(lambda: env, 2, steps=5)
    assert env.closed == 1


def test_what_is_made_is_closed_where_it_is_refused() -> None:
    env = Ramp(shown=np.zeros(2))
    with pytest.raises(ObservationError):
        quantile_edges(lambda: env, 2, steps=5)
    assert env.closed == 1


@pytest.mark.parametrize("shown", [np.array([0.0, math.nan, 0.0]), np.array([0.0, 0.0, math.inf])])
def test_observations_must_be_finite(shown: Any) -> None:
    with pytest.raises(
        ObservationError, match=r"quantiles need finite observations; got array\(.*: give edges instead"
    ):
        quantile_edges(Ramp(shown=shown), 2, steps=5)


def test_observations_must_have_the_shape_of_their_space() -> None:
    with pytest.raises(ObservationError, match=r"must have the shape of Box\(.*; got shape \(2,\)"):
        quantile_edges(Ramp(shown=np.zeros(2)), 2, steps=5)


def test_only_boxes_have_quantiles() -> None:
    with pytest.raises(SpaceError, match=r"observes a Box; .*FrozenLake.* observes Discrete\(16\)"):
        quantile_edges("FrozenLake-v1", 4)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"bins": 0}, ParameterError, "bins of dimension 0 must be a whole number from 1 to"),
        ({"bins": [2, 2]}, ParameterError, "one entry for each of 3 dimensions; got 2"),
        ({"bins": [2, 2, [0.5]]}, ParameterTypeError, "bins of dimension 2 must be a whole number"),
        ({"bins": 2, "steps": 0}, ParameterError, "steps must be a whole number of at least 1; got 0"),
        ({"bins": 2, "seed": -1}, ParameterError, "seed must be a whole number of at least 0"),
    ],
)
def test_impossible_numbers(arguments: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        quantile_edges(Ramp(), **arguments)


@pytest.mark.parametrize("env", [3, lambda: 3, None])
def test_other_things_than_environments(env: Any) -> None:
    with pytest.raises(ParameterTypeError, match=r"must (be|make) a Gymnasium environment.* PettingZoo"):
        quantile_edges(env, 2)


def test_misspelt_ids() -> None:
    with pytest.raises(UnknownNameError, match="unknown environment 'CartPole-v7': did you mean 'CartPole-v1'"):
        quantile_edges("CartPole-v7", 2)
    with pytest.raises(UnknownNameError, match="there is no module 'no_such_module'"):
        quantile_edges("no_such_module:CartPole-v1", 2)
    assert len(quantile_edges("gymnasium:CartPole-v1", 2, steps=10)) == 4


def test_it_is_public() -> None:
    assert tuckerl.quantile_edges is quantile_edges


@pytest.mark.parametrize(("low", "high"), [(2**53 - 9, 2**53 - 1), (1 - 2**53, 9 - 2**53)])
def test_whole_numbers_have_bins_of_their_own_as_far_as_floats_part_them(low: int, high: int) -> None:
    (edges,) = value_edges(Box(low, high, (1,), np.int64)) or ()
    np.testing.assert_array_equal(edges, np.arange(low + 1, high + 1))
    beyond = Box(low - 1, high, (1,), np.int64) if low < 0 else Box(low, high + 1, (1,), np.int64)
    assert value_edges(beyond) is None


def test_more_bins_than_numbers_are_refused_before_they_are_made() -> None:
    with pytest.raises(SpaceError, match=r"has about 10\^24 members with bins=16, more than"):
        check_countable(Box(0, 1, (20,)), bins=16)
