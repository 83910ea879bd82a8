"""Environments that are made in the same way are the same, or it is said that they are not."""

import copy
import random
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Discrete
from gymnasium.utils import EzPickle
from pettingzoo.utils import aec_to_parallel, parallel_to_aec

import tuckerl
from tests.adapters.parallel_worlds import Meeting
from tuckerl.adapters.alike import difference_of_data
from tuckerl.adapters.resolve import AdapterOptions, as_problem
from tuckerl.errors import EnvironmentFaultError, ProblemError


class Noise(gymnasium.Env[Any, Any]):
    """Draws all that happens; it must not be used any more once it is closed."""

    def __init__(self) -> None:
        self.observation_space, self.action_space, self.closed, self.time = Discrete(4), Discrete(2), False, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        assert not self.closed
        super().reset(seed=seed)
        self.time = 0
        return int(self.np_random.integers(4)), {}

    def step(self, action: Any) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.time += 1
        return int(self.np_random.integers(4)), float(self.np_random.normal()), False, self.time >= 5, {}

    def close(self) -> None:
        self.closed = True


def learned(env: Any, **parameters: Any) -> tuckerl.QLearning:
    return tuckerl.QLearning(env, seed=0, **parameters)


@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("wrap", [lambda env: env, lambda env: gymnasium.wrappers.TimeLimit(env, 4)])
def test_one_object_that_a_callable_hands_out_again_is_copied(n_agents: int, wrap: Any) -> None:
    env = Noise()
    agent = learned(lambda: wrap(env), n_agents=n_agents).learn(5)
    agent.evaluate(3)
    agent.learn(5)
    assert not env.closed
    assert np.array_equal(agent.q, learned(lambda: wrap(Noise()), n_agents=n_agents).learn(10).q)


def test_what_is_handed_out_is_not_closed_when_its_table_is_played() -> None:
    closed: list[int] = []
    lake = gymnasium.make("FrozenLake-v1")
    lake.unwrapped.close = lambda: closed.append(1)  # type: ignore[method-assign]  # to see whether it is called
    as_problem(lambda: lake)
    assert not closed


@pytest.mark.parametrize("compiled", ["auto", False])
def test_a_map_that_is_drawn_by_the_way_is_refused(compiled: Any) -> None:
    def drawn() -> Any:
        return gymnasium.make("FrozenLake-v1", desc=None, map_name=None, is_slippery=False)

    with pytest.raises(ProblemError, match=r"two environments made by .*drawn differ \(in .*\): something is drawn"):
        learned(drawn, compiled=compiled)
    lake = drawn()
    agent = learned(lake, n_agents=2, compiled=compiled)
    if compiled is False:
        worlds: Any = agent._state.worlds
        maps = [world.env.unwrapped.desc for world in worlds]
        assert np.array_equal(maps[0], maps[1])


class Numbered(Noise):
    """Has a number of its own that changes nothing."""

    made = 0

    def __init__(self) -> None:
        super().__init__()
        Numbered.made += 1
        self.number, self.rng = Numbered.made, np.random.default_rng()

    def step(self, action: Any) -> Any:
        observation, _, *rest = super().step(action)
        return observation, self.rng.normal() + random.random(), *rest  # noqa: S311  # no secret


def test_a_callable_that_has_a_few_only_gives_all_of_them() -> None:
    few = [Numbered(), Numbered()]
    handed = iter(few)
    worlds: Any = learned(lambda: next(handed), n_agents=2)._state.worlds
    assert [world.env for world in worlds] == few


class Seldom(Noise):
    """Draws when it is made what rewards are multiplied by, in one episode of four."""

    def __init__(self) -> None:
        super().__init__()
        self.scale, self.first = random.random(), 0  # noqa: S311  # no secret

    def reset(self, **given: Any) -> Any:
        self.first, info = super().reset(**given)
        return self.first, info

    def step(self, action: Any) -> Any:
        observation, reward, *rest = super().step(action)
        return observation, reward * (self.scale if self.first == 3 else 1.0), *rest


def test_what_differs_in_a_few_episodes_only_differs() -> None:
    with pytest.raises(ProblemError, match=r"two environments made by .*Seldom.* differ \(in scale\)"):
        learned(Seldom)


class Drawn(Meeting):
    """A parallel environment that draws when it is made what its rewards are multiplied by."""

    def __init__(self) -> None:
        super().__init__()
        self.scale = random.random()  # noqa: S311  # no secret

    def step(self, actions: Any) -> Any:
        observations, rewards, *rest = super().step(actions)
        return observations, dict.fromkeys(rewards, self.scale), *rest


def test_only_differences_in_play_are_refused() -> None:
    state = random.getstate()
    assert as_problem(Numbered).n_states == 4
    assert random.getstate() == state
    assert as_problem(Meeting).n_states == 5
    with pytest.raises(ProblemError, match=r"two environments made by Drawn differ \(in scale\)"):
        as_problem(Drawn)


class Shuffled(gymnasium.ObservationWrapper[Any, Any, Any]):
    """Shows observations by other numbers than those made just before it, as if it had drawn them."""

    made = 0

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        Shuffled.made += 1
        self.order = np.roll(range(4), Shuffled.made).tolist()

    def observation(self, observation: int) -> int:
        return int(self.order[observation])


class Weighed(gymnasium.RewardWrapper[Any, Any]):
    """Draws when it is made what changes nothing."""

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self.number = random.random()  # noqa: S311  # no secret

    def reward(self, reward: Any) -> float:
        return float(reward)


def test_what_wrappers_draw_is_noticed_wherever_they_stand() -> None:
    for wrap in (Shuffled, lambda env: gymnasium.wrappers.TimeLimit(Weighed(Shuffled(env)), 4)):
        with pytest.raises(ProblemError, match=r"differ \(in (order|number).*: something is drawn when they are made"):
            as_problem(lambda: wrap(Noise()))  # noqa: B023  # called at once
    assert as_problem(lambda: Weighed(Noise())).n_states == 4
    noise = Noise()
    noise.env = noise  # type: ignore[attr-defined]  # as some name themselves
    assert learned(noise, n_agents=2).learn(2).episodes == 2
    with pytest.raises(ProblemError, match=r"differ \(in scale\)"):
        as_problem(lambda: aec_to_parallel(parallel_to_aec(Drawn())))


class Field(Noise):
    """Keeps what it drew under a name by which wrappers keep what they wrap."""

    def __init__(self) -> None:
        super().__init__()
        self.env = np.random.default_rng().random(3)

    def step(self, action: Any) -> Any:
        observation, _, *rest = super().step(action)
        return observation, float(self.env[action]), *rest


def test_what_only_has_a_wrappers_name_is_compared_as_all_else() -> None:
    with pytest.raises(ProblemError, match=r"two environments made by Field differ \(in env\)"):
        as_problem(Field)


class RemadeScale(gymnasium.RewardWrapper[Any, Any], EzPickle):
    """A wrapper that is made anew where it should be copied."""

    def __init__(self, env: Any) -> None:
        EzPickle.__init__(self, env)
        super().__init__(env)
        self.scale = 1.0

    def reward(self, reward: Any) -> float:
        return self.scale * float(reward)


def test_a_copy_whose_wrapper_is_another_is_refused_where_one_is_needed() -> None:
    env = RemadeScale(Noise())
    learned(env, n_agents=2).evaluate(2)
    env.scale = 3.0
    with pytest.raises(
        ProblemError, match=r"a copy of RemadeScale.*is not like it \(in scale\)|a copy of Noise is not"
    ):
        learned(env, n_agents=2)


class Remade(Noise, EzPickle):
    """Is made anew where it should be copied."""

    def __init__(self, wind: float = 0.0) -> None:
        EzPickle.__init__(self, wind)
        super().__init__()
        self.wind, self.n_resets = wind, 0

    def reset(self, **given: Any) -> Any:
        self.n_resets += 1
        return super().reset(**given)

    def step(self, action: Any) -> Any:
        observation, reward, *rest = super().step(action)
        return observation, reward + self.wind, *rest


def test_a_copy_that_is_another_is_refused_where_one_is_needed() -> None:
    env = Remade(2.0)
    env.reset()  # what it counts since then changes nothing
    learned(env, n_agents=2).evaluate(2)
    env.wind = 3.0
    agent = learned(env).learn(2)
    with pytest.raises(ProblemError, match=r"a copy of Remade is not like it \(in wind\), as its class says"):
        agent.evaluate(2)


def test_a_learner_is_not_copied_where_its_environment_would_be_made_anew() -> None:
    for env in (Remade, Remade(), gymnasium.wrappers.TimeLimit(Remade(), 4)):
        agent = learned(env).learn(2)
        with pytest.raises(ProblemError, match=r"as Remade says itself how it is copied: use the learner's save\(\)"):
            copy.deepcopy(agent)
    copy.deepcopy(learned(Noise).learn(2))


class Growing(Noise):
    """Has one action more after some episodes."""

    episodes = 0

    def reset(self, **given: Any) -> Any:
        self.episodes += 1
        if self.episodes > 3:
            self.action_space = Discrete(3)
        return super().reset(**given)


def test_spaces_that_change_between_resets_are_named() -> None:
    agent = learned(Growing())
    with pytest.raises(EnvironmentFaultError, match=r"spaces must stay as they are.*: action n was 2; got 3; declare"):
        agent.learn(9)
    team = Meeting()
    worlds = as_problem(team)
    team.action_space = lambda agent: Discrete(7)  # type: ignore[method-assign]  # as a user would alter it
    with pytest.raises(ProblemError, match="action n was 3; got 7"):
        worlds.world().begin()  # type: ignore[attr-defined]  # it is stepped in Python


def test_data_are_compared_attribute_by_attribute() -> None:
    assert difference_of_data([1, {"a": (2.0, "x")}], [1, {"a": (2.0, "x")}]) is None
    assert difference_of_data({"a": [1, 2]}, {"a": [1, 3]}) == "['a'][1]"
    assert difference_of_data([np.nan, np.array([np.nan])], [np.nan, np.array([np.nan])]) is None
    assert difference_of_data(np.zeros(2), np.zeros(3)) == ""
    assert difference_of_data({1, 2}, {1, 3}) == ""
    ragged = np.array([np.zeros(2), np.zeros(3)], dtype=object)
    assert difference_of_data(ragged, copy.deepcopy(ragged)) is None
    assert difference_of_data(ragged, np.array([np.zeros(2), np.ones(3)], dtype=object)) == ".flat[1]"
    loop: list[Any] = [1]
    loop.append(loop)
    assert difference_of_data(loop, [1, [1, loop]]) is None
    assert difference_of_data(Remade(1.0), Remade(2.0)) in ("wind", "_ezpickle_args[0]")


@pytest.mark.parametrize("options", [AdapterOptions(), AdapterOptions(compiled=False)])
def test_this_librarys_own_are_alike(options: AdapterOptions) -> None:
    for name in ("tuckerl/DynaMaze-v0", "FrozenLake-v1", "Taxi-v4"):
        assert as_problem(lambda: gymnasium.make(name), options).difference(as_problem(name, options)) is None  # noqa: B023  # called at once
