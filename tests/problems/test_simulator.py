"""Simulators: users' own functions in kernels, what is compiled how often, and what is said when they are wrong."""

import copy
import os
import pickle
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tuckerl
from tuckerl._jit import kernel
from tuckerl.environments.cart_pole import cart_pole
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, SimulatorError
from tuckerl.problems import dynamics
from tuckerl.problems.simulator import Simulator, SimulatorArrays
from tuckerl.rng import below, seed_sequence, stream, uniform
from tuckerl.types import FloatArray, Stream


# A walk on a line of 5 places that ends at the right; parameters[0] is the chance to slip and stay.
def reset(parameters: FloatArray, state: FloatArray, rng: Stream) -> None:
    state[0] = 0.0


def step(parameters: FloatArray, state: FloatArray, action: int, rng: Stream) -> tuple[float, bool]:
    if uniform(rng) >= parameters[0]:
        state[0] = min(max(state[0] + (1.0 if action == 1 else -1.0), 0.0), 4.0)
    return -1.0, state[0] == 4.0


def index(parameters: FloatArray, state: FloatArray) -> int:
    return int(state[0])


def line(slip: float = 0.5, **changes: Any) -> Simulator:
    return Simulator(
        changes.get("reset", reset),
        changes.get("step", step),
        changes.get("index", index),
        n_states=changes.get("n_states", 5),
        n_actions=changes.get("n_actions", 2),
        state_size=changes.get("state_size", 1),
        parameters=changes.get("parameters", [slip]),
        heuristic=changes.get("heuristic"),
    )


@pytest.fixture(scope="module")
def slippery() -> Simulator:
    """One simulator for many tests: compiling a user's functions takes half a second."""
    return line()


@kernel
def play(world: SimulatorArrays, episodes: int, rng: Stream) -> tuple[int, float]:
    """Play episodes of random actions and return all steps and rewards."""
    n, total = 0, 0.0
    for _ in range(episodes):
        state, steps, terminated = dynamics.reset(world, rng), 0, False
        while not terminated and steps < world.max_episode_steps:
            state, reward, terminated = dynamics.step(world, state, below(world.n_actions, rng), rng)
            total += reward
            steps += 1
        n += steps
    return n, total


def rng(seed: int = 0) -> Stream:
    return stream(seed_sequence(seed))


def test_a_users_functions_are_played() -> None:
    world = line(slip=0.0).world()
    assert dynamics.reset(world.arrays, rng()) == 0
    walked = [dynamics.step(world.arrays, 0, action, rng()) for action in (1, 1, 0, 0, 0, 1, 1, 1, 1)]
    assert [state for state, *_ in walked] == [1, 2, 1, 0, 0, 1, 2, 3, 4]
    assert [reward for _, reward, _ in walked] == [-1.0] * 9
    assert [terminated for *_, terminated in walked] == [False] * 8 + [True]
    world.raise_pending()


def test_they_draw_from_the_agents_stream(slippery: Simulator) -> None:
    world = slippery.world().arrays
    compiled, plain = rng(3), rng(3)
    moves = 0
    dynamics.reset(world, compiled)
    for _ in range(100):
        state, _, terminated = dynamics.step(world, 0, 1, compiled)
        moves += uniform(plain) >= 0.5
        assert state == moves
        if terminated:
            moves = dynamics.reset(world, compiled)
    assert np.array_equal(compiled, plain)


def test_a_number_of_states_that_python_does_not_write_is_shown() -> None:
    huge = Simulator(lambda p, s, r: None, lambda p, s, a, r: (0.0, True), n_states=10**5000, n_actions=2)
    assert "about 10^5000 states" in repr(huge)


def test_a_time_limit_ends_episodes(slippery: Simulator) -> None:
    for limit in (1, 3):  # the end is 4 steps away
        assert play(slippery.with_time_limit(limit).world().arrays, 5, rng()) == (5 * limit, -5.0 * limit)


@pytest.mark.compiled
def test_one_compiled_kernel_plays_all_simulators(slippery: Simulator) -> None:
    for simulator in (slippery, line(slip=0.3), cart_pole(), cart_pole(reward="sign")):
        play(simulator.world().arrays, 1, rng())
    compiled: Any = play
    assert len(compiled.for_python.signatures) == 1


def test_agents_and_learners_share_no_state(slippery: Simulator) -> None:
    simulator = slippery
    worlds = [simulator.world() for _ in range(2)] + [simulator.with_time_limit(9).world()]
    for name in ("state", "fault", "clock"):
        arrays = [getattr(world.arrays, name) for world in worlds]
        assert not any(np.shares_memory(arrays[i], arrays[j]) for i in range(3) for j in range(i))
    streams = [rng(j) for j in range(2)]
    alone = [play(simulator.world().arrays, 20, rng(j)) for j in range(2)]
    for j in range(2):
        dynamics.reset(worlds[j].arrays, rng(9))
    assert [play(worlds[j].arrays, 20, streams[j]) for j in range(2)] == alone


def test_copies_and_time_limits_keep_all_but_the_limit() -> None:
    simulator = line(heuristic=[4.0, 3.0, 2.0, 1.0, 0.0])
    simulator.world()
    limited = simulator.with_time_limit(3)
    assert (simulator.max_episode_steps, limited.max_episode_steps) == (None, 3)
    assert limited.functions is simulator.functions
    assert limited.heuristic is simulator.heuristic
    for other in (pickle.loads(pickle.dumps(cart_pole())), copy.deepcopy(simulator)):  # noqa: S301  # our own
        assert play(other.with_time_limit(50).world().arrays, 2, rng())[0] > 0
    with pytest.raises(ParameterError, match="max_episode_steps must be a whole number of at least 1; got 0"):
        simulator.with_time_limit(0)
    assert repr(limited).endswith("test_simulator, 5 states, 2 actions, max_episode_steps=3)")


def test_another_time_limit_needs_no_other_compilation(slippery: Simulator) -> None:
    here = slippery.world().arrays
    there = slippery.with_time_limit(7).world().arrays
    assert (there.reset, there.step, there.index) == (here.reset, here.step, here.index)
    assert there.max_episode_steps == 7


def test_compiled_functions_of_a_user_are_taken_too() -> None:
    world = line(slip=0.0, index=kernel(index)).world().arrays
    dynamics.reset(world, rng())
    assert dynamics.step(world, 0, 1, rng())[0] == 1


def test_functions_are_compiled_with_the_values_of_today() -> None:
    names: dict[str, Any] = {"uniform": uniform, "PAY": -1.0}
    source = "def step(parameters, state, action, rng):\n    return PAY, uniform(rng) > 2.0\n"
    exec(source, names)  # noqa: S102  # as a notebook does: no source file
    assert dynamics.step(line(step=names["step"]).world().arrays, 0, 0, rng())[1] == -1.0
    names["PAY"] = 3.0
    assert dynamics.step(line(step=names["step"]).world().arrays, 0, 0, rng())[1] == 3.0


def never(parameters: Any, state: Any) -> int:
    return int(state.no_such_thing)


def swapped(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return state[0] == 4.0, -1.0


def only_reward(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return -1.0


def three(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    return -1.0, False, False


def real_index(parameters: Any, state: Any) -> Any:
    return state[0]


def returned_state(parameters: Any, state: Any, rng: Any) -> Any:
    return state


def overwritten(parameters: Any, state: Any, rng: Any) -> None:
    parameters[0] = 1.0


def _id(value: object) -> str:
    """Name a case the same in every process: without the addresses of its functions."""
    if isinstance(value, dict):
        return "-".join(f"{role} {getattr(function, '__name__', function)}" for role, function in value.items())
    return getattr(value, "__name__", str(value))


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("role", "function", "message"),
    [
        ("index", never, "simulator's index cannot be compiled: it may use numbers, arrays, math and"),
        ("reset", overwritten, "simulator's reset cannot be compiled: .* must return nothing"),
        (
            "step",
            swapped,
            r"must return \(reward, terminated\), a number and a bool; it returns Tuple\(bool, float64\)",
        ),
        ("step", only_reward, r"step\(parameters, state, action, rng\) must return .* it returns float64"),
        ("step", three, r"must return \(reward, terminated\), a number and a bool; it returns"),
        ("index", real_index, r"index\(parameters, state\) must return an int; it returns float64"),
        ("reset", returned_state, r"reset\(parameters, state, rng\) must return nothing; it returns"),
    ],
)
def test_functions_of_another_kind(role: str, function: Callable[..., Any], message: str) -> None:
    with pytest.raises(SimulatorError, match=message) as caught:
        line(**{role: function}).world()  # type: ignore[arg-type]  # no role is called slip
    assert len(str(caught.value)) < 300
    if "cannot be compiled" in message:
        assert type(caught.value.__cause__).__module__.startswith("numba")
        assert traceback.format_exception(caught.value)[-1].startswith("tuckerl.errors.SimulatorError: the simulator's")


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        (
            {"step": reset},
            ProblemError,
            r"step must take the arguments \(parameters, state, action, rng\); got reset\(",
        ),
        ({"index": lambda state: 0}, ProblemError, r"index must take the arguments \(parameters, state\)"),
        ({"reset": None}, ParameterTypeError, r"reset must be a function reset\(parameters, state, rng\); got None"),
        ({"index": len}, ParameterTypeError, r"index must be a function index\(parameters, state\)"),
        ({"n_states": 0}, ParameterError, "n_states must be a whole number of at least 1; got 0"),
        ({"n_actions": 2.0}, ParameterTypeError, "n_actions must be a whole number"),
        ({"state_size": 0}, ParameterError, "state_size must be"),
        ({"parameters": [np.nan]}, ProblemError, r"parameters must be finite numbers; got \[nan\]"),
        ({"parameters": ["a"]}, ParameterTypeError, r"parameters must hold numbers; got dtype <U1"),
        ({"heuristic": [1.0]}, ProblemError, "heuristic must be 5 finite numbers"),
    ],
)
def test_impossible_simulators(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        line(**changes)


def far_reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 5.0


def nan_reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = np.nan


def raising_reset(parameters: Any, state: Any, rng: Any) -> None:
    raise ValueError("no start")


def nan_reward(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0
    return (np.nan if state[0] == 3.0 else 0.0), False


def divided(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0
    return 1.0 / (state[0] - 3.0), False


def infinite_state(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] = state[0] + 1.0 if state[0] < 2.0 else -np.inf
    return 0.0, False


def beyond(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0 if state[0] < 2.0 else 1e9
    return 0.0, False


def outside_write(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0
    if state[0] == 3.0:
        state[100_000] = 1.0
    return 0.0, False


def raising(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0
    if state[0] == 3.0:
        raise ValueError("no such place")
    return 0.0, False


def negative_index(parameters: Any, state: Any) -> int:
    return -7 if state[0] == 4.0 else int(state[0])


def raising_index(parameters: Any, state: Any) -> int:
    if state[0] == 4.0:
        raise ValueError("no such place")
    return int(state[0])


THIRD = r"after step 3 of an episode \(action \d in state 2\)"


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reset": far_reset}, r"index must lie from 0 to 4; after reset it was 5 .* the state array was \[5\.\]"),
        ({"reset": nan_reset}, r"rewards and states must be finite; after reset .* the state array was \[nan\]"),
        ({"reset": raising_reset}, r"after reset .* \(a function that raises an error leaves NaN: call it from Python"),
        ({"step": nan_reward}, rf"{THIRD} the reward was nan and the state array was \[3\.\]"),
        ({"step": divided}, rf"{THIRD} the reward was inf and the state array was \[3\.\]"),
        ({"step": infinite_state}, rf"{THIRD} the reward was 0\.0 and the state array was \[-inf\]"),
        ({"step": beyond}, rf"index must lie from 0 to 4; {THIRD} it was 1000000002"),
        ({"step": outside_write}, rf"{THIRD} the reward was nan"),
        ({"step": raising}, rf"{THIRD} the reward was nan and .* call it from Python"),
        ({"index": negative_index}, r"\(action 1 in state 3\) it was -7 .* the state array was \[4\.\]"),
        (
            {"index": raising_index},
            r"\(action 1 in state 3\) it was -1 \(or index raised an error, which reads as -1\)",
        ),
    ],
    ids=_id,
)
def test_faults_are_named_and_every_kernel_ends(changes: dict[str, Any], message: str) -> None:
    world = line(slip=0.0, **changes).world()
    steps, total = play(world.arrays, 1000, rng())  # without a time limit
    assert steps < 20_000
    assert np.isfinite(total)
    with pytest.raises(SimulatorError, match=message):
        world.raise_pending()
    assert play(world.arrays, 1000, rng()) == (steps, total)  # what was raised is forgotten, and comes again
    with pytest.raises(SimulatorError, match=message):
        world.raise_pending()


SCRIPT = """
import sys
from tuckerl.problems import dynamics, simulator
from tuckerl.environments.cart_pole import cart_pole
from tuckerl.problems.simulator import Simulator
from tuckerl.rng import seed_sequence, stream, uniform

def play(world, rng):
    state = dynamics.reset(world, rng)
    return dynamics.step(world, state, 1, rng)

def reset(parameters, state, rng):
    state[0] = uniform(rng)

def step(parameters, state, action, rng):
    return 2.5, True

def index(parameters, state):
    return 1

own = cart_pole().world().arrays
play(own, stream(seed_sequence(0)))
users = Simulator(reset, step, index, n_states=2, n_actions=2, state_size=1).world().arrays
assert play(users, stream(seed_sequence(0))) == (1, 2.5, True)
hits = sum(simulator._step.for_python.stats.cache_hits.values())
print(hits, own.reset.cache_hits, own.step.cache_hits, own.index.cache_hits)
"""


@pytest.mark.slow
@pytest.mark.compiled
def test_a_second_process_compiles_only_users_functions(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    shutil.copytree(Path(tuckerl.__file__).parent, tmp_path / "tuckerl", ignore=shutil.ignore_patterns("__pycache__"))
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    printed = [
        subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert printed == ["0 0 0 0\n", "1 1 1 1\n"]
