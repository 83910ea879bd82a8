"""Callbacks that stop, save and evaluate: by numbers worked out by hand, and to the last bit through files."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, random_mdp
from tests.training.counting import countings
from tests.training.test_callbacks import Diary, Interrupted
from tests.training.test_resume import LEARNERS, assert_same, make
from tuckerl import Callback, Checkpoint, Evaluate, QLearning, Sarsa, SarsaLambda, StopOnReturn, TensorStep
from tuckerl.errors import DivergenceWarning, EnvironmentFaultError, OutputError, ParameterError, ParameterTypeError
from tuckerl.generalization.sharing import ShareContext
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(61, n_outcomes=2)
STEP = TensorStep(every=5, ranks=(2, 2, 2, 1), floor=0.1)


# The returns of two agents in episode e are e and e + 10: after n episodes, the mean of the latest k is
# n - (k + 1) / 2 + 5.
@pytest.mark.parametrize(
    ("threshold", "episodes", "every", "stop"),
    [
        (12.0, 5, 1, 10),  # 10 - 3 + 5 = 12: reached by equality
        (12.1, 5, 1, 11),
        (12.0, 5, 4, 12),  # asked at 4, 8, 12
        (-9.0, 5, 1, 5),  # not before there are five
        (-9.0, 7, 5, 10),
        (1e9, 5, 1, 30),
        (12.0, 1, None, 30),  # the default window is a hundred
    ],
)
def test_it_stops_on_the_mean_return(threshold: float, episodes: int, every: int | None, stop: int) -> None:
    learner = QLearning(countings(), n_agents=2, seed=1)
    learner.learn(30, callbacks=[StopOnReturn(threshold, episodes=episodes, every=every)])
    assert learner.episodes == stop
    np.testing.assert_array_equal(learner.returns[:, 0], np.arange(stop))
    np.testing.assert_array_equal(learner.returns[:, 1], np.arange(stop) + 10)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"threshold": "high"}, ParameterTypeError, "threshold must be a finite number; got 'high' of type str"),
        ({"threshold": float("nan")}, ParameterError, "threshold must be a finite number; got nan"),
        ({"threshold": 1, "episodes": 0}, ParameterError, "episodes must be a whole number of at least 1; got 0"),
        ({"threshold": 1, "every": 0}, ParameterError, "every must be a whole number of at least 1; got 0"),
    ],
)
def test_thresholds_are_checked(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        StopOnReturn(**parameters)


@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("learner", LEARNERS)
def test_a_checkpoint_in_a_half_filled_window_goes_on_to_the_last_bit(
    learner: type[Learner], step: TensorStep | None, n_agents: int, tmp_path: Path
) -> None:
    make(learner, step, n_agents).learn(11, callbacks=[Checkpoint(tmp_path / "at{episode}", every=3)])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["at11", "at3", "at6", "at9"]
    whole = make(learner, step, n_agents).learn(20)
    for episode in (3, 6, 9, 11):
        again = learner.load(tmp_path / f"at{episode}")
        assert again.episodes == episode
        assert_same(again.learn(20 - episode, callbacks=[Checkpoint(tmp_path / "other", every=4)]), whole)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("learner", "env"), [(QLearning, "Blackjack-v1"), (SarsaLambda, "Taxi-v4"), (Sarsa, "Blackjack-v1")]
)
def test_checkpoints_of_python_environments_go_on_to_the_last_bit(learner: Any, env: str, tmp_path: Path) -> None:
    def fresh() -> Learner:
        fresh: Learner = learner(env, compiled=False, n_agents=2, epsilon=0.3, seed=3, tensor_step=STEP)
        return fresh

    fresh().learn(14, callbacks=[Checkpoint(tmp_path / "at{episode}", every=3)])
    whole = fresh().learn(17)
    for episode in (3, 9, 12, 14):
        assert_same(learner.load(tmp_path / f"at{episode}").learn(17 - episode), whole)


def test_the_newest_takes_the_place_of_the_one_before(tmp_path: Path) -> None:
    seen: list[tuple[int, int, list[str]]] = []

    def look(learner: Learner) -> None:
        names = [path.name for path in tmp_path.iterdir()]
        seen.append((learner.episodes, QLearning.load(tmp_path / "agent").episodes, names))

    QLearning(PROBLEM, seed=1, tensor_step=STEP).learn(12, callbacks=[Checkpoint(tmp_path / "agent"), look])
    assert seen == [(5, 5, ["agent"]), (10, 10, ["agent"])]
    assert QLearning.load(tmp_path / "agent").episodes == 12


def test_nothing_is_saved_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    saved: list[int] = []
    monkeypatch.setattr(QLearning, "save", lambda self, path: saved.append(self.episodes))
    checkpoint, learner = Checkpoint(tmp_path / "agent", every=4), QLearning(PROBLEM, seed=1)
    learner.learn(8, callbacks=[checkpoint])
    assert saved == [4, 8]
    learner.learn(1, callbacks=[checkpoint])
    assert saved == [4, 8, 9]


@pytest.mark.parametrize("agent", [0, 1])
@pytest.mark.parametrize("step", [None, STEP])
def test_after_ctrl_c_everything_is_saved(step: TensorStep | None, agent: int, tmp_path: Path) -> None:
    class Pressed(Interrupted):
        pass

    Pressed.pressed_at = agent
    with pytest.raises(KeyboardInterrupt):
        Pressed(PROBLEM, n_agents=3, seed=2, tensor_step=step).learn(
            50, callbacks=[Checkpoint(tmp_path / "a", every=7)]
        )
    Pressed.pressed = True
    again = Pressed.load(tmp_path / "a")
    assert 0 < again.episodes < 50
    assert_same(again.learn(50 - again.episodes), Pressed(PROBLEM, n_agents=3, seed=2, tensor_step=step).learn(50))


def test_before_a_tensor_step_that_raises_everything_is_saved(tmp_path: Path) -> None:
    fails = [True]

    def fails_once(context: ShareContext) -> int:
        if fails and fails.pop():
            raise ZeroDivisionError
        return int(np.argmax(context.agent_norms))

    step = TensorStep(every=5, ranks=(2, 2, 2, 1), share=fails_once)
    with pytest.raises(ZeroDivisionError):
        QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=step).learn(9, callbacks=[Checkpoint(tmp_path / "a")])
    diary, again = Diary(), QLearning.load(tmp_path / "a", tensor_step=step)
    again.learn(4, callbacks=[diary])
    assert diary.calls == [("start", 5), ("window", 5), ("end", 9)]
    assert_same(again, QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=step).learn(9))


def test_after_an_episode_that_broke_off_the_file_holds_those_before_it(tmp_path: Path) -> None:
    maker = countings()

    def broken() -> Any:
        env = maker()
        step = env.step

        def failing(action: int) -> Any:
            if env.episode == 7 and env.left == 1:
                raise ZeroDivisionError
            return step(action)

        env.step = failing  # type: ignore[method-assign]
        return env

    learner = QLearning(broken, seed=1)
    with pytest.raises(EnvironmentFaultError):
        learner.learn(9, callbacks=[Checkpoint(tmp_path / "a", every=3)])
    assert QLearning.load(tmp_path / "a", env=countings()).episodes == learner.episodes == 7


def test_tables_that_are_not_finite_are_not_saved(tmp_path: Path) -> None:
    problem = corridor(3, reward=1e307)
    learner = QLearning(problem, alpha=1.0, gamma=1.0, epsilon=1.0, seed=1)
    with pytest.warns(DivergenceWarning):
        learner.learn(50, callbacks=[Checkpoint(tmp_path / "a", every=2)])
    assert not learner.is_saveable
    again = QLearning.load(tmp_path / "a")
    assert learner.episodes == learner.diverged_at == 3
    assert again.episodes == 2
    assert np.isfinite(again.q).all()
    assert again.diverged_at is None


@pytest.mark.parametrize("make_callback", [Checkpoint, lambda path: Evaluate(best=path)])
def test_a_missing_folder_is_found_before_anything_is_learned(make_callback: Any, tmp_path: Path) -> None:
    learner = QLearning(PROBLEM, seed=1)
    with pytest.raises(OutputError, match=r"cannot write .*nowhere/a: there is no folder .*nowhere; make it first"):
        learner.learn(300, callbacks=[make_callback(tmp_path / "nowhere" / "a")])
    assert learner.episodes == 0


KILLED = """
import sys
import tuckerl
step = tuckerl.TensorStep(every=5, ranks=(2, 2, 2, 1), floor=0.1)
agent = getattr(tuckerl, sys.argv[1])(sys.argv[2], compiled=False, n_agents=2, epsilon=0.3, seed=3, tensor_step=step)
agent.learn(10**7, callbacks=[tuckerl.Checkpoint(sys.argv[3], every=3)])
"""


@pytest.mark.slow
@pytest.mark.parametrize(("learner", "env"), [(QLearning, "Blackjack-v1"), (SarsaLambda, "Taxi-v4")])
def test_what_is_left_after_a_kill_goes_on_to_the_last_bit(learner: Any, env: str, tmp_path: Path) -> None:
    path = tmp_path / "agent"
    command = [sys.executable, "-W", "ignore", "-c", KILLED, learner.__name__, env, str(path)]
    process = subprocess.Popen(command)
    try:
        while not path.exists():
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(random.random() * 0.3)  # noqa: S311  # any moment will do, and another one every time
    finally:
        os.kill(process.pid, signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
    again = learner.load(path)
    assert again.episodes % 3 == 0
    more = 7
    whole = learner(env, compiled=False, n_agents=2, epsilon=0.3, seed=3, tensor_step=STEP)
    assert_same(again.learn(more), whole.learn(again.episodes))


def test_evaluations_are_those_of_evaluate() -> None:
    evaluate = Evaluate(7, every=4, seed=5)
    QLearning(PROBLEM, n_agents=2, seed=1).learn(9, callbacks=[evaluate])
    assert [entry.episode for entry in evaluate.history] == [4, 8]
    for episode, mean, low, high in evaluate.history:
        result = QLearning(PROBLEM, n_agents=2, seed=1).learn(episode).evaluate(7, seed=5)
        assert (mean, low, high) == (result.mean, result.low, result.high)
    default = Evaluate(7, every=4)
    learner = QLearning(PROBLEM, n_agents=2, seed=1).learn(4, callbacks=[default])
    assert default.history[0].mean == learner.evaluate(7).mean != evaluate.history[0].mean
    learner.learn(4, callbacks=[default])
    assert [entry.episode for entry in default.history] == [4, 8]


class Playing(Callback):
    """Puts tables in the learner's place: one that goes right in the corridor, or one that goes left."""

    def __init__(self, right: dict[int, bool]) -> None:
        super().__init__(1)
        self.right = right

    def on_window(self, learner: Learner) -> None:
        learner._state.q[...] = [0.0, 1.0] if self.right[learner.episodes] else [1.0, 0.0]


def test_the_best_is_kept(tmp_path: Path) -> None:
    right = {1: False, 2: True, 3: True, 4: False}
    evaluate = Evaluate(2, every=1, best=tmp_path / "best")
    learner = QLearning(corridor(), seed=1)
    learner.learn(4, callbacks=[Playing(right), evaluate])
    # From 0 to the end and out takes 5 steps of -1 each; going left takes the limit of 100.
    assert evaluate.history == [(1, -100, -100, -100), (2, -5, -5, -5), (3, -5, -5, -5), (4, -100, -100, -100)]
    assert QLearning.load(tmp_path / "best").episodes == 2


@pytest.mark.parametrize(("seed", "episodes", "kept"), [(1, 4, True), (2, 4, False), (1, 1, False)])
def test_the_best_of_the_same_run_still_counts(seed: int, episodes: int, kept: bool, tmp_path: Path) -> None:
    path = tmp_path / "best"
    before = QLearning(corridor(), seed=1)
    before.learn(3, callbacks=[Playing({1: False, 2: False, 3: True}), Evaluate(2, every=1, best=path)])
    assert QLearning.load(path).episodes == 3
    # Another seed, or fewer episodes, is another run.
    learner = QLearning(corridor(), seed=seed).learn(episodes)
    n = episodes + 1
    learner.learn(1, callbacks=[Playing({n: False}), Evaluate(2, every=1, best=path)])
    assert QLearning.load(path).episodes == (3 if kept else n)


@pytest.mark.parametrize("content", [b"", b"something else"])
def test_another_file_is_no_rival(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "best"
    path.write_bytes(content)
    QLearning(corridor(), seed=1).learn(1, callbacks=[Evaluate(2, every=1, best=path)])
    assert QLearning.load(path).episodes == 1


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"episodes": 0}, ParameterError, "episodes must be a whole number of at least 1; got 0"),
        ({"seed": -1}, ParameterError, "seed must be a whole number of at least 0; got -1"),
        ({"seed": "x"}, ParameterTypeError, "seed must be .* got 'x'"),
    ],
)
def test_evaluations_are_checked(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Evaluate(**parameters)
