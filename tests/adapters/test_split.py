"""Joint environments as parallel ones, and both ways round."""

import copy
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Discrete, MultiBinary, MultiDiscrete, Tuple
from gymnasium.wrappers import TimeLimit
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test
from pettingzoo.utils import parallel_to_aec

from tests.adapters.parallel_worlds import Dice, Leaving, Masked, MaskedInObservation, Meeting, Unequal, altered
from tuckerl import JointEnv, QLearning, SplitEnv
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError, ProblemError


class Sum(gymnasium.Env[Any, Any]):
    """Two numbers from 0 to 5 are drawn; each of two agents adds 0, 1 or 2 to its own, the second sees it in binary.

    The reward is a tenth of both numbers' sum; the episode ends when the sum is 12 or more.
    """

    observation_space = Tuple([Discrete(20), MultiBinary(5)])
    action_space = Tuple([Discrete(3), MultiDiscrete([3])])

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.numbers = self.np_random.integers(6, size=2) if options is None else np.array(options["numbers"])
        return self.observe(), {"total": int(self.numbers.sum())}

    def observe(self) -> Any:
        return self.numbers[0], np.array([self.numbers[1] >> place & 1 for place in range(5)], dtype=np.int8)

    def step(self, action: Any) -> Any:
        self.numbers = self.numbers + np.array([action[0], action[1][0]])
        total = int(self.numbers.sum())
        return self.observe(), total / 10, total >= 12, False, {"total": total}

    def render(self) -> Any:
        return str(self.numbers)


def rescue() -> Any:
    return pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", render_mode="ansi", max_cycles=40)


def both_ways(env: Any) -> SplitEnv:
    return SplitEnv(JointEnv(env))


@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")  # as with every Discrete space; it is allowed
@pytest.mark.parametrize("make", [rescue, Meeting, Leaving, Unequal, Masked, MaskedInObservation, Dice])
def test_pettingzoo_finds_no_fault(make: Any) -> None:
    parallel_api_test(both_ways(make()), num_cycles=100)
    parallel_seed_test(lambda: both_ways(make()), num_cycles=30)


@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")
def test_pettingzoo_finds_no_fault_when_agents_move_one_by_one() -> None:
    api_test(parallel_to_aec(both_ways(rescue())), num_cycles=100)
    seed_test(lambda: parallel_to_aec(both_ways(rescue())), num_cycles=30)


def plain(value: Any) -> Any:
    """What an environment returned, so that == compares it."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [plain(part) for part in value]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


@pytest.mark.parametrize("make", [rescue, Meeting, lambda: Leaving((4, 4)), lambda: Leaving((4, 4), "ab")])
def test_there_and_back_is_the_environment_itself_where_rewards_are_common(make: Any) -> None:
    env, back = make(), both_ways(make())
    common = not isinstance(env, Leaving)
    assert back.possible_agents == env.possible_agents
    rng = np.random.default_rng(0)
    for _ in range(3):
        assert plain(back.reset(seed=4)) == plain(env.reset(seed=4))
        while env.agents:
            actions = {agent: rng.integers(env.action_space(agent).n) for agent in env.agents}
            ours, own = back.step(actions), env.step(actions)
            assert plain(ours[0::2]) == plain(own[0::2])
            assert ours[3] == own[3]
            assert ours[1] == (own[1] if common else dict.fromkeys("ab", sum(own[1].values()) / 2))
            assert back.agents == env.agents
            assert back.render() == env.render()


def told(result: tuple[Any, ...]) -> Any:
    """What a joint environment returns where `result` was split among two agents."""
    return plain((*result[:-1], {"infos": dict.fromkeys(["agent_0", "agent_1"], result[-1])}))


@pytest.mark.parametrize("limit", [4, 2, 3], ids=["ends itself", "cut", "both at once"])
def test_back_and_there_is_the_environment_itself(limit: int) -> None:
    env, back = TimeLimit(Sum(), limit), JointEnv(SplitEnv(TimeLimit(Sum(), limit)))
    assert back.observation_space == env.observation_space
    assert back.action_space == env.action_space
    for seed, options in [(7, None), (None, None), (None, {"numbers": (4, 2)})]:  # the last: 12 after three steps
        assert plain(back.reset(seed=seed, options=options)) == told(env.reset(seed=seed, options=options))
        ends = (False, False)
        while not any(ends):
            own = env.step((1, np.array([1])))
            assert plain(back.step((1, np.array([1])))) == told(own)
            ends = own[2:4]
    assert ends == {4: (True, False), 2: (False, True), 3: (True, True)}[limit]


def test_every_agent_is_given_its_part() -> None:
    env = SplitEnv(Sum(), ["plus", "binary"])
    assert env.action_space("binary") is env.action_space("binary") == MultiDiscrete([3])
    assert env.observation_space("plus") == Discrete(20)
    assert env.agents == []
    observations, infos = env.reset(options={"numbers": (3, 5)})
    assert env.agents == env.possible_agents == ["plus", "binary"]
    assert env.agents is not env.possible_agents
    assert plain(observations) == {"plus": 3, "binary": [1, 0, 1, 0, 0]}
    assert infos == {"plus": {"total": 8}, "binary": {"total": 8}}
    observations, rewards, terminated, truncated, infos = env.step({"binary": np.array([2]), "plus": 1})
    assert plain(observations) == {"plus": 4, "binary": [1, 1, 1, 0, 0]}
    assert rewards == {"plus": 1.1, "binary": 1.1}
    assert terminated == truncated == {"plus": False, "binary": False}
    infos["plus"]["total"] = 0
    assert infos["binary"] == {"total": 11}
    assert env.step({"binary": np.array([0]), "plus": 1})[2] == {"plus": True, "binary": True}
    assert env.agents == []


class Told(Sum):
    """Returns from steps, in the places given, what it is told to."""

    def __init__(self, **told: Any) -> None:
        self.told = told

    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        parts = {"reward": reward, "terminated": terminated, "truncated": truncated} | self.told
        return observation, *parts.values(), info


@pytest.mark.parametrize("rewards", [(1.0, 2.0), [1, 2], np.array([1.0, 2.0], np.float32)])
def test_every_agent_is_paid_its_own_where_there_is_one_for_each(rewards: Any) -> None:
    env = SplitEnv(Told(reward=rewards), ["plus", "binary"])
    learner = QLearning(env, seed=0).learn(1)
    assert learner.returns[0, 1] == 2 * learner.returns[0, 0] == 2 * learner.steps[0, 0]


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"reward": [1.0, 2.0, 3.0]}, r"a reward must be one number; the environment paid \[1.0, 2.0, 3.0\]"),
        ({"reward": [1.0, [2.0]]}, r"a reward must be one number; the environment paid \[2.0\]"),
        ({"reward": "1"}, "a reward must be one number; the environment paid '1'"),
        ({"terminated": [False, False]}, "`terminated` must be True or False"),
        ({"truncated": np.nan}, "`truncated` must be True or False"),
    ],
)
def test_what_no_step_returns_is_named(told: dict[str, Any], message: str) -> None:
    env = SplitEnv(Told(**told))
    env.reset(seed=0)
    with pytest.raises(ProblemError, match=message):
        env.step({"agent_0": 1, "agent_1": np.array([1])})


@pytest.mark.parametrize("make", [Masked, MaskedInObservation])
def test_every_agent_is_given_its_own_mask(make: Any) -> None:
    env = both_ways(make(2))
    _, infos = env.reset()
    assert plain({agent: info["action_mask"] for agent, info in infos.items()}) == {
        "first": [0, 1, 1],
        "second": [1, 0, 1],
    }
    env.step({"first": 1, "second": 0})
    infos = env.step({"first": 0, "second": 0})[-1]
    assert plain(infos["first"]["action_mask"]) == [1, 0, 0], "it has left the joint environment"


def test_a_mask_that_is_not_the_agents_is_left_to_all() -> None:
    info = {"action_mask": (None, [1, 0], None), "infos": 3}
    env = altered(Sum(), reset=lambda **given: ((0, np.zeros(5)), info))
    assert SplitEnv(env).reset()[1] == {"agent_0": info, "agent_1": info}


def test_names_can_be_chosen_and_infos_find_their_agents() -> None:
    env = SplitEnv(TimeLimit(JointEnv(Masked()), 9), ("x", "y"))
    assert env.possible_agents == ["x", "y"]
    _, infos = env.reset()
    assert {agent: plain(info) for agent, info in infos.items()} == {
        "x": {"action_mask": [0, 1, 1], "clock": 0},
        "y": {"action_mask": [1, 0, 1], "clock": 0},
    }


def test_pictures_and_closing_are_the_environments_own() -> None:
    world = Meeting()
    env = both_ways(world)
    env.reset()
    assert env.render_mode == "ansi"
    assert env.render() == "Meeting at 0"
    assert env.metadata["render_modes"] == ["ansi"]
    assert str(SplitEnv(Sum())) == "<Sum instance>"
    env.close()
    assert world.closed == 1


def test_copies_go_their_own_ways() -> None:
    env = both_ways(Meeting())
    env.reset()
    other = copy.deepcopy(env)
    assert other.step({"west": 2, "east": 1})[0] == {"west": 1, "east": 4}
    assert env.step({"west": 1, "east": 0})[0] == {"west": 0, "east": 3}


def test_steps_need_a_reset() -> None:
    env = both_ways(Leaving((1, 1)))
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step({"a": 0, "b": 0})
    env.reset()
    env.step({"a": 0, "b": 0})
    with pytest.raises(ResetNeeded):
        env.step({"a": 0, "b": 0})


@pytest.mark.parametrize("actions", [{}, {"west": 1}, {"west": 1, "east": 1, "north": 1}, {0: 1, 1: 1}], ids=str)
def test_every_agent_needs_an_action(actions: Any) -> None:
    env = both_ways(Meeting())
    env.reset()
    with pytest.raises(ParameterError, match=r"actions must name west and east; got \{"):
        env.step(actions)


@pytest.mark.parametrize("observation", [(1,), (1, 2, 3), 4, {"agent_0": 1, "agent_1": 2}], ids=str)
def test_observations_of_another_length_are_refused(observation: Any) -> None:
    env = altered(Sum(), reset=lambda **given: (observation, {}))
    with pytest.raises(ObservationError, match="must have 2 parts, as their space says; got"):
        SplitEnv(env).reset()


@pytest.mark.parametrize(
    ("observed", "acted"),
    [
        (Discrete(4), Tuple([Discrete(2)])),
        (Tuple([Discrete(2)]), MultiDiscrete([2])),
        (Tuple([Discrete(2), Discrete(2)]), Tuple([Discrete(2)])),
    ],
    ids=str,
)
def test_spaces_without_a_part_for_each_agent_are_refused(observed: Any, acted: Any) -> None:
    env = Sum()
    env.observation_space, env.action_space = observed, acted
    with pytest.raises(ProblemError, match=r"spaces of <Sum instance> must be Tuples of one length, a part for each"):
        SplitEnv(env)


def test_spaces_without_any_part_are_refused() -> None:
    env = Sum()
    env.observation_space = env.action_space = Tuple([])
    with pytest.raises(ProblemError, match="the spaces of <Sum instance> must have a part for each agent"):
        SplitEnv(env)


@pytest.mark.parametrize("agents", [["a"], ["a", "b", "c"], ["a", "a"], "ab", []], ids=str)
def test_there_must_be_a_name_for_each_agent(agents: Any) -> None:
    with pytest.raises((ParameterError, ParameterTypeError), match="agents must be 2 different names; got"):
        SplitEnv(Sum(), agents)


@pytest.mark.parametrize("env", [Meeting(), "FrozenLake-v1", None])
def test_only_gymnasium_environments_are_split(env: Any) -> None:
    with pytest.raises(ParameterTypeError, match="env must be a Gymnasium environment; got"):
        SplitEnv(env)
