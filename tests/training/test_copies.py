"""Copies of a learner go on as it would, to the last bit, or say what to do instead."""

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import tuckerl
from tests.learners.worlds import drift, random_mdp
from tests.training.test_resume import LEARNERS, assert_same, make
from tuckerl import DynaH, EpsilonGreedy, QLearning, SarsaLambda, TeamQ, TensorStep
from tuckerl.errors import LearnerError, ParameterError, ProblemError
from tuckerl.training.learner import Learner

STEP = TensorStep(every=4, ranks=(4, 2, 3, 1))

pytestmark = [pytest.mark.filterwarnings(f"ignore::tuckerl.errors.{kind}Warning") for kind in ("Rank", "ZeroWeight")]


def pickled(learner: Learner) -> Any:
    return pickle.loads(pickle.dumps(learner))  # noqa: S301  # our own


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, pickled])
@pytest.mark.parametrize("learner", LEARNERS)
def test_a_copy_goes_on_as_the_learner_does(learner: type[Learner], copied: Any) -> None:
    original = make(learner, STEP, 2).learn(6)
    original.alpha = 0.2
    states = np.arange(9)
    original.predict(states, deterministic=False)  # so that what predictions draw from does not stand at its beginning
    one = copied(original)
    assert one is not original
    whole = copied(original).learn(10)
    assert_same(original.learn(10), whole)
    assert_same(one.learn(10), whole)
    np.testing.assert_array_equal(one.scheduled("alpha"), [0.3] * 6 + [0.2] * 10)
    # What predictions draw from goes on, too.
    drawn = [held.predict(states, deterministic=False)[0] for held in (one, original)]
    np.testing.assert_array_equal(*drawn)


class Wandering(gymnasium.Env[Any, Any]):
    """An environment that draws from a generator of its own, of which Gymnasium knows nothing."""

    observation_space, action_space = gymnasium.spaces.Discrete(5), gymnasium.spaces.Discrete(2)

    def __init__(self) -> None:
        self.own, self.at = np.random.default_rng(1), 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.at = int(self.own.integers(5))
        return self.at, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.at = int(self.own.integers(5))
        return self.at, float(self.at * action), self.at == 0, False, {}


def test_an_environment_is_copied_with_all_that_it_remembers() -> None:
    original = QLearning(Wandering, n_agents=2, seed=0).learn(7)
    one = copy.deepcopy(original)
    assert_same(one.learn(8), original.learn(8))
    with pytest.raises(
        LearnerError, match=r"cannot be pickled.* use save\(path\), and QLearning.load\(path, env=\.\.\.\)"
    ):
        pickle.dumps(original)


@pytest.mark.parametrize("env", ["FrozenLake-v1", "tuckerl/RobotRescue-v0"])
def test_environments_by_id_are_copied_and_pickled(env: str) -> None:
    original = QLearning(env, compiled=False, seed=0).learn(3)
    one, other = copy.deepcopy(original), pickled(original)
    assert_same(one.learn(4), original.learn(4))
    assert_same(other.learn(4), original)


def test_teams_in_python_are_copied() -> None:
    team = TeamQ("tuckerl/RobotRescue-v0", compiled=False, team_reward="sum", seed=0).learn(2)
    assert_same(copy.deepcopy(team).learn(2), team.learn(2))


class Pinned(Wandering):
    """An environment that cannot be copied."""

    def __deepcopy__(self, memo: Any) -> Any:
        raise OSError("it holds a window")


def test_what_cannot_be_copied_says_what_to_do() -> None:
    original = QLearning(Pinned(), seed=0).learn(2)
    with pytest.raises(
        ProblemError, match=r"cannot be copied \(OSError: it holds a window\): use the learner's save\(\)"
    ):
        copy.deepcopy(original)
    original.learn(1)


def test_simulators_are_shared_and_not_pickled() -> None:
    original = SarsaLambda(drift(), seed=1).learn(4)
    one = copy.deepcopy(original)
    assert one.problem is original.problem
    assert_same(one.learn(4), original.learn(4))
    with pytest.raises(LearnerError, match="an environment or a simulator of the user's own cannot be pickled"):
        pickle.dumps(original)


def test_functions_are_shared_and_not_pickled() -> None:
    step = TensorStep(every=4, ranks=(2, 2, 2, 1), share=lambda context: 0)
    original = QLearning(random_mdp(3), n_agents=2, tensor_step=step, seed=1).learn(6)
    assert_same(copy.deepcopy(original).learn(6), original.learn(6))
    with pytest.raises(LearnerError, match=r"a tensor step with functions.*load\(path, tensor_step=\.\.\.\)"):
        pickle.dumps(original)


class Shy(EpsilonGreedy):
    """A policy of a user's own."""


def test_policies_of_ones_own_are_shared_and_not_pickled() -> None:
    original = QLearning(random_mdp(3), policy=Shy(0.5), seed=1).learn(6)
    assert_same(copy.deepcopy(original).learn(6), original.learn(6))
    with pytest.raises(ParameterError, match="only tuckerl's own policies can be saved"):
        pickle.dumps(original)


def test_copies_are_independent() -> None:
    original = DynaH(tuckerl.sutton_maze(), seed=0).learn(3)
    before = original.q
    copy.deepcopy(original).learn(5)
    np.testing.assert_array_equal(original.q, before)
    assert original.episodes == 3


def test_a_callback_may_keep_copies() -> None:
    kept: list[Learner] = []
    learner = make(QLearning, STEP, 2).learn(8, callbacks=[lambda one: kept.append(copy.deepcopy(one))])
    assert [one.episodes for one in kept] == [4, 8]
    assert_same(kept[0].learn(4), learner)


def test_another_process_goes_on(tmp_path: Path) -> None:
    learner = make(QLearning, STEP, 2).learn(5)
    (tmp_path / "in").write_bytes(pickle.dumps(learner))
    code = (
        "import pickle, sys; from pathlib import Path; folder = Path(sys.argv[1])\n"
        "learner = pickle.loads((folder / 'in').read_bytes()).learn(6)\n"
        "(folder / 'out').write_bytes(pickle.dumps(learner))"
    )
    subprocess.run([sys.executable, "-W", "ignore", "-c", code, str(tmp_path)], check=True)
    assert_same(pickle.loads((tmp_path / "out").read_bytes()), learner.learn(6))  # noqa: S301  # our own
