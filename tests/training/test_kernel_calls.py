"""In which thread a kernel runs, and that nothing is lost where it is broken off."""

import os
import signal
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import DynaQ, QLearning, Simulator, Softmax, TensorStep, cart_pole
from tuckerl.training.kernel_calls import KernelCall
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(43, ends=0.0).with_time_limit(5)
pytestmark = pytest.mark.compiled


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The kernels that run in a thread of their own."""
    found: list[str] = []
    original: Any = KernelCall._run_beside

    def noted(self: KernelCall, kernel: Callable[..., int], arguments: tuple[Any, ...]) -> int:
        found.append(kernel.__name__)
        return int(original(self, kernel, arguments))

    monkeypatch.setattr(KernelCall, "_run_beside", noted)
    return found


def _begins(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def _ends(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    return 1.0, True


def _compiled(learner: Learner) -> Learner:
    """Return a learner whose kernels are compiled, and whose pace is known."""
    return learner.learn(1).learn(1)


@pytest.mark.parametrize("make", [lambda: PROBLEM, lambda: cart_pole().with_time_limit(20)], ids=["table", "simulator"])
def test_a_brief_call_runs_in_the_callers_thread(make: Callable[[], Any], beside: list[str]) -> None:
    learner = _compiled(QLearning(make(), seed=0))
    beside.clear()
    learner.learn(10)
    assert beside == []
    whole = QLearning(make(), seed=0).learn(12)
    assert "play" in beside, "as it may have to be compiled"
    np.testing.assert_array_equal(learner.q, whole.q)


@pytest.mark.parametrize(
    "make",
    [
        lambda: QLearning(Simulator(_begins, _ends, n_states=1, n_actions=2, max_episode_steps=5), seed=0),
        lambda: QLearning(random_mdp(44, ends=0.5).with_time_limit(10**12), seed=0),
        lambda: DynaQ(PROBLEM, planning_steps=200_000, seed=0),
    ],
    ids=["functions of a user's own", "no time limit", "much planning"],
)
def test_a_call_that_may_not_be_brief_can_be_left(make: Callable[[], Learner], beside: list[str]) -> None:
    learner = _compiled(make())
    beside.clear()
    learner.learn(2)
    assert set(beside) == {"play"}


def test_another_policy_may_have_to_be_compiled(beside: list[str]) -> None:
    learner = _compiled(QLearning(PROBLEM, tensor_step=TensorStep(every=1, weights="constant", share="none"), seed=0))
    beside.clear()
    learner.policy = Softmax(1.0)
    learner.learn(1)
    assert set(beside) == {"play"}


@pytest.mark.skipif(os.name == "nt", reason="a process cannot send itself Ctrl-C there")
def test_what_is_undone_is_played_again_to_the_same_bits_however_often_ctrl_c_is_pressed() -> None:
    problem = PROBLEM.with_time_limit(200_000)
    learner = _compiled(QLearning(problem, seed=0))
    for seconds in (0.1, 0.104):
        threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        learner.learn(2000)
    n = learner.episodes
    assert 2 <= n < 2000
    again, whole = learner.learn(3), QLearning(problem, seed=0).learn(n + 3)
    np.testing.assert_array_equal(again.q, whole.q)
    np.testing.assert_array_equal(again.returns, whole.returns)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there are no such timers")
@pytest.mark.parametrize("limit", [5, 10**12])
def test_what_the_handler_of_another_signal_raises_comes_out_and_nothing_is_lost(limit: int) -> None:
    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    problem = PROBLEM.with_time_limit(limit)
    learner = QLearning(PROBLEM.with_time_limit(limit), seed=0)
    if limit == 5:
        _compiled(learner)
    before = signal.signal(signal.SIGALRM, late)
    begun = time.monotonic()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        with pytest.raises(TimeoutError):
            learner.learn(10**7)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert time.monotonic() - begun < 5.0
    n = learner.episodes
    if limit == 5:
        np.testing.assert_array_equal(learner.learn(3).q, QLearning(problem, seed=0).learn(n + 3).q)
    else:
        assert n == 0
        assert not learner.q.any()
