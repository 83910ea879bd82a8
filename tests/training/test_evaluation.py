"""Greedy episodes apart from learning, and the interval of their mean."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from scipy import stats

from tests.adapters.parallel_worlds import Leaving
from tests.learners.worlds import corridor, drift, random_mdp
from tests.training.counting import countings
from tests.training.test_resume import LEARNERS, assert_same, make
from tuckerl import QLearning, TabularMDP, TensorStep
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, StepCapWarning
from tuckerl.training.evaluation import Evaluation, mean_interval
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(95, n_outcomes=2, random_start=True)
STEP = TensorStep(every=5, ranks=(4, 2, 3, 1))


@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("learner", LEARNERS)
def test_learning_goes_on_as_if_it_had_not_been(learner: type[Learner], step: TensorStep | None) -> None:
    watched = make(learner, step, 2)
    for n in (3, 4, 6):
        watched.evaluate(5)
        watched.learn(n)
        watched.evaluate(5, seed=1)
    assert_same(watched, make(learner, step, 2).learn(13))


@pytest.mark.parametrize("env", ["Blackjack-v1", "Taxi-v4", "tuckerl/RobotRescue-v0"])
def test_learning_goes_on_in_python_environments(env: str) -> None:
    def fresh() -> QLearning:
        return QLearning(env, compiled=False, epsilon=0.5, seed=3)

    watched = fresh().learn(2)
    watched.evaluate(3)
    watched.learn(2)
    watched.evaluate(3)
    assert_same(watched.learn(1), fresh().learn(5))


def test_going_right_through_the_corridor() -> None:
    table = np.tile([0.0, 1.0], (5, 1))
    result = QLearning(corridor(), initial_q=table, epsilon=1.0, n_agents=3, seed=1).evaluate(4)
    assert result.returns.tolist() == [[-5.0]] * 4
    assert result.steps.tolist() == [[5]] * 4
    assert (result.mean, result.low, result.high) == (-5.0, -5.0, -5.0)


def test_it_is_shown_in_one_line() -> None:
    shown = repr(Evaluation(np.array([[1.0], [0.0]]), np.array([[3], [4]]), 0.5, 0.0, 1.0))
    assert shown == "Evaluation(mean=0.5, low=0, high=1, episodes=2)"


def test_ties_go_to_the_lowest_action() -> None:
    # With equal values, the corridor is left to the wrong side: the limit of 100 steps ends every episode.
    assert QLearning(corridor(), seed=1, ties="random").evaluate(3).steps.tolist() == [[100]] * 3
    table = np.tile([0.0, 0.5, 0.5], (3, 1))
    problem = TabularMDP([[0, 1, 2]] * 3, [[0.0, 1.0, 2.0]] * 3, [[False, True, True]] * 3, max_episode_steps=10)
    assert QLearning(problem, initial_q=table, seed=1).evaluate(50).returns.tolist() == [[1.0]] * 50


def test_of_several_copies_the_first_is_evaluated() -> None:
    learner = QLearning(PROBLEM, n_agents=3, seed=1).learn(30)
    before = learner.evaluate(20)
    learner._state.q[1:] = 0.0
    np.testing.assert_array_equal(learner.evaluate(20).returns, before.returns)
    learner._state.q[0] = 0.0
    assert not np.array_equal(learner.evaluate(20).returns, before.returns)


def test_agents_of_one_world_are_evaluated_together() -> None:
    result = QLearning(Leaving(), seed=3).evaluate(4)
    assert result.steps.tolist() == [[1, 2, 3]] * 4
    assert result.returns.tolist() == [[1.0, 20.0, 300.0]] * 4
    assert result.mean == result.low == result.high == 107.0


def test_it_is_repeatable_and_the_seed_decides() -> None:
    learner = QLearning(PROBLEM, seed=1).learn(50)
    first, again = learner.evaluate(40), learner.evaluate(40)
    for ours, theirs in zip(first, again, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    one, other, sequence = (learner.evaluate(40, seed=seed) for seed in (3, 2, np.random.SeedSequence(3)))
    np.testing.assert_array_equal(learner.evaluate(40, seed=1).returns, first.returns)  # the default is its own seed
    assert not np.array_equal(one.returns, first.returns)
    assert not np.array_equal(one.returns, other.returns)
    np.testing.assert_array_equal(one.returns, sequence.returns)
    assert (one.low, one.high) == (sequence.low, sequence.high)
    # Another learner's own stream is another one.
    twin = QLearning(PROBLEM, initial_q=learner.q[0], seed=2)
    assert not np.array_equal(twin.evaluate(40).returns, first.returns)
    np.testing.assert_array_equal(twin.evaluate(40, seed=3).returns, one.returns)


def test_longer_evaluations_begin_as_shorter_ones() -> None:
    learner = QLearning(PROBLEM, seed=1).learn(50)
    np.testing.assert_array_equal(learner.evaluate(30).returns[:20], learner.evaluate(20).returns)


def test_returns_are_those_of_playing_by_predict() -> None:
    learner = QLearning("Blackjack-v1", epsilon=0.3, seed=1).learn(200)
    result = learner.evaluate(50, seed=4)
    env = gymnasium.make("Blackjack-v1")
    returns = []
    # The environment is seeded once, from the child of the seed that belongs to evaluations.
    sequence = np.random.SeedSequence(4, spawn_key=(2**32 - 3, 0, 0, 0))
    observation, _ = env.reset(seed=int(sequence.generate_state(1)[0]))
    for _ in range(50):
        ended, total = False, 0.0
        while not ended:
            observation, reward, terminated, truncated, _ = env.step(learner.predict(observation)[0])
            ended, total = terminated or truncated, total + float(reward)
        returns.append(total)
        observation, _ = env.reset()
    assert result.returns[:, 0].tolist() == returns


def test_simulators_are_evaluated_too() -> None:
    learner = QLearning(drift(), seed=1).learn(5)
    result = learner.evaluate(10)
    assert 0 < result.steps.min() <= result.steps.max() <= 80
    assert_same(learner.learn(5), QLearning(drift(), seed=1).learn(10))


def test_going_in_circles_without_a_time_limit_comes_to_an_end() -> None:
    with pytest.warns(StepCapWarning, match="an episode was cut off after 100000 steps"):
        result = QLearning(corridor(limit=None), seed=1).evaluate(1)
    assert result.steps.tolist() == [[100_000]]


def test_one_episode_that_is_cut_off_among_others_is_told() -> None:
    mdp = TabularMDP([[0], [1]], [[1.0], [1.0]], [[False], [True]], start=[0.5, 0.5])
    with pytest.warns(StepCapWarning, match="an episode was cut off after 100000 steps"):
        result = QLearning(mdp, seed=1).evaluate(4)
    assert set(result.steps.ravel().tolist()) == {1, 100_000}


def test_the_interval_is_scipys() -> None:
    values = np.array([0.0, 1.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0])
    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=9999,
        batch=1000,
        confidence_level=0.95,
        method="BCa",
        rng=np.random.default_rng(3),
    ).confidence_interval
    assert mean_interval(values, np.random.default_rng(3)) == (interval.low, interval.high)
    # Efron (1987), with resamples of our own: to its accuracy.
    means = np.random.default_rng(4).choice(values, (200_000, values.size)).mean(axis=1)
    others = values.mean() - np.array([np.delete(values, i).mean() for i in range(values.size)])
    acceleration = (others**3).sum() / (6 * (others**2).sum() ** 1.5)
    bias = stats.norm.ppf(((means < values.mean()).mean() + (means <= values.mean()).mean()) / 2)
    for z, bound in zip(np.atleast_1d(stats.norm.ppf([0.025, 0.975])), interval, strict=True):
        level = stats.norm.cdf(bias + (bias + z) / (1 - acceleration * (bias + z)))
        assert np.quantile(means, level) == pytest.approx(bound, abs=0.15)
    learner = QLearning(countings(), seed=1)
    result = learner.evaluate(8)
    assert result.low < result.mean == result.returns.mean() < result.high
    assert (result.low, result.high) != mean_interval(result.returns[:, 0], np.random.default_rng(3))


def test_one_episode_has_no_interval_and_equal_ones_have_none_to_tell() -> None:
    result = QLearning(PROBLEM, seed=1).evaluate(1)
    assert np.isfinite(result.mean)
    assert np.isnan([result.low, result.high]).all()
    assert mean_interval(np.full(5, 2.5), np.random.default_rng(1)) == (2.5, 2.5)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"episodes": 0}, ParameterError, "episodes must be a whole number of at least 1; got 0"),
        ({"episodes": 2.5}, ParameterTypeError, "episodes must be .* got 2.5 of type float"),
        ({"seed": -1}, ParameterError, "seed must be a whole number of at least 0; got -1"),
    ],
)
def test_arguments_are_checked(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        QLearning(PROBLEM, seed=1).evaluate(**arguments)


def test_an_environment_that_cannot_be_copied_says_so() -> None:
    class Stubborn(type(countings()())):  # type: ignore[misc]
        def __deepcopy__(self, memo: Any) -> Any:
            raise TypeError("no")

    learner = QLearning(Stubborn([]), seed=1).learn(3)
    with pytest.raises(ProblemError, match="cannot be copied for one more agent"):
        learner.evaluate(3)
    assert learner.learn(1).episodes == 4
