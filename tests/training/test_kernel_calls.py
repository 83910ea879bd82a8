"""In which thread a kernel runs, and how it is asked to return there."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import EpsilonGreedy, QLearning, Simulator, cart_pole
from tuckerl.training.kernel_calls import KernelCall
from tuckerl.training.loop import play

PROBLEM = random_mdp(43, ends=0.0).with_time_limit(5)


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


class Own(EpsilonGreedy):
    """A policy that is not the library's."""


def test_kernels_of_the_library_run_in_the_callers_thread_once_they_are_compiled(beside: list[str]) -> None:
    for problem in (PROBLEM, cart_pole()):
        QLearning(problem, seed=0).learn(2)
        beside.clear()
        QLearning(problem, seed=0).learn(2)
        assert beside == []


@pytest.mark.parametrize(
    "make",
    [
        lambda: QLearning(Simulator(_begins, _ends, n_states=1, n_actions=2), seed=0),
        lambda: QLearning(PROBLEM, policy=Own(0.1), seed=0),
    ],
    ids=["simulator", "policy"],
)
def test_functions_of_a_users_own_run_in_a_thread_that_can_be_left(
    make: Callable[[], QLearning], beside: list[str]
) -> None:
    for _ in range(2):
        beside.clear()
        make().learn(2)
        assert set(beside) == {"play"}


@pytest.mark.parametrize(("seconds", "n_episodes"), [(0.0, -(-(2**16) // 5)), (1000.0, 20_000)])
def test_short_episodes_too_are_followed_by_a_return_now_and_then(seconds: float, n_episodes: int) -> None:
    learner = QLearning(PROBLEM, seed=0)
    state, call = learner._state, KernelCall(calls_python=True, seconds=seconds)
    world = state.worlds[0]
    agent = state.agent(0, 20_000, 10**9, world.action_masks[0], learner.algorithm_state, call)
    assert agent.record.steps.size == 20_000
    assert call.run(play, world.arrays, agent) == n_episodes
    assert np.count_nonzero(agent.record.steps) == n_episodes
