"""What a learner of a user's own may take, and how a class that lacks something is refused."""

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest

from tests.learners.worlds import corridor
from tests.training.test_resume import assert_same
from tuckerl import EpsilonGreedy, Greedy, Linear, QLearning, TensorStep, sutton_maze
from tuckerl.errors import LearnerError, ParameterError, ParameterTypeError
from tuckerl.learners.q_learning import update
from tuckerl.training import learner_file
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedyArrays
from tuckerl.types import FloatArray

WORLD = corridor(5)


class Unregistered(NamedTuple):
    """A state whose kernels nobody registers."""

    scheduled: FloatArray


class Wanting(NamedTuple):
    """A state with a field that nobody gives."""

    scheduled: FloatArray
    bonus: FloatArray


register_algorithm(Wanting, update=update)


class Nameless(Learner):
    """A learner without a state."""


class Kernelless(Learner):
    """A learner without kernels."""

    state_type = Unregistered


class Incomplete(Learner):
    """A learner that gives less than its state has."""

    state_type = Wanting


class Twice(QLearning):
    """A learner that declares a name twice."""

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return two arrays of one name."""
        return DeclaredArray("bonus", "none"), DeclaredArray("bonus", "copied")


class Forgetful(QLearning):
    """A learner that does not keep its parameter."""

    def __init__(self, env: Any, *, patience: int = 3, **parameters: Any) -> None:
        super().__init__(env, **parameters)


class Own(QLearning):
    """A learner whose parameters may be given by place, one of them named as the files name another's."""

    def __init__(self, env: Any, walk: str = "members", cut_traces: bool = True, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        self.walk, self.cut_traces = walk, cut_traces


@pytest.mark.parametrize(
    ("kind", "problem"),
    [
        (Nameless, "Nameless has no algorithm: set its state_type"),
        (Kernelless, "no kernels are registered for Unregistered, the state_type of Kernelless: call register_"),
        (Incomplete, "Wanting has a field 'bonus' that Incomplete does not give it: declare it in declare_state"),
        (Twice, "declared arrays must have different names; got bonus, bonus"),
    ],
)
def test_classes_that_lack_something_are_refused(kind: type[Learner], problem: str) -> None:
    with pytest.raises(LearnerError, match=problem):
        kind(WORLD, seed=0).learn(1)


def test_a_parameter_that_is_not_kept_cannot_be_saved(tmp_path: Path) -> None:
    learner = Forgetful(WORLD, patience=1, seed=0)
    with pytest.raises(LearnerError, match="Forgetful must keep its parameter 'patience' as an attribute"):
        learner.save(tmp_path / "agent")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("cut_traces", [True, False])
def test_parameters_of_users_own_keep_their_names_and_values_in_files(tmp_path: Path, cut_traces: bool) -> None:
    learner = Own(WORLD, "independent", cut_traces, seed=0).learn(5)
    path = tmp_path / "agent"
    learner.save(path)
    stored = learner_file.read(path).header["parameters"]
    assert (stored["walk"], stored["cut_traces"], stored["compiled"]) == ("independent", cut_traces, "auto")
    again = Own.load(path)
    assert (again.walk, again.cut_traces, again.compiled) == ("independent", cut_traces, "auto")
    assert_same(again.learn(5), learner.learn(5))


def test_numbers_are_kept_as_they_were_checked(tmp_path: Path) -> None:
    half: Any = np.float32(0.5)
    learner = QLearning(WORLD, alpha=half, policy=EpsilonGreedy(half), seed=0).learn(3)
    assert isinstance(learner.alpha, float)
    assert repr(learner.policy) == "EpsilonGreedy(0.5)"
    learner.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent")
    assert_same(again.learn(3), learner.learn(3))


class Cooling(EpsilonGreedy):
    """A policy that explores by one schedule, and is learned for by another."""

    latest: ClassVar[list[float]] = []

    def target(self) -> EpsilonGreedy:
        """Return a policy with a schedule of its own."""
        return Target(Linear(1.0, 0.0, 10))


class Target(EpsilonGreedy):
    """Tells which values of its schedule it is given."""

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> EpsilonGreedyArrays:
        """Return what the kernels read."""
        Cooling.latest.append(float(scheduled[0]))
        return super().arrays(scheduled, declared)


def test_a_target_follows_its_own_schedule() -> None:
    learner = QLearning(WORLD, policy=Cooling(0.3), seed=0)
    Cooling.latest.clear()
    for episodes in (0, 5, 5):
        if episodes:
            learner.learn(episodes)
        learner.evaluate(1)
    learner.evaluate(1, deterministic=True)
    assert Cooling.latest == pytest.approx([1.0, 0.5, 0.0])


@pytest.mark.parametrize("value", ["yes", 1, 0.0])
def test_deterministic_is_true_false_or_none(value: Any) -> None:
    learner = QLearning(WORLD, seed=0)
    with pytest.raises(ParameterTypeError, match="deterministic must be True or False; got"):
        learner.predict(0, deterministic=value)
    with pytest.raises(ParameterTypeError, match="deterministic must be True or False; got"):
        learner.evaluate(1, deterministic=value)


def test_numpy_bools_are_flags() -> None:
    learner = QLearning(WORLD, policy=Greedy(), seed=0).learn(2)
    for flag in (True, False):
        assert learner.predict(0, deterministic=np.bool_(flag)) == learner.predict(0, deterministic=flag)  # type: ignore[arg-type]  # NumPy's are no bool to the type checker


@pytest.mark.parametrize(("share", "shape"), [("none", ("states", "agents")), ("by_row", ("states",)), ("by_row", ())])
def test_shapes_that_cannot_be_are_refused(share: Any, shape: tuple[Any, ...]) -> None:
    with pytest.raises(ParameterError, match="the shape of 'bonus' must be of whole numbers, 'states' and 'actions'"):
        DeclaredArray("bonus", share, shape)


class Narrow(QLearning):
    """Takes less than others."""

    def __init__(self, env: Any, *, alpha: float = 0.2, seed: Any = None) -> None:
        super().__init__(env, alpha=alpha, seed=seed)


class Seedless(QLearning):
    """Draws as it likes."""

    def __init__(self, env: Any, *, alpha: float = 0.2) -> None:
        super().__init__(env, alpha=alpha)


def test_a_constructor_that_takes_less_is_enough(tmp_path: Path) -> None:
    whole = Narrow(WORLD, seed=1).learn(4)
    assert "alpha=0.2" in repr(whole)
    whole.save(tmp_path / "agent.tuckerl")
    copies = [Narrow.load(tmp_path / "agent.tuckerl"), copy.deepcopy(whole)]
    for learner in (whole, *copies):
        learner.alpha = 0.5
        learner.learn(4)
    for again in copies:
        np.testing.assert_array_equal(again.q, whole.q)


def test_one_without_a_seed_cannot_be_made_again(tmp_path: Path) -> None:
    learner = Seedless(WORLD).learn(4)
    with pytest.raises(LearnerError, match="the constructor of Seedless takes no seed"):
        learner.save(tmp_path / "agent.tuckerl")
    with pytest.raises(LearnerError, match="takes no seed"):
        copy.deepcopy(learner)


class Modelled(QLearning):
    """One whose table is said to be made from a model, so that neither weights nor sharing mean anything."""

    def why_no_weights(self) -> str:
        return "it has no step size"

    def why_no_sharing(self) -> str:
        return "its tables are made from a model"


@pytest.mark.parametrize(
    ("step", "problem"),
    [
        ({"share": "none"}, r'Modelled must have weights="none": it has no step size; got weights=\'paper\''),
        ({"weights": "none"}, r'must have share="none": its tables are made from a model; got share=\'max\''),
        ({"weights": "none", "share": "none", "shrink": 0.5}, r"Modelled must have shrink=0: its tables are made from"),
        ({"weights": lambda decomposition: np.ones(4), "share": "none"}, r"it has no step size; got weights=<function"),
    ],
)
def test_a_step_that_would_mean_nothing_is_refused(step: dict[str, Any], problem: str) -> None:
    tensor_step = TensorStep(5, (2, 2, 2, 1), **step)
    with pytest.raises(ParameterError, match=problem):
        Modelled(sutton_maze(), tensor_step=tensor_step)
    Modelled(sutton_maze(), tensor_step=TensorStep(5, (2, 2, 2, 1), weights="none", share="none"))
