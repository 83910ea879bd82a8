"""Ctrl-C and errors in users' functions leave a learner that can go on as if nothing had been."""

import signal
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import QLearning, TensorStep
from tuckerl.generalization.sharing import ShareContext
from tuckerl.interrupts import interrupts_held_back
from tuckerl.types import FloatArray

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
