"""Parallel environments as joint ones: hand-computed trajectories, agents that leave, rewards, ends, masks, seeds."""

import copy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Discrete, MultiBinary, MultiDiscrete, Tuple
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import TransformAction, TransformObservation
from pettingzoo.test.example_envs import generated_agents_parallel_v0
from pettingzoo.utils import BaseParallelWrapper, parallel_to_aec
from pettingzoo.utils.conversions import aec_to_parallel_wrapper

from tests.adapters.parallel_worlds import (
    Breaking,
    Dice,
    Leaving,
    Masked,
    MaskedInObservation,
    Meeting,
    Unequal,
    World,
    altered,
)
from tuckerl import JointEnv, QLearning, TeamQ
from tuckerl.errors import (
    EnvironmentFaultError,
    ObservationError,
    ParameterError,
    ParameterTypeError,
    ProblemError,
    UnknownNameError,
)

WORLDS = [Meeting, Leaving, Unequal, Masked, MaskedInObservation, Dice, lambda: Masked(2), lambda: Masked(2, True)]


def rescue() -> Any:
    return pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", render_mode="rgb_array")


def started(env: Any, reward: str = "mean") -> JointEnv:
    joint = JointEnv(env, reward)
    joint.reset()
    return joint


@pytest.mark.filterwarnings("ignore:.*Not able to test alternative render modes")  # it was not made by its id
@pytest.mark.parametrize("make", [rescue, *WORLDS])
@pytest.mark.parametrize("reward", ["mean", "sum"])
def test_gymnasium_finds_no_fault(make: Any, reward: str) -> None:
    check_env(JointEnv(make(), reward))


@pytest.mark.filterwarnings("ignore:.*Not able to test alternative render modes")
def test_gymnasium_finds_no_fault_with_an_environment_that_moved_agent_by_agent() -> None:
    env = aec_to_parallel_wrapper(parallel_to_aec(Meeting()))  # keeps one info and one list of agents for ever
    check_env(JointEnv(env))


def test_a_meeting_ends_with_the_hand_computed_numbers() -> None:
    env = JointEnv(Meeting())
    assert env.observation_space == Tuple([Discrete(5), Discrete(5)])
    assert env.action_space == Tuple([Discrete(3), Discrete(3)])
    told: dict[str, Any] = {"infos": {"west": {}, "east": {}}}
    for _ in range(2):
        assert env.reset() == ((0, 4), told)
        assert env.step((2, 1)) == ((1, 4), -1.0, False, False, told)
        assert env.step((2, 0)) == ((2, 3), -1.0, False, False, told)
        assert env.step((2, 0)) == ((3, 2), -1.0, False, False, told)  # past each other
        assert env.step((0, 1)) == ((2, 2), 9.0, True, False, told)


def test_a_meeting_missed_is_truncated() -> None:
    env = started(Meeting())
    steps = [env.step((1, 1)) for _ in range(6)]
    assert [step[0] for step in steps] == [(0, 4)] * 6
    assert [step[2:4] for step in steps] == [(False, False)] * 5 + [(False, True)]


def test_unequal_spaces_keep_the_agents_order() -> None:
    env = JointEnv(Unequal(), "sum")
    assert env.observation_space == Tuple([Discrete(4, start=-1), MultiBinary(2)])
    assert env.action_space == Tuple([Discrete(3, start=-1), MultiDiscrete([2, 4])])
    observation, _ = env.reset()
    assert observation[0] == -1
    assert observation[1].tolist() == [0, 0]
    observation, reward, *_ = env.step((-1, np.array([1, 3])))
    assert observation[0] == 0
    assert observation[1].tolist() == [0, 1]
    assert reward == -1 + (1 + 3)
    assert env.env.received == [{"scout": -1, "carrier": pytest.approx([1, 3])}]


def test_agents_that_left_keep_what_they_saw_and_are_not_asked() -> None:
    env = started(Leaving(), "sum")
    steps = [env.step((1, 0, 1)), env.step((1, 0, 1)), env.step((1, 1, 0))]
    assert [step[0] for step in steps] == [(1, 1, 1), (1, 2, 2), (1, 2, 3)]
    assert [step[1] for step in steps] == [2 + 10 + 200, 10 + 200, 100]
    assert [step[2:4] for step in steps] == [(False, False), (False, False), (True, False)]
    assert [sorted(step[4]["infos"]) for step in steps] == [["a", "b", "c"], ["b", "c"], ["c"]]
    assert env.env.received == [{"a": 1, "b": 0, "c": 1}, {"b": 0, "c": 1}, {"c": 0}]


@pytest.mark.parametrize(
    ("reward", "expected"),
    [
        ("mean", [(1 + 20 + 100) / 3, (20 + 100) / 3, 100 / 3]),  # the mean over all, whoever is left
        ("sum", [1 + 20 + 100, 20 + 100, 100]),
        ("a", [1, 0, 0]),
        ("b", [20, 20, 0]),
        ("c", [100, 100, 100]),
    ],
)
def test_rewards_follow_the_rule(reward: str, expected: list[float]) -> None:
    env = started(Leaving(), reward)
    assert [env.step((0, 1, 0))[1] for _ in range(3)] == pytest.approx(expected, abs=1e-12)


def test_the_mean_of_equal_rewards_is_that_reward() -> None:
    class Tenth(Leaving):
        def act(self, actions: dict[str, Any]) -> Any:
            _, terminated, truncated = super().act(actions)
            return dict.fromkeys(actions, np.float64(0.1)), terminated, truncated

    assert (0.1 + 0.1 + 0.1) / 3 != 0.1
    reward = started(Tenth((3, 3, 3))).step((0, 0, 0))[1]
    assert reward == 0.1
    assert type(reward) is float


@pytest.mark.parametrize(
    ("parameters", "ends"),
    [
        ({}, (True, False)),
        ({"truncated": "c"}, (False, True)),
        ({"truncated": "ab"}, (True, False)),  # they left before
        ({"steps": (1, 3, 3), "truncated": "b"}, (False, True)),  # one of the last two
        ({"steps": (1, 3, 3), "truncated": "bc"}, (False, True)),
        ({"steps": (3, 3, 3), "both": "abc"}, (True, True)),  # Gymnasium's TimeLimit says so, too
        ({"steps": (3, 3, 3), "both": "a"}, (True, True)),  # nobody would have gone on
        ({"steps": (3, 3, 3), "both": "a", "truncated": "b"}, (False, True)),
    ],
    ids=str,
)
def test_the_last_agents_to_leave_say_how_it_ended(parameters: dict[str, Any], ends: tuple[bool, bool]) -> None:
    env = started(Leaving(**parameters))
    assert [env.step((0, 0, 0))[2:4] for _ in range(3)] == [(False, False), (False, False), ends]


def test_agents_that_vanish_without_a_word_terminated() -> None:
    class Vanishing(Leaving):
        def step(self, actions: dict[str, Any]) -> Any:
            observations, rewards, ends, _, infos = super().step(actions)
            return observations, rewards, dict.fromkeys(ends, False), dict.fromkeys(ends, False), infos

    env = started(Vanishing((2, 2)))
    assert env.step((0, 0))[2:4] == (False, False)
    assert env.step((0, 0))[2:4] == (True, False)


def test_agents_may_come_later_if_they_were_observed() -> None:
    class Late(Leaving):
        def reset(self, seed: int | None = None, options: Any = None) -> Any:
            result = super().reset(seed, options)
            self.agents = ["a"]
            return result

        def step(self, actions: dict[str, Any]) -> Any:
            result = super().step(actions)
            if self.clock == 1:
                self.agents.append("b")
                result[0]["b"] = 1
            return result

    env = started(Late((3, 3)), "sum")
    assert [env.step((1, 1))[:2] for _ in range(3)] == [((1, 1), 2.0), ((2, 2), 22.0), ((3, 3), 22.0)]
    assert env.env.received == [{"a": 1}, {"a": 1, "b": 1}, {"a": 1, "b": 1}]


def masks(info: dict[str, Any]) -> Any:
    return [None if mask is None else mask.tolist() for mask in info["action_mask"]]


@pytest.mark.parametrize("make", [Masked, MaskedInObservation])
def test_masks_are_joined(make: Any) -> None:
    env = JointEnv(make())
    assert env.observation_space == Tuple([Discrete(5), Discrete(5)])
    observation, info = env.reset()
    assert observation == (0, 0)
    assert masks(info) == [[0, 1, 1], [1, 0, 1]]
    observation, _, _, _, info = env.step((1, 2))
    assert observation == (1, 1)
    assert masks(info) == [[1, 0, 1], [1, 1, 0]]


@pytest.mark.parametrize("make", [Masked, MaskedInObservation])
def test_masks_can_be_sampled_by(make: Any) -> None:
    env = JointEnv(make(), "sum")
    env.action_space.seed(0)
    for _ in range(20):
        _, info = env.reset()
        ended = False
        while not ended:
            _, reward, terminated, truncated, info = env.step(env.action_space.sample(mask=info["action_mask"]))
            assert reward >= 0, "nothing forbidden was chosen"
            ended = terminated or truncated


@pytest.mark.parametrize("make", [Masked, MaskedInObservation])
@pytest.mark.parametrize(
    ("truncated", "last"), [(False, [[1, 0, 0], [1, 0, 0]]), (True, [[1, 0, 0], [1, 1, 0]])], ids=["ended", "cut"]
)
def test_an_agent_that_left_may_only_take_its_first_action(make: Any, truncated: bool, last: Any) -> None:
    env = started(make(2, truncated))
    infos = [env.step((1, 1))[4] for _ in range(4)]
    # second may not take 2, 0, 1, 2 after these steps; when it is cut off, what it could do next still counts
    assert [masks(info) for info in infos] == [
        [[1, 0, 1], [1, 1, 0]],
        [[1, 0, 0], [0, 1, 1]],
        [[1, 0, 0], [1, 0, 1]],
        last,
    ]


def test_an_agent_without_a_mask_has_none() -> None:
    class HalfMasked(Masked):
        def tell(self, agent: str) -> dict[str, Any]:
            return super().tell(agent) if agent == "first" and self.clock < 2 else {}

    env = JointEnv(HalfMasked(2))
    assert masks(env.reset()[1]) == [[0, 1, 1], None]
    assert masks(env.step((1, 1))[4]) == [[1, 0, 1], None]
    assert masks(env.step((2, 1))[4]) == [[1, 0, 0], None], "it left, and its last info has no mask"
    assert "action_mask" not in started(Leaving()).step((0, 0, 0))[4]
    altered(env.env, tell=lambda agent: {})
    assert "action_mask" not in env.reset()[1], "each episode for itself"


def test_masks_of_the_wrong_length_are_refused() -> None:
    env = altered(Masked(), tell=lambda agent: {"action_mask": [1, 1]})
    with pytest.raises(ObservationError, match="an action mask must be a row of 3 entries"):
        JointEnv(env).reset()


def test_masks_of_several_dimensions_have_an_entry_for_each_action_of_each() -> None:
    env = altered(Unequal(), tell=lambda agent: {"action_mask": [1, 1, 1]})
    with pytest.raises(ObservationError, match=r"a row of 6 entries, those of 2 parts .*; got \[1, 1, 1\]"):
        JointEnv(env).reset()


def test_infos_are_passed_on_and_are_the_users_own() -> None:
    told = {"first": {"deep": 1}, "second": {}}
    joint = JointEnv(altered(Masked(), tell=told.__getitem__))
    _, info = joint.reset()
    assert info == {"infos": {"first": {"deep": 1}, "second": {}}}
    info["infos"]["first"]["deep"] = 2
    assert joint.step((0, 0))[4]["infos"]["first"] == {"deep": 1}


def test_infos_beside_the_agents_are_passed_on() -> None:
    class Common(Leaving):
        def reset(self, seed: int | None = None, options: Any = None) -> Any:
            observations, infos = super().reset(seed, options)
            return {**observations, "common": 0}, {**infos, "common": "fog", "b": None}

    assert JointEnv(Common()).reset() == ((0, 0, 0), {"infos": {"a": {}, "b": None, "c": {}, "common": "fog"}})


def test_observations_are_the_users_own() -> None:
    class Buffered(World):
        def __init__(self) -> None:
            agents = ("brief", "long")
            super().__init__({agent: MultiDiscrete([9]) for agent in agents}, {agent: Discrete(2) for agent in agents})
            self.buffer = np.zeros(1, dtype=np.int64)

        def observe(self, agent: str) -> Any:
            self.buffer[0] = self.clock
            return self.buffer

        def act(self, actions: dict[str, Any]) -> Any:
            return dict.fromkeys(actions, 0.0), {"brief"} & set(self.agents) if self.clock == 1 else set(), set()

    env = JointEnv(Buffered())
    kept = [env.reset()[0], *(env.step((0, 0))[0] for _ in range(3))]
    assert [[int(part[0]) for part in observation] for observation in kept] == [[0, 0], [1, 1], [1, 2], [1, 3]]
    kept[-1][0][0] = 7
    assert env.step((0, 0))[0][0].tolist() == [1]


def test_seeds_reach_the_environment() -> None:
    env = JointEnv(Dice(), "sum")

    def play(seed: int | None) -> list[Any]:
        return [env.reset(seed=seed)[0], *(env.step((1, 2))[:2] for _ in range(10))]

    first, second, other = play(5), play(None), play(6)
    assert play(5) == first
    assert play(None) == second, "a reset without a seed goes on with the stream"
    assert len({str(played) for played in (first, second, other)}) == 3
    assert env.reset(seed=5)[0] == tuple(np.random.default_rng(5).integers(6, size=2))
    assert env.np_random_seed == 5


def test_options_reach_the_environment() -> None:
    env = JointEnv(Meeting())
    env.reset(seed=3, options={"fog": 1})
    env.reset()
    assert env.env.reset_with == [(3, {"fog": 1}), (None, None)]


def test_pictures_and_closing_are_the_environments_own() -> None:
    env = started(Meeting())
    assert env.render_mode == "ansi"
    assert env.metadata["render_modes"] == ["ansi"]
    assert env.render() == "Meeting at 0"
    with env:
        pass
    assert env.env.closed == 1
    assert str(env) == "<JointEnv<Meeting>>"


def test_an_environment_may_lack_pictures_and_metadata() -> None:
    world = Meeting()
    del world.metadata, world.render_mode
    env = JointEnv(world)
    assert env.render_mode is None
    assert env.metadata == {"render_modes": []}


def test_wrapped_environments_are_joined() -> None:
    assert started(BaseParallelWrapper(Meeting())).step((2, 0)) == started(Meeting()).step((2, 0))


def as_one_action(env: Any) -> Any:
    return TransformAction(env, lambda action: divmod(int(action), 3), Discrete(9))


def as_one_sight(env: Any) -> Any:
    return TransformObservation(env, lambda seen: 5 * int(seen[0]) + int(seen[1]), Discrete(25))


@pytest.mark.parametrize("wrap", [as_one_action, as_one_sight, lambda env: as_one_action(as_one_sight(env))])
def test_a_wrapper_that_makes_one_of_the_agents_parts_is_learned_on_as_it_is(wrap: Any, tmp_path: Path) -> None:
    plain, wrapped = (QLearning(env, seed=0).learn(20) for env in (JointEnv(Meeting()), wrap(JointEnv(Meeting()))))
    np.testing.assert_array_equal(wrapped.q, plain.q)
    assert plain.problem.agents == ("west", "east")
    assert wrapped.problem.agents == ()
    assert wrapped.problem.state_factors
    wrapped.save(tmp_path / "wrapped.tuckerl")
    loaded = QLearning.load(tmp_path / "wrapped.tuckerl", env=wrap(JointEnv(Meeting())))
    np.testing.assert_array_equal(loaded.learn(25).q, wrapped.learn(25).q)
    with pytest.raises(ParameterError):
        QLearning.load(tmp_path / "wrapped.tuckerl", env=wrap(JointEnv(Meeting(), "sum")))


@pytest.mark.parametrize("kind", ["observation", "action"])
def test_spaces_that_change_between_resets_are_named(kind: str) -> None:
    class Growing(Meeting):
        def begin(self, seed: int | None) -> None:
            super().begin(seed)
            if len(self.reset_with) > 3:
                (self.observation_spaces if kind == "observation" else self.action_spaces)["east"] = Discrete(7)

    message = rf"spaces of .* must stay as they are.*: {kind} of east n was \d; got 7; declare the largest"
    env = JointEnv(Growing())
    for _ in range(3):
        env.reset()
    with pytest.raises(ProblemError, match=message):
        env.reset()
    with pytest.raises(EnvironmentFaultError, match=message):
        TeamQ(Growing(), seed=0).learn(9)


def test_spaces_that_are_made_anew_and_equal_are_the_same() -> None:
    env = altered(Meeting(), action_space=lambda agent: Discrete(3))
    assert TeamQ(env, seed=0).learn(3).episodes == 3


def test_copies_go_their_own_ways() -> None:
    env = started(Meeting())
    env.step((2, 1))
    other = copy.deepcopy(env)
    assert other.step((2, 1))[0] == (2, 4)
    assert env.step((1, 0))[0] == (1, 3)


def test_an_error_of_the_environment_comes_through_and_a_reset_mends_it() -> None:
    env = started(Breaking())
    for _ in range(2):
        assert env.reset()[0] == (0, 0)
        env.step((0, 0))
        env.step((0, 0))
        with pytest.raises(RuntimeError, match="the bridge broke"):
            env.step((0, 0))


def test_steps_need_a_reset() -> None:
    env = JointEnv(Leaving((1, 1)))
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step((0, 0))
    env.reset()
    env.step((0, 0))
    with pytest.raises(ResetNeeded):
        env.step((0, 0))


@pytest.mark.parametrize("action", [(0,), (0, 0, 0), (), 3, None])
def test_joint_actions_of_another_length_are_refused(action: Any) -> None:
    env = started(Meeting())
    with pytest.raises(ParameterError, match="a joint action must hold 2 actions, one for each agent; got"):
        env.step(action)
    assert env.env.clock == 0


def test_an_environment_that_does_not_list_its_agents_is_refused() -> None:
    message = "must list all agents that it may have as `possible_agents`: learning needs to know them at once"
    with pytest.raises(ProblemError, match=message):
        JointEnv(generated_agents_parallel_v0.parallel_env())
    env = Meeting()
    env.possible_agents = []
    with pytest.raises(ProblemError, match=message):
        JointEnv(env)
    env.possible_agents = ["west", "west"]
    with pytest.raises(ProblemError, match="the possible_agents of Meeting must be different; got"):
        JointEnv(env)


def test_agents_that_were_not_listed_are_refused() -> None:
    class Crowded(Leaving):
        def step(self, actions: dict[str, Any]) -> Any:
            result = super().step(actions)
            self.agents.append("stranger")
            return result

    with pytest.raises(ProblemError, match="agents of Crowded must be among its possible_agents, a, b, c; got 'stran"):
        started(Crowded()).step((0, 0, 0))
    env = altered(Meeting(), observe=lambda agent: 0)
    joint = JointEnv(env)
    env.possible_agents = ["west", "east", "north"]
    env.observation_spaces["north"] = env.action_spaces["north"] = Discrete(2)
    with pytest.raises(ProblemError, match="agents of Meeting must be among its possible_agents, west, east; got"):
        joint.reset()


def change(result: tuple[dict[str, Any], ...], part: int, agent: str) -> tuple[dict[str, Any], ...]:
    """Return the result of a step or reset without what one part says of an agent."""
    kept = {name: value for name, value in result[part].items() if name != agent}
    return (*result[:part], kept, *result[part + 1 :])


def test_environments_that_break_the_rules_at_reset_are_refused() -> None:
    env = started(Meeting())
    original = env.env.reset
    env.env.reset = lambda **given: change(original(**given), 0, "east")
    with pytest.raises(ProblemError, match=r"must return an observation of every agent .*; it returned none of east"):
        env.reset()
    with pytest.raises(ResetNeeded):
        env.step((0, 0))

    def empty(**given: Any) -> Any:
        result = original(**given)
        env.env.agents = []
        return result

    env.env.reset = empty
    with pytest.raises(ProblemError, match="Meeting must have agents after its reset; its list `agents` is empty"):
        env.reset()


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (0, "Meeting must return an observation of every agent in it; none came of east"),
        (1, "Meeting must return a reward of every agent; none came of 'east'"),
    ],
)
def test_environments_that_forget_an_agent_are_refused(part: int, message: str) -> None:
    env = started(Meeting())
    original = env.env.step
    env.env.step = lambda actions: change(original(actions), part, "east")
    with pytest.raises(ProblemError, match=message):
        env.step((0, 0))


@pytest.mark.parametrize("part", [2, 3])
def test_agents_that_stay_after_their_end_are_not_looked_at(part: int) -> None:
    env = started(Meeting())
    original, passed = env.env.step, list[dict[str, Any]]()

    def step(actions: dict[str, Any]) -> Any:
        passed.append(actions)
        result = original({"west": 1, **actions})
        result[part]["west"] = True
        return result

    env.env.step = step
    env.step((0, 0))
    assert env.env.agents == ["west", "east"], "it goes on to list west"
    env.step((0, 0))
    assert [list(actions) for actions in passed] == [["west", "east"], ["east"]]


@pytest.mark.parametrize("env", [gymnasium.make("FrozenLake-v1"), "tuckerl/RobotRescue-v0", None, Meeting])
def test_only_parallel_environments_are_joined(env: Any) -> None:
    with pytest.raises(ParameterTypeError, match="env must be a PettingZoo parallel environment; got"):
        JointEnv(env)


def test_an_environment_that_moves_agent_by_agent_is_refused_with_the_way_out() -> None:
    with pytest.raises(ParameterTypeError, match=r"moves agent by agent: .*aec_to_parallel makes a parallel"):
        JointEnv(parallel_to_aec(Meeting()))


@pytest.mark.parametrize(
    ("reward", "error", "message"),
    [
        ("median", UnknownNameError, "unknown reward 'median': did you mean 'mean'"),
        ("wets", UnknownNameError, "unknown reward 'wets': did you mean 'west'"),
        ("xyz", UnknownNameError, "use one of east, mean, sum, west"),
        (None, ParameterTypeError, "reward must be one of east, mean, sum, west; got None"),
    ],
)
def test_unknown_rewards_are_refused(reward: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        JointEnv(Meeting(), reward)
