"""Python functions that an algorithm's kernels call: their answers arrive, and so do their errors."""

import signal
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.adapters.parallel_worlds import Leaving
from tests.learners.worlds import random_mdp
from tuckerl import TensorStep, kernel
from tuckerl.errors import LearnerError
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.python_calls import PythonCallArrays, call_function
from tuckerl.types import FloatArray, IntArray

PROBLEM = random_mdp(81, limit=6)


class StudyState(NamedTuple):
    """What `Studies` keeps for one agent."""

    answers: IntArray  # (1,) the sum of the answers
    ended: IntArray  # (2,) episodes that ended whole, and that were broken off
    advice: FloatArray  # (1,) what the function wrote there is added to each value
    call: PythonCallArrays
    in_update: bool  # whether each step calls, instead of each episode's end


@kernel
def update(algorithm: StudyState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Change a value, and ask in the middle of the episode, if that is wanted."""
    record_change(agent.log, transition.state)
    agent.q[transition.state, transition.action] += 1.0 + algorithm.advice[0]
    if algorithm.in_update:
        algorithm.answers[0] += call_function(algorithm.call, transition.state)
    return not algorithm.call.failed[0]


@kernel
def end_episode(algorithm: StudyState, agent: AgentArrays, finished: bool) -> bool:
    """Ask after the episode, if that is wanted, and count it."""
    if finished and not algorithm.in_update:
        algorithm.answers[0] += call_function(algorithm.call, algorithm.ended[0])
    algorithm.ended[0 if finished and not algorithm.call.failed[0] else 1] += 1
    return not algorithm.call.failed[0]


register_algorithm(StudyState, update=update, end_episode=end_episode)


class Studies(Learner):
    """A learner whose kernels ask a Python function."""

    state_type = StudyState

    def __init__(self, env: Any, *, function: Callable[[int], Any], in_update: bool = False, **parameters: Any) -> None:
        self.function, self.in_update = function, in_update
        super().__init__(env, **parameters)
        self.call = self.call_from_kernels(function)

    def declare_state(self) -> tuple[Declaration, ...]:
        return (
            DeclaredArray("answers", "none", (1,), np.int64),
            DeclaredArray("ended", "none", (2,), np.int64),
            DeclaredArray("advice", "none", (1,)),
        )

    def constants(self) -> dict[str, Any]:
        return {"call": self.call.arrays, "in_update": self.in_update}

    def kept(self, name: str) -> list[list[float]]:
        return [declared[name].tolist() for declared in self.declared]


class NoRoadError(Exception):
    """An error of the user's own."""


class Fails:
    """Raises an error at chosen calls, counted from 1; otherwise it answers 1."""

    def __init__(self, *places: int, error: Callable[[], BaseException] = lambda: NoRoadError("no road")) -> None:
        self.places, self.error, self.n_calls = places, error, 0

    def __call__(self, argument: int) -> int:
        self.n_calls += 1
        if self.n_calls in self.places:
            raise self.error()
        return 1


@pytest.mark.slow
def test_answers_arrive_and_arguments_do() -> None:
    asked: list[int] = []

    def answer(argument: int) -> int:
        asked.append(argument)
        return 10 * argument - 7

    learner = Studies(PROBLEM, function=answer, seed=1).learn(5)
    assert asked == [0, 1, 2, 3, 4]
    assert learner.kept("answers") == [[10 * 10 - 5 * 7]]
    asked.clear()
    stepwise = Studies(PROBLEM, function=answer, in_update=True, n_agents=2, seed=1).learn(3)
    assert len(asked) == stepwise.steps.sum()
    assert asked[-stepwise.trajectories[1].size + 1 :] == stepwise.trajectories[1][:-1].tolist()


def test_what_the_function_writes_into_arrays_is_read_by_kernels() -> None:
    learner: Studies

    def advise(argument: int) -> int:
        learner.declared[0]["advice"][0] = 99.0 if argument == 1 else 0.0
        return 0

    learner = Studies(PROBLEM, function=advise, seed=1)
    added = []
    for _ in range(4):
        before = learner.q.sum()
        learner.learn(1)
        added.append((learner.q.sum() - before) / learner.steps[-1, 0])
    assert added == [1, 1, 100, 1], "the advice after the second episode is for the third"


@pytest.mark.slow
@pytest.mark.parametrize("step", [None, TensorStep(every=5, ranks=(2, 2, 2, 1), floor=0.1)])
@pytest.mark.parametrize("in_update", [False, True])
def test_an_error_is_raised_as_it_is_and_learning_goes_on(in_update: bool, step: TensorStep | None) -> None:
    whole = Studies(PROBLEM, function=Fails(), tensor_step=step, seed=1).learn(9)
    place = int(whole.steps[:3].sum()) + 1 if in_update else 4
    function = Fails(place)
    learner = Studies(PROBLEM, function=function, in_update=in_update, tensor_step=step, seed=1)
    with pytest.raises(NoRoadError, match="no road"):
        learner.learn(9)
    assert function.n_calls == place, "it is not called again before learn() has raised its error"
    assert learner.episodes == 3, "the fourth was broken off"
    assert learner.diverged_at is None
    assert learner.is_saveable
    assert learner.trajectories[0].size == learner.steps[-1, 0] + 1
    np.testing.assert_array_equal(learner.steps, whole.steps[:3])
    learner.learn(6)
    assert learner.episodes == 9
    assert learner.trajectories[0].size == learner.steps[-1, 0] + 1
    assert learner.kept("ended") == [[9, 0]], "an episode that is broken off has never been"
    np.testing.assert_array_equal(learner.q, whole.q)
    if step is not None:
        assert learner.tensor_step_history.episode.tolist() == [5]


@pytest.mark.parametrize("in_update", [False, True])
def test_an_agent_that_falls_behind_by_an_error_catches_up(in_update: bool) -> None:
    # All agents have one function; the second agent's first call fails.
    first = int(Studies(PROBLEM, function=Fails(), seed=1).learn(1).steps.sum())
    function = Fails(first + 1 if in_update else 2)
    learner = Studies(PROBLEM, function=function, in_update=in_update, n_agents=3, seed=1)
    with pytest.raises(NoRoadError):
        learner.learn(4)
    assert learner.history.finished.tolist() == [1, 0, 0], "agents take turns where no episode can be played twice"
    assert not learner.in_sync
    learner.learn(4)
    assert learner.in_sync
    assert learner.history.finished.tolist() == [4, 4, 4]
    assert learner.kept("ended") == [[4, 0], [4, 0], [4, 0]]


@pytest.mark.slow
def test_of_agents_in_one_world_every_one_hears_of_the_error() -> None:
    # They leave after 1, 2 and 3 steps, six in all. In the next episode, the second agent's second step fails.
    learner = Studies(Leaving(), function=Fails(6 + 4), in_update=True, seed=1)
    with pytest.raises(NoRoadError):
        learner.learn(3)
    assert learner.episodes == 1
    assert learner.kept("ended") == [[1, 0]] * 3, "the first had left already, and plays again"
    learner.learn(2)
    assert learner.steps.tolist() == [[1, 2, 3]] * 3


@pytest.mark.slow
@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_errors_of_any_kind_come_out(error: type[BaseException]) -> None:
    learner = Studies(PROBLEM, function=Fails(2, error=error), seed=1)
    with pytest.raises(error):
        learner.learn(5)
    assert learner.learn(4).episodes == 5


def test_ctrl_c_in_a_function_waits_as_it_does_in_a_kernel() -> None:
    def press(argument: int) -> int:
        if argument == 2:
            signal.raise_signal(signal.SIGINT)
        return 1

    learner = Studies(PROBLEM, function=press, seed=1)
    with pytest.raises(KeyboardInterrupt):
        learner.learn(2500)
    assert 0 < learner.episodes < 2500
    assert learner.kept("answers") == [[learner.episodes]]
    assert learner.is_saveable


@pytest.mark.parametrize("answer", ["one", "1", None, [1], 1.0, 1.5, np.nan, 2**63, -(2**63) - 1])
def test_answers_that_are_no_whole_numbers_of_64_bits_are_errors(answer: Any) -> None:
    learner = Studies(PROBLEM, function=lambda argument: answer, seed=1)
    with pytest.raises(
        LearnerError, match=r"<lambda>, which kernels call, must return a whole number of at most 64 bi"
    ):
        learner.learn(5)
    assert learner.episodes == 0


@pytest.mark.parametrize("answer", [7, True, np.int32(7), np.bool_(True), 2**63 - 1, -(2**63)])
def test_answers_that_are_whole_numbers_arrive(answer: Any) -> None:
    learner = Studies(PROBLEM, function=lambda argument: answer, seed=1).learn(1)
    assert learner.kept("answers") == [[int(answer)]]
