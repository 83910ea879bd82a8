"""One learner is one thread's at a time; two learners are not in each other's way, also where they share a problem."""

import copy
import pickle
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from numba.core import config as numba_config
from threadpoolctl import threadpool_info

from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import DynaH, QLearning, TensorStep, _kernel_cache
from tuckerl.errors import LONGEST_MESSAGE, EnvironmentFaultError, LearnerInUseError
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(43, limit=20)
STEP = TensorStep(every=5, ranks=(2, 2, 2, 1))

pytestmark = [pytest.mark.filterwarnings(f"ignore::tuckerl.errors.{kind}Warning") for kind in ("Rank", "ZeroWeight")]


def make(seed: int = 0) -> QLearning:
    return QLearning(PROBLEM, alpha=0.3, epsilon=0.4, seed=seed, n_agents=2, tensor_step=STEP)


USES: dict[str, Callable[[Learner, Path], object]] = {
    "learn()": lambda learner, path: learner.learn(5),
    "restore()": lambda learner, path: learner.restore(None),  # type: ignore[arg-type]  # it is not looked at
    "save()": lambda learner, path: learner.save(path / "agent"),
    "evaluate()": lambda learner, path: learner.evaluate(5),
    "QLearning.alpha = ...": lambda learner, path: setattr(learner, "alpha", 0.3),
    "copy.deepcopy()": lambda learner, path: copy.deepcopy(learner),
    "predict()": lambda learner, path: learner.predict(0),
}


@pytest.mark.parametrize("use", USES)
def test_a_second_thread_is_refused(use: str, tmp_path: Path) -> None:
    learner, other = make(), make().learn(20)
    begun, done = threading.Event(), threading.Event()

    def wait(learner: Learner) -> None:
        begun.set()
        assert done.wait(60)

    thread = threading.Thread(target=lambda: learner.learn(20, callbacks=[wait]), name="first")
    thread.start()
    try:
        assert begun.wait(60)
        with pytest.raises(LearnerInUseError) as refused:
            USES[use](learner, tmp_path)
        assert f"{use} was called in thread 'MainThread' while learn() of the same learner was" in str(refused.value)
        assert "in thread 'first'" in str(refused.value)
        assert len(str(refused.value)) <= 600
        assert (learner.episodes, len(learner.returns), learner.alpha) == (5, 5, 0.3)  # what only looks, may
    finally:
        done.set()
        thread.join()
    assert_same(learner, other)
    USES["save()"](learner, tmp_path)  # nothing stays behind


class Waiting(QLearning):
    """A learner whose constructor waits where it runs again."""

    def __init__(self, env: Any, *, wait: Callable[[], object] = lambda: None, **parameters: Any) -> None:
        self.wait = wait
        super().__init__(env, **parameters)
        wait()


def test_what_a_thread_is_changing_no_other_sets() -> None:
    learner = Waiting(PROBLEM, alpha=0.3, seed=0)
    begun, done = threading.Event(), threading.Event()

    def wait() -> None:
        begun.set()
        assert done.wait(60)

    thread = threading.Thread(target=lambda: setattr(learner, "wait", wait), name="first")
    thread.start()
    try:
        assert begun.wait(60)
        with pytest.raises(
            LearnerInUseError, match=r"Waiting.alpha = ... was called in thread 'MainThread' while Wait"
        ):
            learner.alpha = 0.1
    finally:
        done.set()
        thread.join()
    assert learner.alpha == learner.parameters["alpha"] == 0.3
    learner.alpha = 0.2
    assert learner.alpha == 0.2


@pytest.mark.parametrize("use", USES)
def test_callbacks_may_look_and_change_but_not_learn(use: str, tmp_path: Path) -> None:
    learner, refused = make(), []

    def call(learner: Learner) -> None:
        try:
            USES[use](learner, tmp_path)
        except LearnerInUseError as error:
            refused.append(str(error))

    learner.learn(10, callbacks=[call])
    if use in ("learn()", "restore()"):
        said = f"{use} was called from inside of learn() of the same learner: call it when that has returned"
        assert refused == [said] * 2
    else:
        assert not refused
    assert_same(learner, make().learn(10))


class Meddling(gymnasium.Env[Any, Any]):
    """An environment that does something with the learner in the middle of an episode."""

    observation_space, action_space = gymnasium.spaces.Discrete(2), gymnasium.spaces.Discrete(2)

    def __init__(self) -> None:
        self.meddle: Callable[[], object] = lambda: None

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.meddle()
        return 1, 1.0, True, False, {}


@pytest.mark.parametrize("use", USES)
def test_the_middle_of_an_episode_is_no_place_for_it(use: str, tmp_path: Path) -> None:
    env = Meddling()
    learner = QLearning(env, seed=0)
    env.meddle = lambda: USES[use](learner, tmp_path)
    if use == "predict()":  # an opponent that plays as the learner does
        learner.learn(3)
        return
    with pytest.raises(EnvironmentFaultError, match=r"failed \(LearnerInUseError: .* call it") as broken:
        learner.learn(3)
    assert isinstance(broken.value.__cause__, LearnerInUseError)
    assert not list(tmp_path.iterdir())


def side_by_side(*learn: Callable[[], object]) -> None:
    """Call all functions at once, each in its own thread, and raise what one of them raised."""
    errors: list[BaseException] = []
    barrier = threading.Barrier(len(learn))

    def run(function: Callable[[], object]) -> None:
        try:
            barrier.wait()
            function()
        except BaseException as error:  # noqa: BLE001  # raised again below
            errors.append(error)

    threads = [threading.Thread(target=run, args=(function,)) for function in learn]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def test_learners_that_share_a_problem_learn_side_by_side() -> None:
    make().learn(10)  # which loads the libraries
    before = [library["num_threads"] for library in threadpool_info()]
    learners = [make(seed) for seed in range(4)]
    side_by_side(*(lambda one=one: one.learn(100) for one in learners))
    for seed, learner in enumerate(learners):
        assert_same(learner, make(seed).learn(100))
    assert [library["num_threads"] for library in threadpool_info()] == before


def test_simulators_are_compiled_side_by_side() -> None:
    config: Any = numba_config
    before = config.CACHE_DIR

    def enter() -> None:
        for _ in range(50):
            _kernel_cache.kept_code(make)

    side_by_side(*[enter] * 4)
    assert before == config.CACHE_DIR


def test_learners_in_python_learn_side_by_side() -> None:
    def lake(seed: int) -> Any:
        return QLearning("FrozenLake-v1", compiled=False, n_agents=2, seed=seed)

    learners = [lake(seed) for seed in range(3)]
    side_by_side(*(lambda one=one: one.learn(30) for one in learners))
    for seed, learner in enumerate(learners):
        assert_same(learner, lake(seed).learn(30))


def test_threads_that_share_a_learner_lose_nothing() -> None:
    learner, learned = make(), []

    def learn_often() -> None:
        for _ in range(20):
            try:
                learner.learn(7)
            except LearnerInUseError:
                continue
            learned.append(7)

    side_by_side(*[learn_often] * 4)
    assert learner.episodes == sum(learned) > 0
    assert_same(learner, make().learn(learner.episodes))


def use_at_once(n_threads: int, n_uses: int, seed: int, folder: Path) -> tuple[int, int]:
    """Let threads use one learner in all ways at once; return how many uses were right, and how many were refused."""
    learner, learned = make(), []
    done, refused = [0] * n_threads, list[str]()
    uses = sorted(USES.keys() - {"restore()"})

    def use_often(thread: int) -> None:
        rng, own = np.random.default_rng((seed, thread)), folder / str(thread)
        own.mkdir()
        for _ in range(n_uses):
            use = uses[int(rng.integers(len(uses)))]
            try:
                result = USES[use](learner, own)
            except LearnerInUseError as error:
                refused.append(str(error))
                continue
            done[thread] += 1
            learned.extend([5] * (use == "learn()"))
            kept = QLearning.load(own / "agent") if use == "save()" else result
            if isinstance(kept, QLearning) and kept is not learner:
                assert_same(kept, make().learn(kept.episodes) if kept.episodes else make())

    side_by_side(*(lambda thread=thread: use_often(thread) for thread in range(n_threads)))
    assert learner.episodes == sum(learned)
    assert_same(learner, make().learn(learner.episodes))
    assert all(len(message) <= LONGEST_MESSAGE for message in refused)
    return sum(done), len(refused)


def test_threads_that_use_a_learner_at_once_are_right_or_refused(tmp_path: Path) -> None:
    done, refused = use_at_once(3, 12, 1, tmp_path)
    assert done > 0
    assert refused > 0


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_threads_that_use_a_learner_at_once_for_long_are_right_or_refused(seed: int, tmp_path: Path) -> None:
    done, refused = use_at_once(6, 200, 100 + seed, tmp_path)
    assert done > 0
    assert refused > 0


def test_predictions_may_be_asked_for_by_many_threads() -> None:
    learner = DynaH(PROBLEM, heuristic=np.zeros(PROBLEM.n_states), seed=0).learn(20)
    states = np.arange(PROBLEM.n_states)
    expected = learner.predict(states)[0]

    def ask() -> None:
        for _ in range(200):
            np.testing.assert_array_equal(learner.predict(states)[0], expected)

    side_by_side(*[ask] * 4)
    assert pickle.loads(pickle.dumps(learner)).episodes == 20  # noqa: S301  # our own
