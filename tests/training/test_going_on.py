"""What was broken off has never been: going on gives the bits of a run that never stopped."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.adapters.parallel_worlds import Leaving, altered
from tests.learners.stepped_worlds import TableEnv
from tests.learners.worlds import random_mdp
from tests.training.test_python_calls import Fails, NoRoadError, Studies
from tests.training.test_resume import assert_same
from tuckerl import Checkpoint, DynaH, QLearning, Sarsa, SarsaLambda, Simulator, TabularMDP, TeamQ, TensorStep
from tuckerl.errors import EnvironmentFaultError, OutputError, SimulatorError
from tuckerl.training.learner import Learner

MDP = random_mdp(5, n_states=6, limit=12, ends=0.05)
STEP = TensorStep(every=4, ranks=(3, 2, 2, 2), floor=0.1)
LEARNERS: dict[str, tuple[Any, dict[str, Any]]] = {
    "q-learning": (QLearning, {}),
    "sarsa": (Sarsa, {}),
    "sarsa-lambda": (SarsaLambda, {}),
    "carried": (SarsaLambda, {"carry_trace": True}),
    "dyna-h": (DynaH, {"heuristic": np.arange(6.0)}),
    "team-q": (TeamQ, {"carry_trace": True}),
}
PARAMETERS: dict[str, Any] = {"seed": 3, "epsilon": 0.4, "alpha": 0.3, "initial_q": 0.5}

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")


class Interrupts:
    """Does something at some calls, counted from 1 over all that share it; None does nothing."""

    def __init__(self, does: Callable[[], object] | None, *places: int) -> None:
        self._does, self._places, self._n_calls = does, places, 0

    def __call__(self) -> None:
        self._n_calls += 1
        if self._does is not None and self._n_calls in self._places:
            self._does()


def fail() -> None:
    raise ConnectionError("lost")


def press_twice() -> None:
    signal.raise_signal(signal.SIGINT)
    signal.raise_signal(signal.SIGINT)


class Disturbed(TableEnv):
    """A table with a generator that is seeded once, as Gymnasium's environments have it."""

    _np_random: np.random.Generator

    def __init__(self, disturb: Interrupts, mdp: TabularMDP = MDP) -> None:
        super().__init__(mdp)
        self.disturb = disturb

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        if seed is not None:
            self._np_random = np.random.default_rng(seed)
        self.words[:] = self._np_random.integers(1, 2**63, 4, dtype=np.uint64)
        return super().reset()

    def step(self, action: int) -> Any:
        self._np_random.random()
        self.disturb()
        return super().step(action)


def learned(learner: Any, episodes: int, path: Path | None = None, env: Any = None) -> tuple[Any, int]:
    """Learn so many episodes, whatever comes between; return the learner, perhaps out of a file, and how often."""
    n_stops = 0
    while learner.episodes < episodes or not learner.in_sync:
        try:
            learner.learn(max(episodes - learner.episodes, 1))
        except (EnvironmentFaultError, KeyboardInterrupt, NoRoadError):
            n_stops += 1
            if path is not None:
                learner.save(path)
                learner = type(learner).load(path, env=env)
    return learner, n_stops


def assert_all_same(one: Learner, other: Learner, folder: Path) -> None:
    assert_same(one, other)
    one.save(folder / "one")
    other.save(folder / "other")
    assert (folder / "one").read_bytes() == (folder / "other").read_bytes()


@pytest.mark.parametrize("does", [fail, press_twice])
@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("name", LEARNERS)
def test_an_environment_that_is_disturbed(name: str, step: TensorStep | None, does: Any, tmp_path: Path) -> None:
    kind, own = LEARNERS[name]

    def make(does: Any) -> tuple[Any, Callable[[], Disturbed]]:
        disturb = Interrupts(does, 1, 7, 8, 40, 77, 78, 90, 133, 160, 190)

        def env() -> Disturbed:
            return Disturbed(disturb)

        return kind(env, n_agents=2, tensor_step=step, **PARAMETERS, **own), env

    whole = make(None)[0].learn(18)
    for path in (None, tmp_path / "agent"):
        learner, env = make(does)
        learner, n_stops = learned(learner, 18, path, env)
        assert n_stops >= 8
        if path is None:
            assert_all_same(learner, whole, tmp_path)
        else:
            assert_same(learner, whole)


@pytest.mark.parametrize("name", ["q-learning", "carried", "dyna-h"])
def test_masks_that_were_seen_are_forgotten(name: str, tmp_path: Path) -> None:
    class Masked(Disturbed):
        """Gives other masks as time goes by."""

        def _info(self) -> dict[str, Any]:
            mask = np.ones(3, dtype=np.int8)
            mask[int(self.words[3] % 3)] = 0
            return {"action_mask": mask}

    kind, own = LEARNERS[name]
    whole = kind(Masked(Interrupts(None)), **PARAMETERS, **own).learn(20)
    learner, n_stops = learned(kind(Masked(Interrupts(fail, 3, 30, 31, 60)), **PARAMETERS, **own), 20)
    assert n_stops == 4
    np.testing.assert_array_equal(learner.action_mask, whole.action_mask)
    assert_all_same(learner, whole, tmp_path)


@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("name", ["q-learning", "carried"])
def test_agents_in_one_world(name: str, step: TensorStep | None, tmp_path: Path) -> None:
    def world(disturb: Interrupts) -> Any:
        env = Leaving()
        act = env.act

        def disturbed(actions: Any) -> Any:
            disturb()
            return act(actions)

        return altered(env, act=disturbed)

    kind, own = LEARNERS[name]
    whole = kind(world(Interrupts(None)), tensor_step=step, **PARAMETERS, **own).learn(13)
    learner, n_stops = learned(
        kind(world(Interrupts(fail, 1, 6, 7, 17, 24)), tensor_step=step, **PARAMETERS, **own), 13
    )
    assert n_stops == 5
    assert_all_same(learner, whole, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("in_update", [False, True])
@pytest.mark.parametrize("stepped", [False, True])
def test_a_python_function_of_the_algorithm(stepped: bool, in_update: bool, tmp_path: Path) -> None:
    def make(*places: int) -> Any:
        env = TableEnv(MDP) if stepped else MDP
        return Studies(env, function=Fails(*places), in_update=in_update, n_agents=2, tensor_step=STEP, seed=1)

    whole = make().learn(9)
    learner, n_stops = learned(make(1, 4, 5, 9, 13), 9)
    assert n_stops == 5
    np.testing.assert_array_equal(learner.q, whole.q)
    np.testing.assert_array_equal(learner.steps, whole.steps)
    assert learner.kept("answers") == whole.kept("answers")
    assert learner.kept("ended") == [[9, 0]] * 2, "an episode that is broken off has never been"


def _reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def _pays_too_much(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] += 1.0
    state[1] += 1.0  # steps over all episodes
    return (np.nan if state[1] == parameters[0] else 1.0 * action), state[0] > 5.0


def _index(parameters: Any, state: Any) -> int:
    return int(state[0]) % 3


@pytest.mark.slow
@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("name", ["q-learning", "sarsa", "sarsa-lambda", "carried"])
def test_a_simulator_that_fails_leaves_the_episodes_before(name: str, step: TensorStep | None) -> None:
    def world(place: int) -> Simulator:
        return Simulator(*(_reset, _pays_too_much, _index), n_states=3, n_actions=2, state_size=2, parameters=[place])

    kind, own = LEARNERS[name]
    learner = kind(world(6 * 7 + 3), tensor_step=step, **PARAMETERS, **own)
    for _ in range(3):
        with pytest.raises(SimulatorError, match="after step 3 of an episode"):
            learner.learn(9)
        assert learner.episodes == 7
        assert_same(learner, kind(world(10**6), tensor_step=step, **PARAMETERS, **own).learn(7))


def test_a_disk_that_is_full_while_a_callback_saves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learner, path = QLearning(MDP, tensor_step=STEP, **PARAMETERS), tmp_path / "agent"
    learner.learn(8, callbacks=[Checkpoint(path)])
    before = path.read_bytes()
    with monkeypatch.context() as context:
        context.setattr("os.replace", _no_space)
        context.setattr("os.fsync", _no_space)
        with pytest.raises(OutputError):
            learner.learn(20, callbacks=[Checkpoint(path)])
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["agent"], "nothing half-written is left"
    learner.learn(20 - learner.episodes)
    assert_same(learner, QLearning(MDP, tensor_step=STEP, **PARAMETERS).learn(20))
    assert_same(QLearning.load(path).learn(12), learner)


def _no_space(*arguments: Any, **keywords: Any) -> Iterator[None]:
    raise OSError(28, "No space left on device")
