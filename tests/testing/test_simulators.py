"""What usually goes wrong with a simulator or arrays is found, and the message says how to correct it."""

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tuckerl import Maze, Simulator, TabularMDP
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemCheckError
from tuckerl.rng import uniform
from tuckerl.testing import check_problem


def reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def step(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    if uniform(rng) >= parameters[0]:
        state[0] = min(max(state[0] + (1.0 if action == 1 else -1.0), 0.0), 4.0)
    return -1.0, state[0] == 4.0


def simulator(**changes: Any) -> Simulator:
    """A walk on five places, right but for the changes."""
    settings: dict[str, Any] = {"reset": reset, "step": step, "n_states": 5, "n_actions": 2, "parameters": [0.1]}
    return Simulator(**(settings | {"max_episode_steps": 50} | changes))


def test_two_functions_are_enough() -> None:
    check_problem(simulator())
    check_problem(simulator(max_episode_steps=None))
    check_problem(simulator(n_states=9))  # rows that are never reached are no mistake


def test_functions_that_users_compiled_are_taken_apart() -> None:
    numba = pytest.importorskip("numba")
    check_problem(simulator(reset=numba.njit(reset), step=numba.njit(step)))


def reset_forgets(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0  # and leaves state[1]


def reset_adds(parameters: Any, state: Any, rng: Any) -> None:
    state[0] -= min(state[0], 3.0)


def reset_returns(parameters: Any, state: Any, rng: Any) -> Any:
    state[0] = 0.0
    return state


def reset_raises(parameters: Any, state: Any, rng: Any) -> None:
    state[7] = 0.0


def step_writes(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    parameters[0] = 0.5
    return -1.0, True


def step_draws(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return random.random(), True  # noqa: S311


def step_draws_with_numpy(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return np.random.normal(), True  # noqa: NPY002


_counted = [0]


def step_counts(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    _counted[0] += 1
    return -1.0, _counted[0] > 7


def step_says_one(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return -1.0, 1


def step_pays_only(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return -1.0


def step_overflows(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return float("inf"), True


def step_loses(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    state[0] = float("nan")
    return -1.0, True


def step_never_ends(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return -1.0, False


def step_goes_half(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    state[0] += 0.5
    return -1.0, True


def step_makes_a_list(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    words = {"go": [action]}
    return -1.0, sum(map(len, words.values())) == 1


def step_counts_high(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    number = 3
    for _ in range(50):
        number = number * 3  # past 64 bits
    return float(number % 7), True


def index_moves(parameters: Any, state: Any) -> int:
    state[0] += 1.0
    return 0


def index_is_high(parameters: Any, state: Any) -> int:
    return int(state[0]) + 2


def index_is_a_float(parameters: Any, state: Any) -> Any:
    return state[0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"reset": reset_forgets, "state_size": 2},
            r"reset must set every entry .* entry 1 was left .* `state\[:\] = 0",
        ),
        ({"reset": reset_adds}, r"reset must give the same state on the same stream; .* gave \[1231.5\], then \[0.\]"),
        ({"reset": reset_returns}, r"reset must return nothing .* it returned array"),
        ({"reset": reset_raises}, r"reset raised IndexError in the reset of episode 0: .* compiled code cannot raise"),
        ({"step": step_writes}, r"step must not write to `parameters`.* made \[0.1\] into \[0.5\]: keep .* in `state`"),
        (
            {"step": step_draws},
            r"step must give the same .* step 1 of episode 0 .*draw with tuckerl.rng.uniform\(rng\)",
        ),
        ({"step": step_draws_with_numpy}, r"step must give the same .*draw with tuckerl.rng.uniform\(rng\)"),
        ({"step": step_counts}, r"step must give the same .* keep what is remembered in `state`"),
        ({"step": step_says_one}, r"step must return \(reward, terminated\).* it returned \(-1.0, 1\): write"),
        ({"step": step_pays_only}, r"step must return \(reward, terminated\).* it returned -1.0: write"),
        ({"step": step_overflows}, r"rewards and states must be finite; in step 1 .* the reward was inf"),
        ({"step": step_loses}, r"rewards and states must be finite; in step 1 .* the state \[nan\]"),
        ({"step": step_goes_half}, r"without an index function .* it was 0.5, no whole number: pass index"),
        pytest.param(
            {"step": step_makes_a_list}, r"the simulator's step cannot be compiled", marks=pytest.mark.compiled
        ),
        pytest.param(
            {"step": step_counts_high},
            r"must agree to 1e-09; in step 1 .* the reward is .* whole numbers have 64 bits",
            marks=pytest.mark.compiled,
        ),
        ({"index": index_moves}, r"index must only look at the state; .* from \[0.\] to \[1.\]: move that into step"),
        ({"index": index_is_high}, r"index must lie from 0 to 4; in step \d+ of episode \d+ \(action 1 .* it was 5"),
        ({"index": index_is_a_float}, r"index must return an int; .* it returned .*: write int\(...\) around it"),
    ],
)
def test_a_mistake_is_found(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ProblemCheckError, match=message):
        check_problem(simulator(**changes))


def test_an_episode_that_never_ends_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tuckerl.testing.simulators.LONGEST", 1000)
    check_problem(simulator(step=step_never_ends))
    with pytest.raises(ProblemCheckError, match=r"did not end in 1,000 steps .* set max_episode_steps"):
        check_problem(simulator(step=step_never_ends, max_episode_steps=None))


_speed = 1.0


def step_at_speed(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    state[0] = min(state[0] + _speed, 4.0)
    return -_speed, state[0] == 4.0


@pytest.mark.compiled
def test_a_name_that_changed_after_compiling_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    walk = simulator(step=step_at_speed)
    check_problem(walk)
    monkeypatch.setattr("tests.testing.test_simulators._speed", 2.0)
    with pytest.raises(ProblemCheckError, match=r"the state is \[2.\] in Python and \[1.\] compiled: names outside"):
        check_problem(walk)


def arrays(**changes: Any) -> TabularMDP:
    """A corridor of three places whose right end is the goal, right but for the changes."""
    settings: dict[str, Any] = {
        "next_state": [[0, 1], [0, 2], [2, 2]],
        "reward": [[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
        "terminated": [[False, False], [False, True], [False, False]],
    }
    return TabularMDP(**(settings | changes))


def test_a_goal_that_ends_nothing_is_found() -> None:
    check_problem(arrays())
    check_problem(arrays(max_episode_steps=10))
    never = np.zeros((3, 2), dtype=np.bool_)
    with pytest.raises(ProblemCheckError, match=r"reaches state 2, which no action leaves .* mark the outcomes"):
        check_problem(arrays(terminated=never, max_episode_steps=10))


def test_arrays_without_an_end_need_a_time_limit() -> None:
    around: dict[str, Any] = {"next_state": [[0, 1], [0, 2], [2, 0]], "terminated": np.zeros((3, 2), dtype=np.bool_)}
    check_problem(arrays(**around, max_episode_steps=10))
    with pytest.raises(ProblemCheckError, match=r"reaches state 0, from where no episode ends.* set max_episode_steps"):
        check_problem(arrays(**around))


def test_an_action_that_may_not_be_taken_is_no_way_out() -> None:
    mask = [[True, True], [True, False], [True, True]]
    with pytest.raises(ProblemCheckError, match="reaches state 0, from where no episode ends"):
        check_problem(arrays(action_mask=mask))


def test_a_way_that_chance_opens_counts() -> None:
    outcomes: Callable[[Any, Any], list[list[list[Any]]]] = lambda often, seldom: [[[often, seldom]]] * 2  # noqa: E731
    chance = TabularMDP(outcomes(0, 1), outcomes(-1.0, 0.0), outcomes(False, True), [[[0.99, 0.01]]] * 2)
    check_problem(chance)


def test_mazes_are_problems() -> None:
    check_problem(Maze(np.zeros((3, 3), dtype=np.bool_), (0, 0), (2, 2)))


def test_what_is_no_problem_is_refused() -> None:
    with pytest.raises(ParameterTypeError, match=r"problem must be a Gymnasium environment, .* got 7"):
        check_problem(7)  # type: ignore[arg-type]
    with pytest.raises(ParameterTypeError, match=r"the callable must make a Gymnasium environment or .*; it made None"):
        check_problem(lambda: None)  # type: ignore[arg-type,return-value]
    with pytest.raises(ParameterError, match="episodes must be a whole number of at least 1; got 0"):
        check_problem(simulator(), episodes=0)
    with pytest.raises(ParameterError, match="seed must be a whole number of at least 0; got -1"):
        check_problem(simulator(), seed=-1)
