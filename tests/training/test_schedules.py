"""Schedules: numbers by hand, and learning as the twins do when they are given each episode's numbers."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, dyna_twin, random_mdp, sarsa_lambda_twin, sarsa_twin, team_twin, twin
from tests.training.test_resume import LEARNERS, assert_same
from tuckerl import DynaH, Exponential, Harmonic, Linear, QLearning, Sarsa, SarsaLambda, TeamQ, TensorStep
from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.training.schedules import Schedule, ScheduleValues, as_json, as_schedule, from_json

PROBLEM = random_mdp(81, n_outcomes=2)


@pytest.mark.parametrize(
    ("schedule", "expected"),
    [
        (Exponential(0.5), [0.5, 0.5, 0.5, 0.5, 0.5]),
        (Exponential(0.8, 0.5), [0.8, 0.4, 0.2, 0.1, 0.05]),
        (Exponential(0.8, 0.5, minimum=0.15), [0.8, 0.4, 0.2, 0.15, 0.15]),
        (Exponential(0.8, 0.0), [0.8, 0.0, 0.0, 0.0, 0.0]),
        (Exponential(0.1, 0.5, minimum=0.3), [0.3, 0.3, 0.3, 0.3, 0.3]),
        (Linear(1.0, 0.0, episodes=4), [1.0, 0.75, 0.5, 0.25, 0.0]),
        (Linear(0.2, 0.6, episodes=2), [0.2, 0.4, 0.6, 0.6, 0.6]),
        (Linear(0.9, 0.1, episodes=1), [0.9, 0.1, 0.1, 0.1, 0.1]),
        (Harmonic(1.0, half_after=2), [1.0, 2 / 3, 1 / 2, 2 / 5, 1 / 3]),
        (Harmonic(0.5, half_after=0.5), [1 / 2, 1 / 6, 1 / 10, 1 / 14, 1 / 18]),
    ],
)
def test_numbers_by_hand(schedule: Schedule, expected: list[float]) -> None:
    np.testing.assert_allclose(schedule.values(5), expected, rtol=1e-15)
    for n in range(5):  # the first numbers do not depend on how many are asked for
        np.testing.assert_array_equal(schedule.values(n), schedule.values(5)[:n])


def test_a_number_that_decays_is_multiplied_from_episode_to_episode() -> None:
    value, expected = 0.9, []
    for _ in range(200):
        expected.append(value)
        value *= 0.97
    np.testing.assert_array_equal(as_schedule("epsilon", 0.9, 0.97).values(200), expected)


ALPHA, EPSILON = Harmonic(0.8, half_after=3), Linear(1.0, 0.4, episodes=6)
TWINS: list[tuple[Any, Any, dict[str, Any]]] = [
    (QLearning, twin, {}),
    (Sarsa, sarsa_twin, {}),
    (SarsaLambda, sarsa_lambda_twin, {"lambda_": 0.8}),
    (DynaH, dyna_twin, {"planning_steps": 3}),
    (TeamQ, team_twin, {"lambda_": 0.8}),
]


@pytest.mark.parametrize(("learner", "slow_learner", "parameters"), TWINS)
def test_learning_equals_the_twins(learner: Any, slow_learner: Any, parameters: dict[str, Any]) -> None:
    # The actions are forced, as rounding might else change them: alpha alone is seen here.
    fast = learner(PROBLEM, alpha=ALPHA, epsilon=1.0, n_agents=2, seed=3, **parameters).learn(7).learn(5)
    for agent in range(2):
        slow = slow_learner(PROBLEM, alpha=0.0, epsilon=1.0, seed=3, agent=agent, **parameters)
        for episode in range(12):
            slow.alpha = 0.8 / (1 + episode / 3)
            assert slow.episode(np.ones(3))[0] == fast.steps[episode, agent]
        np.testing.assert_allclose(fast.q[agent], slow.q, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("learner", "slow_learner", "parameters"), TWINS)
def test_exploring_equals_the_twins(learner: Any, slow_learner: Any, parameters: dict[str, Any]) -> None:
    # One update by a power of two in each place of the corridor: no rounding, so greedy actions may be compared.
    problem = corridor(4)
    common: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "seed": 2, **parameters}
    fast = learner(problem, epsilon=EPSILON, **common).learn(4).learn(4)
    slow = slow_learner(problem, epsilon=0.0, **common)
    steps = []
    for episode in range(8):
        slow.epsilon = 1.0 + (0.4 - 1.0) * min(episode / 6, 1.0)
        steps.append(slow.episode(np.ones(2))[0])
    assert fast.steps[:, 0].tolist() == steps
    np.testing.assert_allclose(fast.q[0], slow.q, rtol=1e-12)


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_schedule_that_stays_is_a_number(learner: Any) -> None:
    number = learner(PROBLEM, alpha=0.25, epsilon=0.5, n_agents=2, seed=1).learn(20)
    for alpha, epsilon in [
        (Linear(0.25, 0.25, episodes=7), Exponential(0.5)),
        (Exponential(0.25), Linear(0.5, 0.5, 3)),
    ]:
        other = learner(PROBLEM, alpha=alpha, epsilon=epsilon, n_agents=2, seed=1).learn(20)
        np.testing.assert_array_equal(other.q, number.q)
        np.testing.assert_array_equal(other.steps, number.steps)
    decayed = learner(PROBLEM, epsilon=0.9, epsilon_decay=0.8, seed=1).learn(20)
    other = learner(PROBLEM, epsilon=Exponential(0.9, 0.8), seed=1).learn(20)
    np.testing.assert_array_equal(other.q, decayed.q)
    assert not np.array_equal(learner(PROBLEM, epsilon=0.9, seed=1).learn(20).q, decayed.q)


@pytest.mark.parametrize("step", [None, TensorStep(every=5, ranks=(2, 2, 2, 1))])
@pytest.mark.parametrize("learner", LEARNERS)
def test_schedules_go_on_in_pieces_and_through_files(learner: Any, step: TensorStep | None, tmp_path: Path) -> None:
    def fresh() -> Any:
        return learner(PROBLEM, alpha=ALPHA, epsilon=EPSILON, n_agents=2, seed=1, tensor_step=step)

    whole, piece = fresh().learn(17), fresh()
    for n in (3, 4, 10):
        piece.learn(n).save(tmp_path / "agent")
        piece = learner.load(tmp_path / "agent")
        assert (piece.alpha, piece.epsilon) == (ALPHA, EPSILON)
    assert_same(piece, whole)


def test_random_predictions_use_the_present_epsilon() -> None:
    table = np.zeros((7, 3))
    table[:, 0] = 1.0
    # From the second episode on, actions are greedy: all are 0. Before, each is one of three.
    learner = QLearning(PROBLEM, alpha=1e-9, epsilon=Linear(1.0, 0.0, episodes=1), initial_q=table, seed=1)
    states = np.zeros(300, dtype=np.int64)
    assert set(learner.predict(states, deterministic=False)[0]) == {0, 1, 2}
    assert set(learner.learn(1).predict(states, deterministic=False)[0]) == {0}


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Exponential(-0.5), ParameterError, r"start must be a finite number of at least 0; got -0.5"),
        (lambda: Exponential(0.5, -0.1), ParameterError, r"decay must be a number in \[0, 1\]; got -0.1"),
        (lambda: Exponential(0.5, 0.9, minimum=-2), ParameterError, r"minimum must be .* got -2.0"),
        (lambda: Linear(1, -1, 5), ParameterError, r"stop must be a finite number of at least 0; got -1.0"),
        *(
            (
                lambda wrong=wrong: QLearning(PROBLEM, epsilon=wrong),
                ParameterError,
                r"epsilon must stay in \[0, 1\] in all episodes; .* does not",
            )
            for wrong in (Exponential(1.5), Exponential(0.5, 0.5, 1.5), Linear(0, 2, 5), Harmonic(3, 1))
        ),
        (
            lambda: Linear(1, 0, 0),
            ParameterError,
            "episodes must be a whole number from 1 to 9223372036854775807; got 0",
        ),
        (
            lambda: Linear(1, 0, 10**400),
            ParameterError,
            "episodes must be a whole number from 1 to 9223372036854775807",
        ),
        (lambda: Linear(1, 0, 2.5), ParameterTypeError, "episodes must be .* got 2.5 of type float"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: Harmonic(1, 0), ParameterError, "half_after must be a finite number above 0; got 0.0"),
        (lambda: Harmonic("1", 1), ParameterTypeError, "start must be .* got '1' of type str"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: Harmonic(float("nan"), 1), ParameterError, "start must be .* got nan"),
        (
            lambda: QLearning(PROBLEM, epsilon=Linear(1, 0, 5), epsilon_decay=0.9),
            ParameterError,
            "epsilon is a schedule already: leave epsilon_decay at 1; got 0.9",
        ),
        (lambda: QLearning(PROBLEM, alpha=Linear), ParameterTypeError, "alpha must be .* got <class"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: QLearning(PROBLEM, gamma=Linear(1, 0, 5)), ParameterTypeError, "gamma must be .* got Linear"),  # type: ignore[arg-type]  # wrong on purpose
    ],
)
def test_impossible_schedules_are_refused(make: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize("schedule", [Exponential(0.3, 0.9, 0.1), Linear(1, 0, 7), Harmonic(0.5, 10)])
def test_schedules_survive_json(schedule: Schedule) -> None:
    assert from_json(as_json(schedule)) == schedule
    assert as_json(schedule)["schedule"] == type(schedule).__name__
    assert from_json(as_json(0.5)) == 0.5
    with pytest.raises(UnknownNameError, match="unknown schedule 'Cosine': use one of Exponential, Harmonic, Linear"):
        from_json({"schedule": "Cosine"})


@dataclass(frozen=True)
class Steeper(Linear):
    pass


class Cosine(Schedule):
    def values(self, n_episodes: int) -> Any:
        return 0.5 + 0.5 * np.cos(np.arange(n_episodes) / 10)


@pytest.mark.parametrize("schedule", [Steeper(1, 0, 5), Cosine()])
def test_a_schedule_that_no_file_could_hold_is_refused(schedule: Schedule) -> None:
    known = "tuckerl.Exponential, tuckerl.Linear, tuckerl.Harmonic"
    with pytest.raises(ParameterTypeError, match=f"epsilon must be a number or one of the schedules {known}; got "):
        QLearning(PROBLEM, epsilon=schedule)


def test_who_plays_the_past_by_a_number_that_is_new_finds_it_and_the_record_says_that_it_was_not() -> None:
    values = ScheduleValues({"epsilon": Linear(0.4, 0.0, 4)}).followed_by({"temperature": Exponential(0.5)}, 3)
    assert values.values(5)[:, 0].tolist() == [0.5] * 5
    recorded = values.recorded(5)
    np.testing.assert_array_equal(recorded["temperature"], [np.nan] * 3 + [0.5] * 2)
    np.testing.assert_allclose(recorded["epsilon"], [0.4, 0.3, 0.2, np.nan, np.nan])
