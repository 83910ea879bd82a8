"""What environments return: what spaces accept is accepted, and what is something else is named with the way out."""

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium import spaces
from gymnasium.vector import SyncVectorEnv

from tests.adapters.parallel_worlds import Leaving, altered
from tuckerl import JointEnv, QLearning, TeamQ, quantile_edges
from tuckerl.errors import (
    LONGEST_MESSAGE,
    EnvironmentFaultError,
    ParameterError,
    ParameterTypeError,
    ProblemError,
    SpaceError,
    TuckerlError,
    UnknownNameError,
)


class Told(gymnasium.Env[Any, Any]):
    """Three steps in five states, of which everything that is returned may be something else."""

    def __init__(self, **told: Any) -> None:
        self.observation_space, self.action_space = spaces.Discrete(5), spaces.Discrete(2)
        self.told, self.clock = told, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        super().reset(seed=seed)
        self.clock = 0
        return self.told.get("reset", (0, {}))

    def step(self, action: Any) -> Any:
        self.clock += 1
        ends = self.told.get("ends", (False, True))
        reward, terminated = self.told.get("reward", 1.0), ends[self.clock == 3]
        return self.told.get("step", (self.clock, reward, terminated, self.told.get("truncated", False), {}))


FLAGS: list[tuple[Any, Any]] = [
    (False, True),
    (np.bool_(False), np.bool_(True)),
    (np.array(False), np.array(True)),
    (0, 1),
    (np.int64(0), np.int8(1)),
    (0.0, 1.0),
    (np.array([False]), np.array([1])),
]


@pytest.mark.parametrize("ends", FLAGS, ids=repr)
def test_flags_of_every_kind_are_read(ends: Any) -> None:
    learner = QLearning(Told(ends=ends), seed=0).learn(2)
    assert learner.steps.tolist() == [[3], [3]]
    truncated = QLearning(Told(ends=(False, False), truncated=ends[1]), seed=0).learn(1)
    assert truncated.steps.tolist() == [[1]]
    team = TeamQ(Told(ends=ends), seed=0, tensor_step=None).learn(1)
    assert team.steps.tolist() == [[3]]


def test_rewards_of_every_kind_are_read() -> None:
    for reward in (1, True, np.float32(1), np.array(1.0)):
        assert QLearning(Told(reward=reward), seed=0).learn(1).returns.tolist() == [[3.0]]


WRONG_STEPS: dict[str, tuple[dict[str, Any], str]] = {
    "four values": (
        {"step": (1, 1.0, False, {})},
        r"four values, as Gym's older API does: .*GymV21Environment",
    ),
    "one value": ({"step": 3}, r"step must return \(observation, reward, terminated, truncated, info\); it returned 3"),
    "no value": ({"step": None}, "failed"),
    "a vector": (
        {"reward": np.ones(2)},
        r"must be one number; .*paid array\(\[1\., 1\.\]\).*TransformReward\(env, sum\).*Linear",
    ),
    "a dict": ({"reward": {"a": 1.0}}, "a reward must be one number; .*LinearReward"),
    "text": ({"reward": "1"}, "a reward must be one number; the environment paid '1'"),
    "nothing": ({"reward": None}, "a reward must be one number; the environment paid None"),
    "NaN": ({"ends": (np.nan, np.nan)}, "`terminated` must be True or False; the environment returned nan"),
    "a word": ({"ends": ("no", "yes")}, "`terminated` must be True or False; the environment returned 'no'"),
    "two": ({"truncated": 2}, "`truncated` must be True or False; the environment returned 2"),
    "None": ({"truncated": None}, "`truncated` must be True or False; the environment returned None"),
}


@pytest.mark.parametrize("case", WRONG_STEPS)
def test_steps_that_return_something_else_are_named(case: str) -> None:
    told, message = WRONG_STEPS[case]
    with pytest.raises(EnvironmentFaultError, match=message) as caught:
        QLearning(Told(**told), seed=0).learn(1)
    assert "episode 0" in str(caught.value)


@pytest.mark.parametrize("returned", [0, np.array([0, 1]), (0, 1), (0, {}, {}), None, {"a": 0}])
def test_a_reset_of_the_older_api_is_named(returned: Any) -> None:
    with pytest.raises(ProblemError, match=r"reset must return \(observation, info\), .*a bare observation is what"):
        QLearning(Told(reset=returned), seed=0)


def paying(reward: Any) -> Any:
    world = Leaving()
    step = world.step
    return altered(world, step=lambda actions: _with(step(actions), 1, dict.fromkeys("abc", reward)))


def ending(terminated: Any) -> Any:
    world = Leaving()
    step = world.step
    return altered(world, step=lambda actions: _with(step(actions), 2, dict.fromkeys("abc", terminated)))


def _with(result: tuple[Any, ...], place: int, part: Any) -> tuple[Any, ...]:
    return (*result[:place], part, *result[place + 1 :])


@pytest.mark.parametrize("learner", [QLearning, TeamQ])
def test_parallel_environments_are_read_alike(learner: Any) -> None:
    with pytest.raises(EnvironmentFaultError, match=r"a reward must be one number; .*LinearReward"):
        learner(paying(np.ones(2)), seed=0).learn(1)
    with pytest.raises(EnvironmentFaultError, match="must be True or False; the environment returned 'no'"):
        learner(ending("no"), seed=0).learn(1)
    world = Leaving()
    step = world.step
    with pytest.raises(EnvironmentFaultError, match="four values, as Gym's older API"):
        learner(altered(world, step=lambda actions: step(actions)[:4]), seed=0).learn(1)
    with pytest.raises(ProblemError, match="a bare observation is what Gym's older API"):
        learner(altered(Leaving(), reset=lambda seed=None, options=None: dict.fromkeys("abc", 0)), seed=0)


@pytest.mark.parametrize("learner", [QLearning, TeamQ])
def test_agents_that_are_reported_after_their_end_are_not_looked_at(learner: Any) -> None:
    def step(actions: Any) -> Any:
        parts = original(actions)
        told = {**dict.fromkeys("abc", 3), **parts[0]}
        return told, {**dict.fromkeys("abc", 99.0), **parts[1]}, *parts[2:]

    world = Leaving()
    original = world.step
    learned = learner(altered(world, step=step), seed=0, epsilon=1.0).learn(2)
    plain = learner(Leaving(), seed=0, epsilon=1.0).learn(2)
    assert learned.steps.tolist() == plain.steps.tolist()
    assert learned.returns.tolist() == plain.returns.tolist()


class Turns(pettingzoo.AECEnv):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    def __init__(self) -> None:
        self.possible_agents = ["x", "y"]


TURNS = "moves agent by agent.* pettingzoo.utils.aec_to_parallel .*turn_based"
OTHER_KINDS: dict[str, tuple[Any, type[TuckerlError], str]] = {
    "turn by turn": (Turns(), ParameterTypeError, TURNS),
    "a class of these": (Turns, ParameterTypeError, f"it made .* {TURNS}"),
    "the id of one": ("classic/tictactoe-v3", ProblemError, f"classic/tictactoe-v3 {TURNS}"),
    "an old spelling": ("rps_v2", UnknownNameError, "unknown environment 'rps_v2': did you mean 'classic/rps-v2'"),
    "a module's name": ("connect_four_v3", UnknownNameError, r"did you mean 'classic/connect_four-v3'\?"),
    "another line": ("classic/leduc-holdem-v4", UnknownNameError, r"did you mean 'classic/leduc_holdem-v4'\?"),
    "a slip": ("classic/tictacto-v3", UnknownNameError, r"did you mean 'classic/tictactoe-v3'\?"),
    "a vector": (SyncVectorEnv([Told, Told]), ParameterTypeError, "a vector environment: .*and n_agents for several"),
}


@pytest.mark.parametrize("case", OTHER_KINDS)
def test_environments_of_other_kinds_are_told_the_way(case: str) -> None:
    env, error, message = OTHER_KINDS[case]
    with pytest.raises(error, match=message):
        QLearning(env, seed=0)


def pixels(shape: tuple[int, ...]) -> spaces.Box:
    return spaces.Box(0, 255, shape, np.uint8)


class Screen(Told):
    def __init__(self, space: spaces.Space[Any]) -> None:
        super().__init__()
        self.observation_space = space


def screens(space: spaces.Space[Any]) -> Any:
    return altered(Leaving(), observation_space=lambda agent: space)


SIGHTS = [pixels((210, 160, 3)), pixels((84, 84, 4)), pixels((8, 8, 3)), spaces.Dict(eye=pixels((64, 64, 3)))]
TAKES: list[Callable[[Any], Any]] = [
    lambda space: QLearning(Screen(space)),
    lambda space: QLearning(Screen(space), bins=2),
    lambda space: QLearning(screens(space)),
    lambda space: TeamQ(screens(space)),
]


@pytest.mark.parametrize("take", TAKES)
@pytest.mark.parametrize("space", SIGHTS, ids=str)
def test_images_are_refused_at_once_with_the_way_out(space: spaces.Space[Any], take: Callable[[Any], Any]) -> None:
    begun = time.monotonic()
    with pytest.raises(SpaceError, match=r"has about 10\^\d+ members .*bins=.*tuckerl\.quantile_edges") as caught:
        take(space)
    assert time.monotonic() - begun < 5.0, "as much as a busy machine needs, not as counting does"
    assert len(str(caught.value)) <= LONGEST_MESSAGE


class Heights(Leaving):
    """One agent observes a Box."""

    def __init__(self) -> None:
        super().__init__()
        self.observation_spaces["b"] = spaces.Box(0.0, 10.0, (2,))

    def observe(self, agent: str) -> Any:
        return np.array([self.clock, 7.0], np.float32) if agent == "b" else np.int64(min(self.clock, 3))


def test_quantiles_of_a_parallel_environment_are_by_agent() -> None:
    edges: Any = quantile_edges(Heights(), 2, steps=50)
    assert list(edges) == ["b"]
    assert [edge.tolist() for edge in edges["b"]] == [[1.0], []]  # of 0, 1 and 2, and always 7
    learner = QLearning(Heights(), bins=edges, seed=0).learn(2)
    assert learner.episodes == 2
    with pytest.raises(SpaceError, match=r"of which an agent observes a Box; .* has none"):
        quantile_edges(Leaving(), 3)
    with pytest.raises(SpaceError, match="observes a Box"):
        quantile_edges(JointEnv(Leaving()), 3)


@pytest.mark.parametrize(
    "learn",
    [
        lambda bins: TeamQ(Heights(), bins=bins, seed=0),
        lambda bins: QLearning(JointEnv(Heights()), bins=bins, seed=0),
    ],
)
def test_a_joint_table_takes_bins_by_agent(learn: Callable[[Any], Any], tmp_path: Any) -> None:
    edges: Any = quantile_edges(Heights(), 2, steps=50)
    learner = learn(edges).learn(2)
    in_order = [edges.get(agent) for agent in Heights().possible_agents]
    np.testing.assert_array_equal(learner.q, learn(in_order).learn(2).q)
    assert learner.problem.n_states == 4 * 2 * 4, "those of a, b and c"
    learner.save(tmp_path / "team.tuckerl")
    loaded = type(learner).load(tmp_path / "team.tuckerl", env=learner.problem.copies.first)
    np.testing.assert_array_equal(loaded.learn(3).q, learner.learn(3).q)
    with pytest.raises(ParameterError, match=r"bins of a joint observation must be a dict by agent, of a, b, c; got"):
        learn({"d": edges["b"]})


def test_attributes_named_like_ours_do_not_matter() -> None:
    env = Told()
    env.mdp = np.zeros((2, 3))  # type: ignore[attr-defined]  # as users' environments may have
    env.P = {s: {a: {0: 0.5, 1: 0.5} for a in range(2)} for s in range(5)}  # type: ignore[attr-defined]  # as users' environments may have
    env.initial_state_distrib = np.full(5, 0.2)  # type: ignore[attr-defined]  # as users' environments may have
    assert QLearning(env, seed=0).problem.kind == "gymnasium"
    env.P = np.full((5, 2, 5), 0.2)  # type: ignore[attr-defined]  # as users' environments may have
    assert QLearning(env, seed=0).problem.kind == "gymnasium"
