"""Parameters that are assigned later: checked as the constructor does, in force from the next episode, and saved."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tuckerl
from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import (
    DynaH,
    EpsilonGreedy,
    Exponential,
    Greedy,
    Harmonic,
    Linear,
    QLearning,
    SarsaLambda,
    TeamQ,
    TensorStep,
)
from tuckerl.errors import (
    ImmutableError,
    LearnerError,
    ParameterError,
    ParameterTypeError,
    ProblemError,
    UnknownNameError,
)
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.schedules import as_schedule

pytestmark = [pytest.mark.filterwarnings(f"ignore::tuckerl.errors.{kind}Warning") for kind in ("Rank", "ZeroWeight")]
PROBLEM = random_mdp(41, n_actions=4, limit=30, action_sizes=(2, 2))
STEP = TensorStep(every=5, ranks=(2, 2, 2, 1))
HEURISTIC = np.arange(float(PROBLEM.n_states))[::-1]
CHANGES: list[tuple[type[Learner], str, Any]] = [
    (QLearning, "alpha", 0.05),
    (QLearning, "alpha", Harmonic(0.5, 3)),
    (QLearning, "gamma", 0.3),
    (QLearning, "epsilon", 0.9),
    (QLearning, "epsilon", Linear(1.0, 0.5, 30)),
    (QLearning, "epsilon_decay", 0.9),
    (QLearning, "ties", "first"),
    (QLearning, "bootstrap_terminal", True),
    (QLearning, "policy", Greedy()),
    (SarsaLambda, "lambda_", 0.1),
    (SarsaLambda, "trace", "accumulating"),
    (SarsaLambda, "carry_trace", True),
    (SarsaLambda, "gamma", 0.3),
    (DynaH, "planning_steps", 1),
    (DynaH, "search_control", "random"),
    (DynaH, "heuristic", HEURISTIC),
    (DynaH, "gamma", 0.3),
    (DynaH, "bootstrap_terminal", True),
    (TeamQ, "cut_traces", False),
    (TeamQ, "exploration", "joint"),
    (TeamQ, "epsilon", 0.9),
]


def make(kind: type[Learner], **parameters: Any) -> Any:
    own = {"heuristic": np.zeros(PROBLEM.n_states)} if kind is DynaH else {}
    settings: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.4, "n_agents": 2, "seed": 6, "tensor_step": STEP}
    return kind(PROBLEM, **settings | own | parameters)


@pytest.mark.parametrize(("kind", "name", "value"), CHANGES)
def test_what_is_assigned_first_is_what_the_constructor_takes(kind: type[Learner], name: str, value: Any) -> None:
    without = {"epsilon": None} if name == "policy" else {}
    given, assigned = make(kind, **without | {name: value}), make(kind)
    setattr(assigned, name, value)
    assert_same(assigned.learn(12), given.learn(12))


@pytest.mark.parametrize(("kind", "name", "value"), CHANGES)
def test_what_is_assigned_later_is_in_force_and_in_the_file(
    kind: type[Learner], name: str, value: Any, tmp_path: Path
) -> None:
    unchanged, changed, called = make(kind).learn(13), make(kind).learn(13), make(kind)
    setattr(changed, name, value)
    changed.save(tmp_path / "agent")
    again = kind.load(tmp_path / "agent")
    np.testing.assert_equal(repr(getattr(again, name)), repr(getattr(changed, name)))
    assert repr(again) == repr(changed)

    def change(learner: Learner) -> None:
        if learner.episodes == 13:
            setattr(learner, name, value)

    class Change(tuckerl.Callback):
        def on_window(self, learner: Learner) -> None:
            change(learner)

    called.learn(29, callbacks=[Change(every=1)])
    assert_same(again.learn(16), changed.learn(16))
    assert_same(called, changed)
    assert name == "ties" or not np.array_equal(changed.q, unchanged.learn(16).q)  # there are none by then


def test_an_alpha_that_is_assigned_is_that_of_the_next_episode() -> None:
    assigned = make(QLearning, alpha=0.5).learn(1)
    assigned.alpha = 0.1
    given = make(QLearning, alpha=Linear(0.5, 0.1, episodes=1))
    np.testing.assert_array_equal(assigned.learn(20).q, given.learn(21).q)


def test_values_are_kept_as_they_were_checked() -> None:
    learner = make(QLearning)
    half: Any = np.float32(0.5)
    learner.alpha, learner.bootstrap_terminal = half, np.True_
    assert type(learner.alpha) is float
    assert learner.bootstrap_terminal is True


# What a change must bring up to date


@pytest.mark.parametrize("change", [{"heuristic": HEURISTIC}, {"gamma": 0.25}, {"bootstrap_terminal": True}])
def test_models_follow_the_parameters(change: dict[str, Any]) -> None:
    learner = make(DynaH, heuristic=np.arange(float(PROBLEM.n_states)) % 3, gamma=0.5).learn(8)
    ended = [held["model.outcome"]["discount"] == 0.0 for held in learner.declared]
    learner.change(change)
    for held, ends in zip(learner.declared, ended, strict=True):
        n = int(held["model.n_observed"][0])
        for state in held["model.observed"][:n]:
            distance, outcome = held["model.distance"][state], held["model.outcome"][state]
            modelled = np.flatnonzero(np.isfinite(distance))
            discounts = np.where(ends[state] & ~learner.bootstrap_terminal, 0.0, learner.gamma)
            np.testing.assert_array_equal(outcome["discount"][modelled], discounts[modelled])
            np.testing.assert_array_equal(distance[modelled], learner.heuristic[outcome["next_state"][modelled]])
            best = np.flatnonzero(distance == distance.max())
            assert (held["model.farthest"][state], held["model.n_farthest"][state]) == (best[0], len(best))
        assert n > 0


def test_a_model_that_cannot_tell_ends_is_not_guessed_from() -> None:
    learner = make(DynaH, gamma=0.0)
    learner.gamma = 0.5  # nothing is modelled yet
    learner.bootstrap_terminal = True
    learner.learn(3).gamma = 0.25
    before = make(DynaH, gamma=0.0, bootstrap_terminal=True).learn(3)
    with pytest.raises(ImmutableError, match="cannot tell them apart; make a new learner"):
        learner.bootstrap_terminal = False
    assert learner.bootstrap_terminal
    before.gamma = 0.5  # ends count as all steps, before and after


def test_carried_traces_end_with_what_carried_them() -> None:
    learner = make(SarsaLambda, carry_trace=True, tensor_step=None).learn(5)
    assert any(held["traces"].cursor[0] for held in learner.declared)
    learner.carry_trace = False
    assert not any(held["traces"].cursor[0] for held in learner.declared)


# What is refused


@pytest.mark.parametrize(
    ("kind", "name", "value", "error", "message"),
    [
        (QLearning, "alpha", 0, ParameterError, r"alpha must be a number in \(0, 1\]; got 0"),
        (QLearning, "alpha", Linear(0, 0, 5), ParameterError, "alpha must not be 0 in all episodes"),
        (QLearning, "gamma", "high", ParameterTypeError, "gamma must be a number in .* got 'high'"),
        (QLearning, "epsilon", 1.5, ParameterError, "epsilon must be a number in .* got 1.5"),
        (QLearning, "ties", "frist", UnknownNameError, "did you mean 'first'"),
        (QLearning, "policy", "greedy", ParameterTypeError, "policy must be a policy"),
        (SarsaLambda, "lambda_", 2, ParameterError, "lambda_ must be"),
        (DynaH, "planning_steps", -1, ParameterError, "planning_steps must be"),
        (DynaH, "heuristic", np.zeros(3), ProblemError, "heuristic must be"),
        (QLearning, "n_agents", 3, ImmutableError, "n_agents cannot change once a learner is made"),
        (QLearning, "initial_q", 0.0, ImmutableError, "initial_q cannot change"),
        (QLearning, "problem", PROBLEM, ImmutableError, "problem cannot change"),
        (QLearning, "tensor_step", None, ImmutableError, "tensor_step cannot change"),
        (QLearning, "seed_sequence", None, ImmutableError, "seed_sequence cannot change"),
        (QLearning, "seed", 1, ImmutableError, "seed cannot change"),
        (QLearning, "compiled", True, ImmutableError, "compiled cannot change"),
        (TeamQ, "team_reward", "sum", ImmutableError, "team_reward cannot change"),
        (QLearning, "q", 0.0, ImmutableError, "q cannot be assigned: it shows"),
        (QLearning, "alhpa", 0.5, ImmutableError, "QLearning has no attribute 'alhpa': did you mean 'alpha'?"),
        (QLearning, "lambda_", 0.5, ImmutableError, "no attribute 'lambda_': what can be assigned is alpha, gamma"),
    ],
)
def test_what_cannot_be_assigned_is_refused_and_changes_nothing(
    kind: type[Learner], name: str, value: Any, error: type[Exception], message: str
) -> None:
    learner, other = make(kind).learn(7), make(kind).learn(7)
    with pytest.raises(error, match=message):
        setattr(learner, name, value)
    assert_same(learner.learn(8), other.learn(8))


def test_parameters_cannot_be_deleted() -> None:
    with pytest.raises(ImmutableError, match="alpha cannot be deleted"):
        del make(QLearning).alpha


def test_epsilon_and_policy_take_turns() -> None:
    learner = make(QLearning)
    learner.policy = EpsilonGreedy(0.25)
    assert learner.epsilon is None
    with pytest.raises(ParameterError, match="epsilon belongs to the default policy"):
        learner.epsilon = 0.3
    learner.policy = None
    learner.epsilon = 0.3
    assert learner.epsilon == 0.3


@pytest.mark.parametrize("policy", [EpsilonGreedy(0.5), tuckerl.OwnDistribution("pi", 0.5)])
def test_policies_do_not_change(policy: Any) -> None:
    for name in ("epsilon", "decay", "epsilno"):
        with pytest.raises(ImmutableError, match=f"{name} cannot be assigned: a .* does not change once it is made"):
            setattr(policy, name, 0.1)


def test_arrays_of_parameters_cannot_be_written() -> None:
    learner = make(DynaH, initial_q=np.zeros((PROBLEM.n_states, PROBLEM.n_actions)))
    for array in (learner.initial_q, learner.heuristic):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


# What the past was stays


def test_histories_keep_what_was_in_force(tmp_path: Path) -> None:
    learner = make(QLearning, alpha=0.5, epsilon=Exponential(0.5, 0.5)).learn(2)
    learner.alpha = 0.25
    learner.learn(1).policy = Greedy()
    learner.learn(2).policy = None
    learner.learn(1)
    learner.save(tmp_path / "agent")
    for one in (learner, tuckerl.load(tmp_path / "agent")):
        np.testing.assert_array_equal(one.scheduled("alpha"), [0.5, 0.5, 0.25, 0.25, 0.25, 0.25])
        np.testing.assert_array_equal(one.scheduled("epsilon"), [0.5, 0.25, 0.125, np.nan, np.nan, 0.1])
        assert one.scheduled_names == ("alpha", "epsilon")


def test_schedules_count_from_the_first_episode() -> None:
    learner = make(QLearning).learn(4)
    learner.epsilon = Linear(1.0, 0.0, episodes=10)
    np.testing.assert_allclose(learner.learn(2).scheduled("epsilon"), [0.4] * 4 + [0.6, 0.5])


# Files


def test_load_takes_other_parameters(tmp_path: Path) -> None:
    make(SarsaLambda).learn(6).save(tmp_path / "agent")
    expected = make(SarsaLambda).learn(6)
    expected.alpha, expected.lambda_ = 0.125, 0.5
    expected.policy = EpsilonGreedy(0.5)
    expected.learn(6)
    changes: dict[str, Any] = {"alpha": 0.125, "lambda_": 0.5, "policy": EpsilonGreedy(0.5)}
    for load in (SarsaLambda.load, tuckerl.load):
        assert_same(load(tmp_path / "agent", **changes).learn(6), expected)
        for wrong, error, message in (
            ({"alhpa": 0.5}, ParameterTypeError, "SarsaLambda has no parameter 'alhpa': did you mean 'alpha'?"),
            ({"n_agents": 3}, ParameterError, "n_agents cannot change once a learner is made"),
            ({"alpha": 2}, ParameterError, "alpha must be"),
            (changes | {"epsilon": 0.1}, ParameterError, "epsilon belongs to the default policy"),
        ):
            with pytest.raises(error, match=message):
                load(tmp_path / "agent", **wrong)


# Learners of one's own


class Patient(QLearning):
    """A learner with parameters of its own, of which it knows nothing but how to check them."""

    def __init__(self, env: Any, *, patience: int = 3, size: int = 2, rate: Any = 0.5, **parameters: Any) -> None:
        self.size, self.rate = size, rate
        super().__init__(env, **parameters)
        if patience < 0:
            raise ValueError("patience is a virtue")
        self.patience, self.twice = patience, 2 * patience
        self.notes = ["made"]
        self._advice = self.call_from_kernels(lambda state: self.patience)

    def declare_state(self) -> Any:
        """Room, which nobody uses."""
        return (DeclaredArray("room", "none", (self.size,)),)

    def algorithm_schedules(self) -> Any:
        """A rate, which nobody reads."""
        return {"rate": as_schedule("rate", self.rate, positive=True)}


class Still(Patient):
    """One more parameter that cannot change."""

    fixed_parameters = (*Learner.fixed_parameters, "patience")


def test_parameters_of_ones_own_are_assigned_by_the_constructor(tmp_path: Path) -> None:
    learner = Patient(PROBLEM, seed=1).learn(4)
    learner.patience, learner.rate = 5, 0.25
    assert learner.twice == 10
    np.testing.assert_array_equal(learner.learn(2).scheduled("rate"), [0.5] * 4 + [0.25] * 2)
    assert len(learner._python_calls) == 1
    learner.save(tmp_path / "agent")
    assert Patient.load(tmp_path / "agent", patience=6).twice == 12
    learner.notes = ["an attribute that the constructor makes is its own"]
    assert_same(Patient.load(tmp_path / "agent").learn(3), learner.learn(3))


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"patience": -1}, ValueError, "patience is a virtue"),
        ({"size": 3}, ImmutableError, "decides the shape of 'room', which has been learned; make a new learner"),
        ({"rate": 0.0}, ParameterError, r"rate must be a number in \(0, 1\]"),
        ({"rate": Linear(1.0, 0.0, 9)}, ParameterError, "rate must stay above 0 in all episodes; Linear"),
    ],
)
def test_what_ones_own_constructor_refuses_changes_nothing(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    learner, other = Patient(PROBLEM, alpha=0.5, seed=1).learn(4), Patient(PROBLEM, alpha=0.5, seed=1).learn(4)
    with pytest.raises(error, match=message):
        learner.change({"alpha": 0.25} | change)
    assert (learner.alpha, learner.patience, learner.size, len(learner._python_calls)) == (0.5, 3, 2, 1)
    assert_same(learner.learn(4), other.learn(4))


def test_an_author_may_fix_a_parameter() -> None:
    learner = Still(PROBLEM, seed=1)
    with pytest.raises(ImmutableError, match="patience cannot change"):
        learner.patience = 4
    with pytest.raises(ImmutableError, match="Still has no attribute 'patienec': what can be assigned"):
        learner.patienec = 4  # type: ignore[assignment]  # that is what is tested


class Forgetful(QLearning):
    """A learner that does not keep its parameter."""

    def __init__(self, env: Any, *, patience: int = 3, **parameters: Any) -> None:
        super().__init__(env, **parameters)


def test_a_learner_that_keeps_no_parameter_cannot_be_made_again() -> None:
    learner = Forgetful(PROBLEM, seed=1)
    with pytest.raises(LearnerError, match="Forgetful must keep its parameter 'patience'"):
        learner.alpha = 0.5


# Schedules at 0


@pytest.mark.parametrize(
    ("schedule", "is_positive"),
    [
        (Exponential(0.5), True),
        (Exponential(0.5, 0.51), True),
        (Exponential(0.5, 0.5), False),
        (Exponential(0.5, 0.5, 0.1), True),
        (Exponential(0.0), False),
        (Linear(0.5, 0.0, 5), False),
        (Linear(0.0, 0.5, 5), False),
        (Linear(0.5, 0.1, 5), True),
        (Harmonic(0.5, 5), True),
        (Harmonic(0.0, 5), False),
        (Harmonic(0.5, 5e-324), False),
        (Harmonic(5e-324, 5), False),
        (Harmonic(0.5, 1e-200), True),
    ],
)
def test_schedules_know_whether_they_stay_above_zero(schedule: Any, is_positive: bool) -> None:
    assert schedule.is_positive is is_positive
    assert bool((schedule.values(10_000) > 0.0).all()) is is_positive
    if is_positive:
        assert as_schedule("rate", schedule, positive=True) is schedule
    else:
        with pytest.raises(ParameterError, match="rate must stay above 0 in all episodes"):
            as_schedule("rate", schedule, positive=True)


def test_a_learning_rate_may_fall_to_zero() -> None:
    learner = make(QLearning, alpha=Linear(0.5, 0.0, 6), tensor_step=None).learn(6)
    before = learner.q
    np.testing.assert_array_equal(learner.learn(3).q, before)
