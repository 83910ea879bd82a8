"""Robot rescue under PettingZoo's rules: spaces, episodes, limits, pictures."""

import copy
import subprocess
import sys
import warnings
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.error import ResetNeeded
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    render_test,
    seed_test,
)
from pettingzoo.test.state_test import state_test
from pettingzoo.utils import parallel_to_aec

from tests.environments.test_robot_rescue import DELIVERY, DOWN, LEFT, RIGHT, STAY, UP
from tuckerl.environments import PARALLEL_ENVIRONMENTS, register_environments
from tuckerl.environments.raster import FREE, GRID, WALL
from tuckerl.environments.robot_rescue import robot_rescue
from tuckerl.environments.robot_rescue_env import RobotRescueEnv, parallel_env
from tuckerl.environments.robot_rescue_map import DEFAULT_MAP, RescueMap
from tuckerl.environments.robot_rescue_view import BAR, DISC, HOUSE, THING, TRIANGLE
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, UnknownNameError

ID = "tuckerl/RobotRescue-v0"
SMALL = "....\n.H..\n.T..\nA..B"


def make(**parameters: Any) -> RobotRescueEnv:
    env: RobotRescueEnv = pettingzoo.make("parallel", ID, **parameters)
    return env


def both(one: int, other: int) -> dict[str, int]:
    return {"robot_0": one, "robot_1": other}


def delivered(steps: int, render_mode: str | None = None) -> RobotRescueEnv:
    """The default world after the first `steps` steps of the golden delivery."""
    env = make(render_mode=render_mode)
    env.reset()
    for actions in DELIVERY[:steps]:
        env.step(both(*actions))
    return env


@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")  # as with every Discrete space; it is allowed
@pytest.mark.parametrize(
    "parameters", [{}, {"map": SMALL}, {"map": "ATB.H."}, {"step_cost": 1, "render_mode": "ansi"}], ids=str
)
def test_pettingzoo_finds_no_fault(parameters: dict[str, Any]) -> None:
    parallel_api_test(make(**parameters), num_cycles=300)
    parallel_seed_test(lambda: make(**parameters), num_cycles=100)
    api_test(parallel_to_aec(make(**parameters)), num_cycles=100)
    seed_test(lambda: parallel_to_aec(make(**parameters)), num_cycles=100)
    state_test(parallel_to_aec(make(**parameters)), make(**parameters))


def test_pettingzoo_finds_no_fault_with_limits_and_pictures() -> None:
    max_cycles_test(
        SimpleNamespace(
            parallel_env=parallel_env,
            env=lambda **parameters: parallel_to_aec(parallel_env(**parameters)),
        )
    )

    def make_turns(render_mode: str) -> Any:
        # The check begins with a "human" mode, which it makes and then does not use.
        return parallel_to_aec(make(render_mode=None if render_mode == "human" else render_mode))

    render_test(make_turns)


def test_spaces_and_what_it_carries() -> None:
    env = make(map=None)
    assert isinstance(env, RobotRescueEnv)
    assert env.possible_agents == ["robot_0", "robot_1"]
    for agent in env.possible_agents:
        assert env.observation_space(agent) == gymnasium.spaces.Discrete(192)
        assert env.action_space(agent) == gymnasium.spaces.Discrete(5)
    assert env.observation_space("robot_0") is not env.observation_space("robot_1"), "they are seeded each by itself"
    assert env.state_space == gymnasium.spaces.Discrete(36_864)
    assert env.map == RescueMap()
    assert (env.mdp.n_states, env.mdp.n_actions, env.mdp.action_sizes) == (36_864, 25, (5, 5))
    assert str(env) == "RobotRescue-v0"


def test_golden_episode() -> None:
    env = make()
    observations, infos = env.reset(seed=0)
    assert observations == both(56 * 3, 63 * 3)
    assert infos == {"robot_0": {}, "robot_1": {}}
    assert env.agents == ["robot_0", "robot_1"]
    seen = [env.step(both(*actions)) for actions in DELIVERY]
    assert [step[0]["robot_0"] for step in seen] == [144, 120, 123, 127, 127, 103, 79, 76, 73, 49, 25, 1, 4, 7]
    assert [step[0]["robot_1"] for step in seen] == [165, 141, 138, 135, 134, 110, 86, 83, 80, 56, 32, 8, 11, 14]
    assert [step[1] for step in seen] == [both(reward, reward) for reward in (0, 0, 0, 1, 1, *[0] * 8, 10)]
    assert [set(step[2].values()) for step in seen] == [{False}] * 13 + [{True}]
    assert not any(truncated for step in seen for truncated in step[3].values())
    assert all(step[4] == {"robot_0": {}, "robot_1": {}} for step in seen)
    assert env.agents == []
    observations, rewards, terminated, *_ = seen[-1]
    for values, kind in ((observations, np.int64), (rewards, float), (terminated, bool)):
        assert list(values) == ["robot_0", "robot_1"]
        assert {type(value) for value in values.values()} == {kind}
    assert env.reset()[0] == both(168, 189)


@pytest.mark.parametrize("text", [DEFAULT_MAP, SMALL, "ATB.H..\n.......", ".H...\n.AT.B\n....."])
def test_random_steps_are_those_of_the_table(text: str) -> None:
    env = make(map=text, step_cost=0.1, grip_reward=2, delivery_reward=5)
    arrays = robot_rescue(text, step_cost=0.1, grip_reward=2, delivery_reward=5).arrays
    own_size = env.observation_space("robot_0").n
    rng = np.random.default_rng(0)
    deliveries = grips = 0
    for _ in range(3000):
        if not env.agents:
            env.reset()
        before = int(env.state())
        actions = [int(action) for action in rng.integers(5, size=2)]
        # A group seldom agrees by chance.
        actions[1] = actions[0] if rng.random() < 0.5 else actions[1]
        observations, rewards, terminated, truncated, _ = env.step(both(*actions))
        outcome = before * 25 + actions[0] * 5 + actions[1]
        assert env.state() == arrays.next_state[outcome]
        assert observations["robot_0"] * own_size + observations["robot_1"] == env.state()
        assert rewards == both(arrays.reward[outcome], arrays.reward[outcome])
        assert terminated == both(arrays.terminated[outcome], arrays.terminated[outcome])
        assert not any(truncated.values()) or not any(terminated.values())
        deliveries += terminated["robot_0"]
        grips += rewards["robot_0"] > 1
    assert grips > 0
    assert deliveries > 0


@pytest.mark.parametrize(("parameters", "steps"), [({}, 1000), ({"max_cycles": 7}, 7)])
def test_the_limit_truncates(parameters: dict[str, Any], steps: int) -> None:
    for env in (make(**parameters), RobotRescueEnv(**parameters)):
        assert env.max_cycles == env.mdp.max_episode_steps == env.mdp.arrays.max_episode_steps == steps
        for _ in range(2):  # steps are counted from the reset
            env.reset()
            seen = [env.step(both(STAY, STAY)) for _ in range(steps)]
            assert [step[3] for step in seen] == [both(False, False)] * (steps - 1) + [both(True, True)]
            assert not any(terminated for step in seen for terminated in step[2].values())
            assert env.agents == []


def test_a_delivery_with_the_last_step_allowed_is_no_truncation() -> None:
    env = make(max_cycles=14)
    env.reset()
    for actions in DELIVERY:
        last = env.step(both(*actions))
    assert last[2:4] == (both(True, True), both(False, False))


def test_the_limit_can_be_lifted_and_set_later() -> None:
    for env in (make(max_cycles=-1), RobotRescueEnv(max_cycles=None)):
        assert env.max_cycles is env.mdp.max_episode_steps is None
        env.reset()
        assert not any(env.step(both(UP, DOWN))[3]["robot_0"] for _ in range(1500))
    env.max_cycles = 3
    assert env.mdp.max_episode_steps == 3
    assert env.mdp.action_sizes == (5, 5)
    with pytest.raises(ParameterError, match="max_cycles must be a whole number of at least 1; got 0"):
        env.max_cycles = 0


def test_steps_need_a_reset() -> None:
    env = make()
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step(both(0, 0))
    over = delivered(14)
    with pytest.raises(ResetNeeded):
        over.step(both(0, 0))


@pytest.mark.parametrize("actions", [{}, {"robot_0": 1}, {"robot_0": 1, "robot_1": 1, "robot_2": 1}, {0: 1, 1: 1}])
def test_every_robot_needs_an_action(actions: Any) -> None:
    env = make()
    env.reset()
    with pytest.raises(ParameterError, match=r"actions must name robot_0 and robot_1; got \{"):
        env.step(actions)


@pytest.mark.parametrize("action", [5, -1, 0.0, "up", None, np.array([0])])
@pytest.mark.parametrize("agent", ["robot_0", "robot_1"])
def test_unknown_actions_are_refused(agent: str, action: Any) -> None:
    env = make(map=SMALL)
    env.reset()
    with pytest.raises(ParameterError, match=rf"the action of {agent} must be 0 \(left\), .* or 4 \(stay\); got"):
        env.step({**both(STAY, STAY), agent: action})
    assert env.state() == env.mdp.arrays.start_state[0]


@pytest.mark.parametrize("kind", [np.int64, np.uint8, np.array])
def test_actions_may_be_of_any_integer_kind_and_in_any_order(kind: Any) -> None:
    env = make()
    env.reset()
    assert env.step({"robot_1": kind(LEFT), "robot_0": kind(RIGHT)})[0] == both(57 * 3, 62 * 3)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"map": "AT.B"}, ProblemError, "must have a home cell"),
        ({"map": 3}, ParameterTypeError, "map must be a RescueMap, its text or a list of its rows; got 3"),
        ({"max_cycles": 2.5}, ParameterTypeError, "max_cycles must be a whole number"),
        ({"step_cost": -1}, ParameterError, "step_cost must be"),
        ({"render_mode": "ascii"}, UnknownNameError, "unknown render_mode 'ascii': did you mean 'ansi'"),
    ],
)
def test_bad_parameters_are_refused(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make(**parameters)


def test_copies_go_their_own_ways() -> None:
    env = delivered(3)
    other = copy.deepcopy(env)
    assert other.step(both(RIGHT, STAY))[1] == both(1, 1)
    assert env.state() != other.state()
    assert env.step(both(STAY, STAY))[0] == both(123, 138)


def test_ansi_pictures() -> None:
    env = make(render_mode="ansi")
    assert env.render() == DEFAULT_MAP
    assert delivered(4, "ansi").render().split("\n")[4:6] == ["##....##", "..aT.B.."]
    over = delivered(14, "ansi")
    lines = ["..aTb...", "........", "...##...", "........", "##....##", "........", ".#....#.", "........"]
    assert over.render() == "\n".join(lines)
    assert over.reset()
    assert over.render() == DEFAULT_MAP


def pixel(env: RobotRescueEnv, place: tuple[float, float]) -> tuple[int, ...]:
    """The colour at a place counted in cells: (0.5, 0.5) is the middle of the first cell."""
    image = env.render()
    size = image.shape[0] // (env.map.rows + 1)
    row, column = (int(size // 2 + part * size) for part in place)
    return tuple(int(value) for value in image[row, column])


def test_rgb_picture() -> None:
    env = delivered(4, "rgb_array")  # robot_0 grips at (5, 2), robot_1 is at (5, 5)
    assert env.render().shape == (9 * 48, 9 * 48, 3)
    assert env.render().dtype == np.uint8
    places = {
        (-0.2, 3.5): WALL,
        (2.5, 3.5): WALL,
        (1.5, 1.5): FREE,
        (1, 1.5): GRID,
        (5.5, 2.5): DISC,
        (5.5, 3.5): THING,
        (5.5, 5.5): TRIANGLE,
        (5.5, 3): BAR,
        (5.5, 4): GRID,  # robot_1 does not grip yet
        (0.5, 3.12): HOUSE,
        (0.5, 4.12): HOUSE,
        (0.5, 3.5): FREE,
    }
    assert {place: pixel(env, place) for place in places} == places
    assert pixel(env, (5.22, 2.22)) == FREE, "robot_0 is a disc"
    assert pixel(env, (5.25, 3.25)) == THING, "the object is a square"
    assert pixel(env, (5.3, 5.3)) == FREE, "robot_1 is a triangle"
    env.step(both(STAY, LEFT))
    assert pixel(env, (5.5, 4)) == BAR


def test_shapes_stay_apart_in_grey() -> None:
    grey = sorted(np.dot(colour, (0.299, 0.587, 0.114)) for colour in (DISC, THING, TRIANGLE, FREE))
    assert min(np.diff(grey)) > 40


@pytest.mark.parametrize(
    ("text", "shape"),
    [(SMALL, (5 * 48, 5 * 48)), ("ATB" + "." * 77 + "H.", (24, 83 * 12)), (["AT.BH."], (96, 7 * 48))],
)
def test_pictures_fit_the_map(text: Any, shape: tuple[int, int]) -> None:
    assert make(map=text, render_mode="rgb_array").render().shape == (*shape, 3)


def test_a_picture_is_a_copy() -> None:
    env = delivered(6, "rgb_array")
    first = env.render()
    kept = first.copy()
    first[:] = 0
    assert np.array_equal(env.render(), kept)


def test_render_without_a_mode_warns() -> None:
    env = make()
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_registering_twice_is_silent() -> None:
    before = dict(pettingzoo.parallel_registry)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register_environments()
    assert pettingzoo.parallel_registry == before
    assert set(PARALLEL_ENVIRONMENTS) <= set(pettingzoo.parallel_registry)


def test_playing_it_needs_no_compiler() -> None:
    code = (
        "import sys, tuckerl, pettingzoo; pettingzoo.make('parallel', sys.argv[1]).reset(); "
        "sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code, ID], check=False).returncode == 0
