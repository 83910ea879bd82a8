"""Ctrl-C is heard wherever a learner is, and it and errors in users' functions leave one that can go on."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import QLearning, TensorStep
from tuckerl.generalization.sharing import ShareContext
from tuckerl.interrupts import interrupts_held_back
from tuckerl.types import FloatArray

pytestmark = pytest.mark.slow

PROBLEM = random_mdp(41)


def _learner(share: Any) -> QLearning:
    step = TensorStep(every=5, ranks=(2, 2, 2, 1), share=share)
    return QLearning(PROBLEM, n_agents=3, seed=2, tensor_step=step)


class Interrupted(QLearning):
    """Ctrl-C is pressed once, while the second agent plays."""

    pressed = False

    def algorithm_state(self, declared: Mapping[str, Any], scheduled: FloatArray) -> Any:
        if declared is self.declared[1] and not self.pressed:
            self.pressed = True
            signal.raise_signal(signal.SIGINT)
        return super().algorithm_state(declared, scheduled)


@pytest.mark.parametrize(("step", "n"), [(None, 2500), (TensorStep(every=5, ranks=(2, 2, 2, 1)), 250)])
def test_ctrl_c_waits_for_whole_windows(step: TensorStep | None, n: int) -> None:
    learner = Interrupted(PROBLEM, n_agents=3, seed=2, tensor_step=step)
    with pytest.raises(KeyboardInterrupt):
        learner.learn(n)
    assert 0 < learner.episodes < n
    learner.learn(n - learner.episodes)
    whole = QLearning(PROBLEM, n_agents=3, seed=2, tensor_step=step).learn(n)
    np.testing.assert_array_equal(learner.q, whole.q)
    np.testing.assert_array_equal(learner.steps, whole.steps)


def test_the_handler_is_put_back() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interrupts_held_back():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_learn_too() -> None:
    learner = QLearning(PROBLEM, seed=1)
    thread = threading.Thread(target=learner.learn, args=(5,))
    thread.start()
    thread.join()
    np.testing.assert_array_equal(learner.q, QLearning(PROBLEM, seed=1).learn(5).q)


def test_a_share_function_that_raises_is_asked_again() -> None:
    failures = [True, True]

    def fails_twice(context: ShareContext) -> int:
        if failures:
            failures.pop()
            raise ZeroDivisionError
        return int(np.argmax(context.agent_norms))

    learner = _learner(fails_twice)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            learner.learn(5)
        assert learner.episodes == 5
    learner.learn(15)
    np.testing.assert_array_equal(learner.q, _learner("max").learn(20).q)


# Ctrl-C in a process of its own, that somebody presses

SETUP = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
import gymnasium, numpy as np, tuckerl
from gymnasium import spaces
FOREVER = 10**12
circle = tuckerl.TabularMDP([[1, 1], [0, 0]], np.ones((2, 2)), np.zeros((2, 2), bool), max_episode_steps=FOREVER)
maze = tuckerl.sutton_maze()

def begins(parameters, state, rng):
    state[0] = 0.0

def goes_round(parameters, state, action, rng):
    state[0] = 1.0 - state[0]
    return -1.0, False

def gets_stuck(parameters, state, action, rng):
    while state[0] >= 0.0:
        state[0] = abs(state[0] - parameters[0])
    return -1.0, True

def simulator(step, limit=FOREVER, parameter=1.0):
    return tuckerl.Simulator(
        begins, step, n_states=2, n_actions=2, parameters=[parameter], max_episode_steps=limit
    )

class World(gymnasium.Env):
    observation_space = action_space = spaces.Discrete(2)
    stuck = False

    def reset(self, seed=None, options=None):
        return 0, {}

    def step(self, action):
        while self.stuck:
            time.sleep(0.01)
        return 1 - action, 1.0, False, False, {}

def world(limit, stuck=False):
    env = World()
    env.stuck = stuck
    return gymnasium.wrappers.TimeLimit(env, limit)

def learn(kind, endless, short, **parameters):
    # Load the kernels by what soon ends, and then learn on what does not.
    fast = {name: 1 if value == 10**9 else value for name, value in parameters.items()}
    kind(short, seed=0, **fast).learn(2)
    learner = kind(endless, seed=0, **parameters)
    print("go", flush=True)
    try:
        learner.learn(3)
    except KeyboardInterrupt:
        print("heard", learner.episodes, learner.q.any(), flush=True)
"""
ENDLESS = {
    "table": "learn(tuckerl.QLearning, circle, circle.with_time_limit(5))",
    "traces": "learn(tuckerl.SarsaLambda, circle, circle.with_time_limit(5), n_agents=2)",
    "simulator": "learn(tuckerl.Sarsa, simulator(goes_round), simulator(goes_round, 5))",
    "planning": "learn(tuckerl.DynaH, maze, maze, planning_steps=10**9)",
    "planning in Python": "learn(tuckerl.DynaH, world(FOREVER), world(5), heuristic=[0, 1], planning_steps=10**9)",
    "environment": "learn(tuckerl.QLearning, world(FOREVER), world(5))",
    "decomposition": """
step = dict(every=2, ranks=(2, 2, 2, 2), tol=0.0)
short = circle.with_time_limit(9)
tuckerl.QLearning(short, n_agents=2, seed=0, tensor_step=tuckerl.TensorStep(**step)).learn(8)
learner = tuckerl.QLearning(short, n_agents=2, seed=0, tensor_step=tuckerl.TensorStep(**step, max_iterations=10**9))
print("go", flush=True)
try:
    learner.learn(4)
except KeyboardInterrupt:
    print("heard", learner.tensor_step_history.episode.size, False, flush=True)
""",
    "evaluation": """
learner = tuckerl.QLearning(circle, seed=0)
tuckerl.QLearning(circle.with_time_limit(5), seed=0).evaluate(2)
print("go", flush=True)
try:
    learner.evaluate(3)
except KeyboardInterrupt:
    print("heard", learner.episodes, learner.q.any(), flush=True)
""",
}
SLOWLY = {"planning in Python": pytest.mark.compiled}  # interpreted, plans between two looks take seconds
STUCK = {
    "simulator": "learn(tuckerl.QLearning, simulator(gets_stuck), simulator(goes_round, 5))",
    "environment": "learn(tuckerl.QLearning, world(9, stuck=True), world(5))",
}


class Child:
    """A program that runs beside this one until it is left."""

    def __init__(self, program: str) -> None:
        command = [sys.executable, "-W", "ignore", "-c", SETUP + program]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def __enter__(self) -> "Child":
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "go\n"
        time.sleep(0.5)
        return self

    def press(self) -> None:
        self._process.send_signal(signal.SIGINT)

    def wait(self, seconds: float) -> tuple[str, str, int]:
        out, err = self._process.communicate(timeout=seconds)
        return out, err, self._process.returncode

    def __exit__(self, *error: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()


@pytest.mark.skipif(os.name == "nt", reason="a process cannot send another one Ctrl-C there")
@pytest.mark.parametrize("kind", [pytest.param(kind, marks=SLOWLY.get(kind, ())) for kind in ENDLESS])
def test_ctrl_c_is_heard_where_nothing_ends(kind: str) -> None:
    with Child(ENDLESS[kind]) as child:
        pressed = time.monotonic()
        child.press()
        out, err, status = child.wait(20.0)
        assert (out, err, status) == ("heard 0 False\n", "", 0), "what was broken off is undone"
        assert time.monotonic() - pressed < 6.0  # two seconds, and the end of a process among many


@pytest.mark.skipif(os.name == "nt", reason="a process cannot send another one Ctrl-C there")
@pytest.mark.parametrize("kind", STUCK)
def test_a_function_that_does_not_return_is_left_at_the_second_ctrl_c(kind: str) -> None:
    with Child(STUCK[kind]) as child:
        child.press()
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(4.0)
        child.press()
        out, err, status = child.wait(20.0)
        assert (out, status) == ("heard 0 False\n", 0)
        assert "Press Ctrl-C again to break it off" in err
