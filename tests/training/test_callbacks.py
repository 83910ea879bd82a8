"""When callbacks are called, how they stop learning, and that learning takes no notice of them."""

import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, random_mdp
from tests.training.counting import countings
from tests.training.test_resume import LEARNERS, assert_same, make
from tuckerl import Callback, Checkpoint, CsvLog, Evaluate, JsonLinesLog, QLearning, StopOnReturn, TensorStep
from tuckerl.errors import DivergenceWarning, EnvironmentFaultError, ParameterError, ParameterTypeError
from tuckerl.generalization.sharing import ShareContext
from tuckerl.training.callbacks.base import CallbackList, Goal
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray

PROBLEM = random_mdp(51)
STEP = TensorStep(every=5, ranks=(2, 2, 2, 1))


class Diary(Callback):
    """Writes down what it is told, into a list that several may share."""

    def __init__(self, every: int | None = None, *, name: str = "", into: list[tuple[str, int]] | None = None) -> None:
        super().__init__(every)
        self.name, self.calls = name, [] if into is None else into

    def on_start(self, learner: Learner) -> None:
        self.calls.append((f"{self.name}start", learner.episodes))

    def on_window(self, learner: Learner) -> None:
        self.calls.append((f"{self.name}window", learner.episodes))

    def on_end(self, learner: Learner) -> None:
        self.calls.append((f"{self.name}end", learner.episodes))


def windows(*episodes: int) -> list[tuple[str, int]]:
    return [("window", episode) for episode in episodes]


@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize(
    ("step", "every", "expected"),
    [
        (None, None, [100, 200]),
        (STEP, None, list(range(5, 231, 5))),
        (None, 90, [90, 180]),
        (STEP, 90, [90, 180]),
        (STEP, 77, [77, 154, 231]),
    ],
)
def test_windows_end_at_multiples(
    step: TensorStep | None, every: int | None, expected: list[int], n_agents: int
) -> None:
    diary = Diary(every)
    QLearning(PROBLEM, n_agents=n_agents, tensor_step=step, seed=1).learn(231, callbacks=[diary])
    assert diary.calls == [("start", 0), *windows(*expected), ("end", 231)]


def test_windows_are_counted_from_the_first_call_of_learn_on() -> None:
    diary, learner = Diary(4), QLearning(PROBLEM, seed=1)
    learner.learn(6, callbacks=[diary])
    learner.learn(6, callbacks=[diary])
    assert diary.calls == [("start", 0), *windows(4), ("end", 6), ("start", 6), *windows(8, 12), ("end", 12)]


def test_a_window_is_not_told_twice() -> None:
    diary, learner = Diary(), QLearning(PROBLEM, seed=1, tensor_step=STEP)
    learner.learn(5, callbacks=[diary]).learn(4, callbacks=[diary])
    assert diary.calls == [("start", 0), *windows(5), ("end", 5), ("start", 5), ("end", 9)]


def test_where_nothing_was_played_nobody_is_called() -> None:
    # An environment that Python steps may have used up its time before the first episode ends.
    diary, learner = Diary(4), QLearning(PROBLEM, seed=1)
    listed = CallbackList(learner, [diary], Goal(8, 10**9), progress=False)
    learner.learn(4)
    listed.call()
    listed.call()
    assert diary.calls == windows(4)


def test_several_are_called_in_their_order() -> None:
    calls: list[tuple[str, int]] = []
    both = [Diary(2, name="a ", into=calls), Diary(3, name="b ", into=calls)]
    QLearning(PROBLEM, seed=1).learn(7, callbacks=both)
    told = [("a start", 0), ("b start", 0), ("a window", 2), ("b window", 3), ("a window", 4)]
    assert calls == [*told, ("a window", 6), ("b window", 6), ("a end", 7), ("b end", 7)]


def test_the_tensor_step_of_a_window_is_done_before() -> None:
    seen: list[tuple[int, int, bool]] = []

    def look(learner: Learner) -> None:
        at_rest = learner.is_saveable and learner.in_sync
        seen.append((learner.episodes, learner.tensor_step_history.episode.size, at_rest))

    QLearning(PROBLEM, n_agents=2, tensor_step=STEP, seed=1).learn(10, callbacks=[look])
    assert seen == [(5, 1, True), (10, 2, True)]


@pytest.mark.parametrize(("answer", "episodes"), [(False, 100), (np.False_, 100), (True, 300), (None, 300), (0, 300)])
def test_false_ends_learning(answer: object, episodes: int) -> None:
    class Answering(Callback):
        def on_window(self, learner: Learner) -> Any:
            return answer

    learner = QLearning(PROBLEM, n_agents=2, seed=1).learn(300, callbacks=[lambda learner: answer])
    assert learner.episodes == episodes
    assert QLearning(PROBLEM, seed=1).learn(300, callbacks=[Answering()]).episodes == episodes
    assert_same(learner, QLearning(PROBLEM, n_agents=2, seed=1).learn(episodes))


def test_who_comes_after_the_one_that_stops_is_called_too() -> None:
    diary = Diary()
    QLearning(PROBLEM, seed=1).learn(300, callbacks=[lambda learner: False, diary])
    assert diary.calls == [("start", 0), *windows(100), ("end", 100)]


def test_callbacks_may_come_from_a_generator() -> None:
    diary = Diary(2)
    QLearning(PROBLEM, seed=1).learn(2, callbacks=(one for one in [diary]))  # type: ignore[arg-type]
    assert diary.calls == [("start", 0), *windows(2), ("end", 2)]


def test_a_subclass_need_not_call_the_first_init() -> None:
    class Own(Callback):
        def __init__(self) -> None:
            self.seen: list[int] = []

        def on_window(self, learner: Learner) -> None:
            self.seen.append(learner.episodes)

    own = Own()
    QLearning(PROBLEM, seed=1).learn(200, callbacks=[own])
    assert own.seen == [100, 200]


@pytest.mark.parametrize(
    ("callbacks", "message"),
    [
        ([3], "callbacks must be a sequence .* that take the learner; got 3 among them"),
        ([Checkpoint], "callbacks must be .* got <class .*Checkpoint'> among them"),
        ("ab", "callbacks must be .* got 'a' among them"),
        (Callback(), "callbacks must be .* got <.*Callback object.*>: put it into a list"),
        (print, "callbacks must be .* got <built-in function print>: put it into a list"),
    ],
)
def test_other_things_are_no_callbacks(callbacks: Any, message: str) -> None:
    learner = QLearning(PROBLEM, seed=1)
    with pytest.raises(ParameterTypeError, match=message):
        learner.learn(3, callbacks=callbacks)
    assert learner.episodes == 0


@pytest.mark.parametrize(
    ("every", "error", "message"),
    [
        (0, ParameterError, "every must be a whole number of at least 1; got 0"),
        (2.5, ParameterTypeError, "every must be .* got 2.5 of type float"),
    ],
)
def test_every_is_checked(every: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Callback(every)


def test_every_one_hears_of_the_end_whatever_the_others_raise() -> None:
    class Failing(Diary):
        def on_end(self, learner: Learner) -> None:
            super().on_end(learner)
            raise ZeroDivisionError(self.name)

    first, second, third = Failing(name="1"), Diary(), Failing(name="3")
    with pytest.raises(ZeroDivisionError, match="3") as caught:
        QLearning(PROBLEM, seed=1).learn(3, callbacks=[first, second, third])
    assert isinstance(caught.value.__context__, ZeroDivisionError)
    assert [diary.calls[-1][0] for diary in (first, second, third)] == ["1end", "end", "3end"]


def test_an_error_in_on_start_ends_those_that_had_started() -> None:
    class Failing(Diary):
        def on_start(self, learner: Learner) -> None:
            raise ZeroDivisionError

    before, failing, after = Diary(), Failing(), Diary()
    with pytest.raises(ZeroDivisionError):
        QLearning(PROBLEM, seed=1).learn(3, callbacks=[before, failing, after], progress=True)
    assert before.calls == [("start", 0), ("end", 0)]
    assert failing.calls == after.calls == []


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_an_error_in_a_window_leaves_a_learner_that_goes_on(error: type[BaseException]) -> None:
    def fail(learner: Learner) -> None:
        raise error

    diary, learner = Diary(7), QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=STEP)
    with pytest.raises(error):
        learner.learn(30, callbacks=[diary, fail])
    assert diary.calls == [("start", 0), ("end", 5)]
    assert_same(learner.learn(25), QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=STEP).learn(30))


class Interrupted(QLearning):
    """Ctrl-C is pressed while an agent plays up to the end of the first window."""

    pressed_at = 0
    pressed = False

    def algorithm_state(self, declared: Mapping[str, Any], scheduled: FloatArray) -> Any:
        if declared is self.declared[self.pressed_at] and not self.pressed:
            self.pressed = True
            signal.raise_signal(signal.SIGINT)
        return super().algorithm_state(declared, scheduled)


@pytest.mark.parametrize("step", [None, STEP])
def test_the_window_that_ctrl_c_waited_for_is_told(step: TensorStep | None) -> None:
    diary, learner = Diary(5), Interrupted(PROBLEM, seed=1, tensor_step=step)
    with pytest.raises(KeyboardInterrupt):
        learner.learn(20, callbacks=[diary])
    # Ctrl-C waits for the window's tensor step, too.
    assert diary.calls == [("start", 0), *windows(5), ("end", 5)]
    learner.learn(5, callbacks=[diary])
    assert diary.calls[3:] == [("start", 5), *windows(10), ("end", 10)]


def test_a_share_function_that_raises_delays_its_window() -> None:
    failures = [True]

    def fails_once(context: ShareContext) -> int:
        if failures.pop() if failures else False:
            raise ZeroDivisionError
        return 0

    step = TensorStep(every=5, ranks=(2, 2, 2, 1), share=fails_once)
    diary, learner = Diary(), QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=step)
    with pytest.raises(ZeroDivisionError):
        learner.learn(9, callbacks=[diary])
    assert learner.is_saveable
    assert not learner.in_sync
    learner.learn(2, callbacks=[diary])
    assert diary.calls == [("start", 0), ("end", 5), ("start", 5), *windows(5), ("end", 7)]


def test_after_an_episode_that_broke_off_nobody_is_told_before_the_next_whole_one() -> None:
    maker = countings()

    def broken() -> Any:
        env = maker()
        step = env.step

        def failing(action: int) -> Any:
            if env.episode == 6:
                raise ZeroDivisionError
            return step(action)

        env.step = failing  # type: ignore[method-assign]
        return env

    diary, learner = Diary(2), QLearning(broken, seed=1)
    with pytest.raises(EnvironmentFaultError):
        learner.learn(9, callbacks=[diary])
    assert diary.calls == [("start", 0), *windows(2, 4, 6), ("end", 6)]
    assert learner.is_saveable, "what was broken off is undone"
    learner.learn(2, callbacks=[diary])
    assert diary.calls[5:] == [("start", 6), *windows(8), ("end", 8)]


def test_tables_that_are_not_finite_are_shown_to_nobody() -> None:
    diary = Diary(1)
    problem = corridor(3, reward=1e307)
    with pytest.warns(DivergenceWarning):
        learner = QLearning(problem, alpha=1.0, gamma=1.0, epsilon=1.0, seed=1).learn(50, callbacks=[diary])
    assert learner.diverged_at == 3
    assert diary.calls == [("start", 0), *windows(1, 2, 3), ("end", 3)]


@pytest.mark.parametrize("n_agents", [1, 3])
def test_steps_are_learned_with_callbacks_as_without(n_agents: int) -> None:
    diary = Diary(7)
    learner = QLearning(PROBLEM, n_agents=n_agents, seed=1).learn(steps=900, callbacks=[diary])
    assert_same(learner, QLearning(PROBLEM, n_agents=n_agents, seed=1).learn(steps=900))
    n = learner.episodes
    assert diary.calls == [("start", 0), *windows(*range(7, n + 1, 7)), ("end", n)]


@pytest.mark.parametrize("step", [None, TensorStep(every=5, ranks=(4, 2, 3, 1))])
@pytest.mark.parametrize("learner", LEARNERS)
def test_learning_takes_no_notice(learner: type[Learner], step: TensorStep | None, tmp_path: Path) -> None:
    callbacks: list[Any] = [
        StopOnReturn(1e9, every=3),
        Checkpoint(tmp_path / "learner", every=3),
        Evaluate(4, every=4, best=tmp_path / "best"),
        CsvLog(tmp_path / "log.csv"),
        JsonLinesLog(tmp_path / "log.jsonl", every=7),
        lambda learner: learner.predict(0),
    ]
    alone = make(learner, step, 2).learn(23)
    assert_same(make(learner, step, 2).learn(23, callbacks=callbacks), alone)


def test_a_progress_bar_needs_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    QLearning(PROBLEM, seed=1).learn(30, progress=True)
    QLearning(PROBLEM, seed=1).learn(steps=30, progress=True, callbacks=[Diary(2)])
    assert capfd.readouterr() == ("", "")
