"""Cart pole: its numbers against a twin and by hand, its grid, and the environment around it."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from numpy.typing import ArrayLike
from scipy.stats import kstest

from tests.reference import cart_pole as twin
from tuckerl.adapters.resolve import as_problem
from tuckerl.environments.cart_pole import CartPoleEnv, cart_pole
from tuckerl.environments.cart_pole_view import CART, GROUND, HEIGHT, POLE, PUSH, SKY, TRACK, WIDTH
from tuckerl.errors import ParameterError, ParameterTypeError, SpaceError, UnknownNameError
from tuckerl.problems import dynamics
from tuckerl.problems.simulator import Simulator, SimulatorArrays
from tuckerl.rng import seed_sequence, stream
from tuckerl.types import FloatArray

ID = "tuckerl/CartPole-v0"
OTHERS = {
    "force": 7.0,
    "gravity": 1.62,
    "cart_mass": 0.6,
    "pole_mass": 0.9,
    "half_length": 1.3,
    "time_step": 0.05,
    "track": 1.1,
    "fall": 20.0,
}
DEGREE = math.pi / 180


GOLDEN: dict[str, Any] = {
    "indices": [44, 63, 99, 63, 99],
    "states": [
        [0.0, 0.19512195122, 0.0002, -0.282682926829],
        [0.00390243902439, -2.85212938522e-06, -0.00545365853659, 0.0100630723399],
        [0.0039023819818, 7.53590551641e-05, -0.00525239708979, 0.00834238964602],
        [0.00390388916291, -0.136434405922, -0.00508554929687, 0.211560014984],
        [0.00117520104446, 0.000223412219282, -0.000854348997182, 0.00508079348417],
    ],
    "rewards": [12.8267892683, 9.85011469004, 9.86947651844, 7.83901759269, 9.94258614773],
}


def python_step(simulator: Simulator, state: ArrayLike, action: int) -> tuple[FloatArray, float, bool, int]:
    array = np.array(state, dtype=np.float64)
    reward, failed = simulator.functions.step(simulator.parameters, array, action, np.zeros(4, dtype=np.uint64))
    return array, reward, failed, simulator.functions.index(simulator.parameters, array)


def row(*state: float, **parameters: float) -> int:
    simulator = cart_pole(**parameters)  # type: ignore[arg-type]  # numbers only
    return simulator.functions.index(simulator.parameters, np.array(state, dtype=np.float64))


def random_states(n: int, seed: int = 0) -> FloatArray:
    spread: FloatArray = np.array([4.5, 4.0, 0.85, 4.0])
    states: FloatArray = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 4)) * spread
    return states


@pytest.mark.parametrize("reward", ["shaped", "sign"])
@pytest.mark.parametrize("changes", [{}, OTHERS], ids=["defaults", "others"])
def test_single_steps_equal_the_twin(changes: dict[str, float], reward: str) -> None:
    simulator = cart_pole(reward=reward, **changes)  # type: ignore[arg-type]  # numbers only
    p = twin.DEFAULTS | changes
    ends = set()
    for k, state in enumerate(random_states(2000).tolist()):
        action = k % 21
        moved = twin.move(state, action, p)
        seen, paid, failed, index = python_step(simulator, state, action)
        np.testing.assert_allclose(seen, moved, rtol=1e-12, atol=1e-12)
        expected = twin.shaped(moved, p) if reward == "shaped" else twin.sign_reward(moved, p)
        assert paid == pytest.approx(expected, rel=1e-12, abs=1e-12)
        assert failed == (twin.fallen(moved, p) or twin.off_track(moved, p))
        assert index == twin.row(moved, p)
        ends.add(index >= 108)
    assert ends == {False, True}


@pytest.mark.parametrize("changes", [{}, OTHERS], ids=["defaults", "others"])
def test_compiled_trajectories_equal_the_twin(changes: dict[str, float]) -> None:
    world = cart_pole(**changes).world()  # type: ignore[arg-type]  # numbers only
    arrays = world.arrays
    p = twin.DEFAULTS | changes
    rng = stream(seed_sequence(3))
    drawn = np.random.default_rng(3)
    for _ in range(20):
        state = dynamics.reset(arrays, rng)
        slow: twin.State = (0.0, 0.0, 0.0, 0.01)
        assert state == twin.row(slow, p)
        failed = False
        while not failed:
            action = int(drawn.integers(21))
            state, reward, failed = dynamics.step(arrays, state, action, rng)
            slow = twin.move(slow, action, p)
            np.testing.assert_allclose(arrays.state, slow, rtol=1e-12, atol=1e-12)
            assert reward == pytest.approx(twin.shaped(slow, p), rel=1e-12, abs=1e-12)
            assert (state, failed) == (twin.row(slow, p), twin.row(slow, p) >= 108)
    world.raise_pending()


def test_the_first_step_by_hand() -> None:
    # From (0, 0, 0, 0.01) with +10 N: sin 0 = 0 and cos 0 = 1, so u = 10 / 1.1 and
    # theta'' = -(10 / 1.1) / (0.5 (4/3 - 0.1 / 1.1)) = -(100/11) / (41/66) = -600/41, x'' = 100/11 + (1/22)(600/41).
    state, reward, failed, index = python_step(cart_pole(), [0.0, 0.0, 0.0, 0.01], 20)
    rate = 0.01 - 0.02 * 600 / 41
    expected = [0.0, 0.02 * (100 / 11 + 600 / (22 * 41)), 0.0002, rate]
    np.testing.assert_allclose(state, expected, rtol=1e-13)
    np.testing.assert_allclose(state, [0.0, 0.1951219512195, 0.0002, -0.2826829268293], rtol=1e-12)
    assert reward == pytest.approx(10 - 10 * 0.002**2 - 10 * rate, rel=1e-14)
    assert not failed
    assert index == ((0 * 3 + 2) * 9 + 4) * 2 + 0


def test_golden_trajectory() -> None:
    world = cart_pole().world().arrays
    rng = stream(seed_sequence(0))
    assert dynamics.reset(world, rng) == 27
    seen, states, rewards = [], [], []
    for action in (20, 0, 10, 3, 17):
        index, reward, failed = dynamics.step(world, 0, action, rng)
        assert not failed
        seen.append(index)
        rewards.append(reward)
        states.append(world.state.tolist())
    assert seen == GOLDEN["indices"]
    np.testing.assert_allclose(states, GOLDEN["states"], rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(rewards, GOLDEN["rewards"], rtol=1e-10)


def test_every_row_is_reached_by_the_point_that_it_stands_for() -> None:
    found = []
    for x in (-1.0, 1.0):
        for speed in (-1.0, 0.0, 1.0):
            for degrees in range(-12, 13, 3):
                found += [row(x, speed, degrees * DEGREE, rate) for rate in (-1.0, 1.0)]
    found += [row(0.0, 0.0, 1.0, 0.0), row(5.0, 0.0, 0.0, 0.0)]
    assert found == list(range(110))


@pytest.mark.parametrize(
    ("state", "index"),
    [
        ((0.0, 0.0, 0.0, 0.0), 26),
        ((-0.0, -0.0, -0.0, -0.0), 26),
        ((1e-300, 0.0, 0.0, 0.0), 80),
        ((0.0, -1e-300, 0.0, 0.0), 8),
        ((0.0, 1e-300, 0.0, 0.0), 44),
        ((0.0, 0.0, 0.0, 1e-300), 27),
        ((0.0, 0.0, 1.4999 * DEGREE, 0.0), 26),
        ((0.0, 0.0, 1.5001 * DEGREE, 0.0), 28),
        ((0.0, 0.0, -1.4999 * DEGREE, 0.0), 26),
        ((0.0, 0.0, -1.5001 * DEGREE, 0.0), 24),
        ((0.0, 0.0, 44.9 * DEGREE, 0.0), 34),
        ((0.0, 0.0, -44.9 * DEGREE, 0.0), 18),
        ((0.0, 0.0, 45.1 * DEGREE, 0.0), 108),
        ((0.0, 0.0, -45.1 * DEGREE, 0.0), 108),
        ((4.0, 0.0, 0.0, 0.0), 80),
        ((4.0001, 0.0, 0.0, 0.0), 109),
        ((-4.0001, 0.0, 0.0, 0.0), 109),
        ((9.0, 0.0, 1.0, 0.0), 108),
    ],
)
def test_cells_and_their_edges(state: tuple[float, ...], index: int) -> None:
    assert row(*state) == index


@pytest.mark.parametrize("k", range(8))
def test_an_angle_in_the_middle_of_two_points_goes_to_the_first(k: int) -> None:
    middle = -10.5 + 3 * k
    angle = middle * DEGREE
    while angle * (180 / math.pi) > middle:  # the largest angle that is not above the middle
        angle = math.nextafter(angle, -1.0)
    while math.nextafter(angle, 1.0) * (180 / math.pi) <= middle:
        angle = math.nextafter(angle, 1.0)
    assert row(0.0, 0.0, angle, 0.0) == 18 + 2 * k
    assert row(0.0, 0.0, math.nextafter(angle, 1.0), 0.0) == 20 + 2 * k


def test_the_shaped_reward_turns_negative_near_6_degrees() -> None:
    simulator = cart_pole()
    still = [python_step(simulator, [0.0, 0.0, degrees * DEGREE, 0.0], 10) for degrees in (5.0, 5.7, 7.0, -7.0)]
    by_angle = [reward + 10 * state[3] for state, reward, *_ in still]
    assert [reward > 0 for reward in by_angle] == [True, True, False, False]
    assert by_angle[0] == pytest.approx(10 - 1000 * (5 * DEGREE) ** 2)


@pytest.mark.parametrize(
    ("state", "index"),
    [
        ([3.99, 1.0, 0.0, 0.0], 109),
        ([-3.99, -1.0, 0.0, 0.0], 109),
        ([0.0, 0.0, 44.9 * DEGREE, 1.0], 108),
        ([0.0, 0.0, -44.9 * DEGREE, -1.0], 108),
    ],
)
def test_failures_on_all_sides(state: list[float], index: int) -> None:
    after, reward, failed, seen = python_step(cart_pole(), state, 10)
    assert (failed, seen) == (True, index)
    assert reward == pytest.approx(-10000 - 50 * abs(after[0]) - 100 * abs(after[2]))
    assert python_step(cart_pole(reward="sign"), state, 10)[1:3] == (-1.0, True)
    assert python_step(cart_pole(reward="sign"), [0.0] * 4, 10)[1:3] == (1.0, False)


def test_the_middle_action_pushes_not_and_the_others_mirror() -> None:
    simulator = cart_pole()
    assert python_step(simulator, [0.0] * 4, 10)[0].tolist() == [0.0] * 4
    for a in range(10):
        left, right = (python_step(simulator, [0.0] * 4, action)[0] for action in (a, 20 - a))
        assert np.array_equal(left, -right)
        assert left[1] < 0 < left[3]


def test_compiled_and_interpreted_agree_to_the_last_bit() -> None:
    for reward in ("shaped", "sign"):
        simulator = cart_pole(start="uniform", reward=reward)
        world, state = simulator.world().arrays, np.zeros(4)
        compiled, interpreted = (stream(seed_sequence(8)) for _ in range(2))
        actions = np.random.default_rng(8).integers(21, size=1000)
        failed = True
        for action in actions.tolist():
            if failed:
                index = dynamics.reset(world, compiled)
                simulator.functions.reset(simulator.parameters, state, interpreted)
                assert index == simulator.functions.index(simulator.parameters, state)
            index, reward_seen, failed = dynamics.step(world, index, action, compiled)
            expected = simulator.functions.step(simulator.parameters, state, action, interpreted)
            assert (reward_seen, failed) == expected
            assert world.state.tobytes() == state.tobytes()
            assert index == simulator.functions.index(simulator.parameters, state)
        assert np.array_equal(compiled, interpreted)


def starts(world: SimulatorArrays, n: int, seed: int) -> FloatArray:
    rng = stream(seed_sequence(seed))
    found = np.zeros((n, 4))
    for i in range(n):
        dynamics.reset(world, rng)
        found[i] = world.state
    return found


def test_uniform_starts() -> None:
    found = starts(cart_pole(start="uniform").world().arrays, 1500, 4)
    assert np.abs(found).max() <= 0.05
    for i in range(4):
        assert kstest(found[:, i], "uniform", (-0.05, 0.1)).pvalue > 0.01
    assert np.abs(np.corrcoef(found.T) - np.eye(4)).max() < 0.1
    assert np.array_equal(starts(cart_pole().world().arrays, 3, 4), [[0.0, 0.0, 0.0, 0.01]] * 3)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"reward": "shape"}, UnknownNameError, r"unknown reward 'shape': did you mean 'shaped'\?"),
        ({"start": 0.05}, ParameterTypeError, r"start must be one of fixed, uniform; got 0\.05"),
        ({"cart_mass": 0.0}, ParameterError, r"cart_mass must be a finite number above 0; got 0\.0"),
        ({"pole_mass": -0.1}, ParameterError, r"pole_mass must be a finite number above 0; got -0\.1"),
        ({"half_length": math.nan}, ParameterError, r"half_length must be .* got nan"),
        ({"time_step": 0}, ParameterError, r"time_step must be .* got 0\.0"),
        ({"force": 0.0}, ParameterError, r"force must be"),
        ({"gravity": -9.8}, ParameterError, r"gravity must be a finite number of at least 0; got -9\.8"),
        ({"track": math.inf}, ParameterError, r"track must be .* got inf"),
        ({"fall": 181.0}, ParameterError, r"fall must be a number in \(0, 180\]; got 181\.0"),
        ({"fall": "45"}, ParameterTypeError, r"fall must be .* got '45' of type str"),
        ({"max_episode_steps": 0}, ParameterError, r"max_episode_steps must be a whole number of at least 1; got 0"),
    ],
)
def test_impossible_parameters(parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        cart_pole(**parameters)


def test_limits_may_be_changed_and_parameters_not() -> None:
    assert cart_pole().max_episode_steps == 1000
    assert cart_pole(max_episode_steps=None).world().arrays.max_episode_steps > 10**18
    with pytest.raises(ValueError, match="read-only"):
        cart_pole().parameters[0] = 1.0


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"discrete": False},
        {"start": "uniform", "reward": "sign", "render_mode": "ansi"},
        {"discrete": False, "start": "uniform", "render_mode": "rgb_array"},
        {"render_mode": "rgb_array", **OTHERS},
    ],
    ids=str,
)
def test_gymnasium_finds_no_fault(parameters: dict[str, Any]) -> None:
    check_env(gymnasium.make(ID, **parameters).unwrapped)


def test_spaces_and_what_it_carries() -> None:
    env = gymnasium.make(ID).unwrapped
    assert isinstance(env, CartPoleEnv)
    assert env.observation_space == gymnasium.spaces.Discrete(110)
    assert env.action_space == gymnasium.spaces.Discrete(21)
    assert env.simulator is not None
    assert env.simulator.max_episode_steps is None
    problem = as_problem(ID)
    assert isinstance(problem, Simulator)
    assert (problem.n_states, problem.n_actions, problem.max_episode_steps) == (110, 21, 1000)
    four = gymnasium.make(ID, discrete=False)
    assert four.observation_space.shape == (4,)
    assert four.observation_space.dtype == np.float64
    with pytest.raises(SpaceError, match="give bins"):
        as_problem(four)


@pytest.mark.parametrize("start", ["fixed", "uniform"])
def test_the_environment_equals_the_kernel(start: str) -> None:
    env = CartPoleEnv(start=start)
    four = CartPoleEnv(start=start, discrete=False)
    assert env.simulator is not None
    world = env.simulator.world().arrays
    for seed in range(5):
        observation, _ = env.reset(seed=seed)
        numbers, _ = four.reset(seed=seed)
        rng = np.random.default_rng(seed).integers(0, 2**64, size=4, dtype=np.uint64)
        assert dynamics.reset(world, rng) == observation
        terminated = False
        while not terminated:
            assert np.array_equal(world.state, numbers)
            action = env.action_space.sample()
            expected = dynamics.step(world, 0, action, rng)
            observation, reward, terminated, truncated, info = env.step(action)
            numbers, same, *_ = four.step(action)
            assert (observation, reward, terminated) == expected
            assert (truncated, info, same) == (False, {}, reward)


def test_seeds_decide_a_uniform_start() -> None:
    env = CartPoleEnv(discrete=False, start="uniform")
    first, again, other = (env.reset(seed=seed)[0] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert not np.array_equal(other, env.reset()[0]), "episodes of one seed differ"


def test_an_observation_stays_as_it_was() -> None:
    env = CartPoleEnv(discrete=False)
    first, _ = env.reset(seed=0)
    second, *_ = env.step(20)
    assert first.tolist() == [0.0, 0.0, 0.0, 0.01]
    second[:] = 9.0
    assert np.abs(env.step(10)[0]).max() < 1.0


def balanced(observation: FloatArray) -> int:
    x, speed, angle, rate = observation
    return int(np.clip(np.rint(10 + 10 * (0.1 * x + 0.3 * speed + 6.0 * angle + 1.2 * rate)), 0, 20))


@pytest.mark.parametrize(("limit", "steps"), [(None, 1000), (7, 7)])
def test_the_time_limit_truncates(limit: int | None, steps: int) -> None:
    env = gymnasium.make(ID, discrete=False, max_episode_steps=limit)
    observation, _ = env.reset()
    ends = []
    for _ in range(steps):
        observation, _, *end, _ = env.step(balanced(observation))
        ends.append(end)
    assert ends == [[False, False]] * (steps - 1) + [[False, True]]


def test_steps_need_a_reset() -> None:
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        CartPoleEnv().step(0)


@pytest.mark.parametrize("action", [21, -1, 0.0, "left", None])
def test_unknown_actions_are_refused(action: Any) -> None:
    env = CartPoleEnv()
    env.reset()
    with pytest.raises(ParameterError, match=r"action must be from 0 \(full force to the left\) to 20"):
        env.step(action)


def test_actions_of_small_integer_types_push_to_the_left() -> None:
    env = CartPoleEnv(discrete=False)
    env.reset()
    small: Any = np.uint8(0)
    assert env.step(small)[0][1] == pytest.approx(-0.1951219512195)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"discrete": 1}, ParameterTypeError, r"discrete must be True or False; got 1"),
        ({"render_mode": "rgb"}, UnknownNameError, r"unknown render_mode 'rgb'"),
        ({"fall": 0}, ParameterError, r"fall must be"),
        ({"falls": 45}, TypeError, r"unexpected keyword argument 'falls'"),
    ],
)
def test_bad_environments(parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        CartPoleEnv(**parameters)


def pushed(render_mode: str, actions: list[int], **parameters: Any) -> Any:
    env = CartPoleEnv(render_mode=render_mode, **parameters)
    env.reset()
    for action in actions:
        env.step(action)
    return env.render()


def test_text() -> None:
    assert pushed("ansi", []) == (
        f"[{'-' * 20}|{'-' * 20}] x +0.000 m, x' +0.000 m/s, theta +0.00 deg, theta' +0.57 deg/s, force +0.0 N"
    )
    leaning = pushed("ansi", [20] * 15)
    assert leaning[1:42] == "-" * 22 + "\\" + "-" * 18
    assert leaning.endswith("force +10.0 N")
    assert "/" in pushed("ansi", [0] * 15)[1:42]


def columns(image: Any, colour: tuple[int, int, int]) -> Any:
    """Where pixels of one colour lie from left to right, counted from the middle."""
    return np.flatnonzero((image == colour).all(axis=2).any(axis=0)) - WIDTH / 2


def test_picture() -> None:
    image = pushed("rgb_array", [])
    assert (image.shape, image.dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
    assert abs(columns(image, POLE).mean()) < 1
    assert abs(columns(image, CART).mean()) < 1
    assert columns(image, PUSH).size == 0
    assert tuple(image[GROUND + 1, WIDTH // 2 + 100]) == TRACK
    assert tuple(image[5, 5]) == SKY
    left = pushed("rgb_array", [0] * 20)
    assert columns(left, PUSH).max() < columns(left, CART).min(), "the arrow points away from the cart, to the left"
    assert columns(left, POLE).max() > columns(left, CART).mean() + 20, "the pole falls to the right"
    far = pushed("rgb_array", [0] * 3, track=0.001)
    assert columns(far, CART).size > 0


def test_render_without_a_mode_warns() -> None:
    env = CartPoleEnv()
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_failures_without_rows_of_their_own_fall_into_the_grid() -> None:
    plain, absorbing = cart_pole(absorbing=False), cart_pole()
    for numbers in ([4.5, 1.0, 0.0, 1.0], [0.0, 0.0, math.radians(50), -1.0], [-5.0, 0.0, -2.0, 0.0]):
        state = np.array(numbers)
        assert absorbing.functions.index(absorbing.parameters, state) >= 108
        row = plain.functions.index(plain.parameters, state)
        inside = np.array([np.sign(state[0]), np.sign(state[1]), np.clip(state[2], -0.2, 0.2), state[3]])
        assert row == absorbing.functions.index(absorbing.parameters, inside)
    with pytest.raises(ParameterTypeError, match="absorbing must be True or False"):
        cart_pole(absorbing=2)  # type: ignore[arg-type]  # wrong on purpose
