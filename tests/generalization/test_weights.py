"""Omega: by hand, and what is true of every weighting."""

import warnings
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import QLearning, TabularMDP, TensorStep, TuckerDecomposition, action_weights
from tuckerl.errors import ParameterError, RankWarning, ZeroWeightWarning
from tuckerl.generalization.weights import WEIGHTINGS

PROBLEM = random_mdp(61, n_states=8, n_actions=4, n_outcomes=2)
RANKS = (4, 2, 3, 2)
WEIGHTS = ["paper", "relative", "constant", "permuted", "none"]


def _learner(weights: Any, **parameters: Any) -> QLearning:
    step = TensorStep(every=5, ranks=RANKS, weights=weights, **parameters)
    return QLearning(PROBLEM, n_agents=2, epsilon=0.5, tensor_step=step, seed=3)


def test_omega_by_hand() -> None:
    np.testing.assert_allclose(action_weights([[3.0, 0.0], [0.0, 4.0], [0.0, 0.0]]), [0.6, 0.8, 0.0], rtol=1e-15)
    np.testing.assert_allclose(action_weights([[1.0, 1.0], [1.0, -1.0]]), [np.sqrt(0.5)] * 2, rtol=1e-15)


@pytest.mark.parametrize("factor", [np.zeros((3, 2)), [1.0, 2.0], [[np.nan]], np.zeros((0, 2))])
def test_omega_of_what_is_no_factor(factor: Any) -> None:
    with pytest.raises(ParameterError, match=r"action_factor must be an \(A, R\) matrix of finite numbers"):
        action_weights(factor)


@pytest.mark.parametrize("unit", [1e308, 1e160, 2.0**-1050, 5e-324])
def test_omega_of_numbers_whose_squares_are_out_of_range(unit: float) -> None:
    np.testing.assert_allclose(action_weights([[unit, 0.0], [0.0, unit], [unit, unit]]), [0.5, 0.5, np.sqrt(0.5)])


@pytest.mark.parametrize("rank", [1, 2, 3])
def test_squares_of_omega_sum_to_one_and_none_exceeds_its_bound(rank: int) -> None:
    step = TensorStep(every=5, ranks=(4, rank, 3, 2))
    history = QLearning(PROBLEM, n_agents=2, epsilon=0.5, tensor_step=step, seed=3).learn(40).tensor_step_history
    assert (history.ranks[:, 1] == rank).all()
    np.testing.assert_allclose((history.weights**2).sum(axis=1), 1.0, rtol=1e-12)
    assert (history.weights >= 0).all()
    assert (history.weights <= 1 / np.sqrt(rank) + 1e-12).all()


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("weights", WEIGHTS)
def test_omega_is_one_until_the_first_window_ends_and_changes_at_window_ends_only(weights: str) -> None:
    learner = _learner(weights)
    np.testing.assert_array_equal(learner.action_weights, np.ones(4))
    for episode in range(1, 16):
        before = learner.action_weights
        learner.learn(1)
        if episode < 5:
            np.testing.assert_array_equal(learner.action_weights, np.ones(4))
        elif episode % 5:
            np.testing.assert_array_equal(learner.action_weights, before)
        else:
            np.testing.assert_array_equal(learner.action_weights, learner.tensor_step_history.weights[-1])
    assert learner.tensor_step_history.episode.tolist() == [5, 10, 15]
    plain = QLearning(PROBLEM, n_agents=2, epsilon=0.5, seed=3).learn(5)
    np.testing.assert_array_equal(_learner(weights, share="none").learn(5).q, plain.q)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_each_weighting_is_what_its_name_says() -> None:
    first = {name: _learner(name).learn(5).action_weights for name in WEIGHTS}  # the same tables in every learner
    np.testing.assert_allclose(first["constant"], [0.5] * 4, rtol=1e-15)
    np.testing.assert_array_equal(first["none"], np.ones(4))
    np.testing.assert_allclose(first["relative"], first["paper"] / first["paper"].max(), rtol=1e-15)
    assert first["relative"].max() == 1.0
    np.testing.assert_array_equal(np.sort(first["permuted"]), np.sort(first["paper"]))
    many = _learner("permuted").learn(60).tensor_step_history.weights
    ranks = {tuple(np.argsort(row)) for row in many}
    assert len(ranks) > 4  # dealt anew in each window


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("weights", WEIGHTS)
def test_the_floor_raises_what_lies_below_it(weights: str) -> None:
    plain = _learner(weights).learn(5).action_weights
    raised = _learner(weights, floor=0.55).learn(5).action_weights
    np.testing.assert_array_equal(raised, np.maximum(plain, 0.55))


# Action 2 pays nothing, so that its column stays zero however often it is tried.
WITHOUT_VALUES = TabularMDP([[0, 0, 0]], [[-1.0, -2.0, 0.0]], [[True, True, True]])


def test_an_action_without_values_stops_learning_with_one_warning() -> None:
    step = TensorStep(every=20, ranks=(1, 1, 1, 1))
    learner = QLearning(WITHOUT_VALUES, epsilon=1.0, tensor_step=step, seed=0)
    with pytest.warns(ZeroWeightWarning, match="the weight of action 2 is 0.* a floor above 0") as caught:
        learner.learn(100)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert learner.action_weights[2] == 0.0
    assert (learner.action_weights[:2] > 0).all()


@pytest.mark.parametrize("weights", ["paper", "relative"])
def test_zero_weights_are_exactly_zero_whatever_the_scale(weights: str) -> None:
    # Rewards of 1e6 and 1e-6 in one table: rounding leaves no weight to the action without values.
    problem = TabularMDP([[0, 0, 0]] * 2, [[-1e6, -1e-6, 0.0]] * 2, [[True] * 3] * 2)
    step = TensorStep(every=4, ranks=(1, 2, 1, 1), weights=weights)
    learner = QLearning(problem, epsilon=1.0, tensor_step=step, seed=0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        learner.learn(12)
    assert {warning.category for warning in caught} == {ZeroWeightWarning, RankWarning}
    assert (learner.tensor_step_history.weights[:, 2] == 0.0).all()


def test_clipping_warns_once_for_each_learner() -> None:
    for _ in range(2):
        learner = QLearning(
            PROBLEM, n_agents=2, epsilon=0.5, tensor_step=TensorStep(every=5, ranks=(15, 9, 9, 9)), seed=3
        )
        with pytest.warns(RankWarning, match=r"ranks \(15, 9, 9, 9\) .* clipped to \(8, 4, ") as caught:
            learner.learn(30)
        assert len(caught) == 1
        assert caught[0].filename == __file__


def test_ranks_that_fit_are_not_clipped() -> None:
    assert (_learner("paper").learn(30).tensor_step_history.ranks == RANKS).all()


def test_a_weights_function() -> None:
    def last_two(decomposition: TuckerDecomposition) -> list[float]:
        assert decomposition.factors[1].shape == (4, 2)
        return [0, 0.25, 2, 1]

    step = TensorStep(every=5, ranks=RANKS, weights=last_two, floor=0.125)
    learner = QLearning(PROBLEM, n_agents=2, epsilon=0.5, tensor_step=step, seed=3).learn(5)
    np.testing.assert_array_equal(learner.action_weights, [0.125, 0.25, 2.0, 1.0])


@pytest.mark.parametrize(
    "answer", [None, 1.0, [1.0] * 3, [[1.0] * 4], [1.0, 1.0, 1.0, -0.1], [np.nan] * 4, ["a"] * 4, [[1.0], [1.0, 2.0]]]
)
def test_wrong_answers_of_a_weights_function(answer: Any) -> None:
    learner = _learner(lambda decomposition: answer)
    with pytest.raises(
        ParameterError, match="weights function must return 4 finite numbers of at least 0, one for each"
    ):
        learner.learn(5)


def test_an_answer_larger_than_memory_is_refused_by_its_size() -> None:
    learner = _learner(lambda decomposition: np.broadcast_to(0.5, (10**6, 10**6)))
    with pytest.raises(MemoryError, match=r"\(1000000, 1000000\).*answer with fewer numbers"):
        learner.learn(5)


@pytest.mark.parametrize("weights", WEIGHTS)
def test_a_window_without_values_leaves_everything_as_it_is(weights: str) -> None:
    problem = TabularMDP([[0, 0]], [[0.0, 0.0]], [[True, True]])
    step = TensorStep(every=2, ranks=(1, 1, 1, 1), weights=weights, share="consensus")
    learner = QLearning(problem, n_agents=2, tensor_step=step, seed=0).learn(4)
    expected = np.sqrt(0.5) if weights == "constant" else 1.0  # the control does not ask the tables
    np.testing.assert_allclose(learner.action_weights, np.full(2, expected), rtol=1e-15)
    np.testing.assert_array_equal(learner.q, np.zeros((2, 1, 2)))
    assert learner.tensor_step_history.chosen.tolist() == [-1, -1]
    assert learner.tensor_step_history.ranks.tolist() == [[0] * 4] * 2
    assert np.isnan(learner.tensor_step_history.fit).all()


@pytest.mark.parametrize("weights", ["paper", "relative", "permuted"])
def test_a_weight_that_is_rounding_reads_as_zero(weights: str) -> None:
    factors = (np.eye(1), np.array([[0.8], [0.6], [1e-17]]), np.eye(1), np.eye(1))
    decomposition = TuckerDecomposition(np.ones((1, 1, 1, 1)), factors, fit=1.0, iterations=1)
    omega = WEIGHTINGS[weights].weigh(decomposition, 3, np.random.default_rng(0))
    assert omega.min() == 0.0
    assert np.count_nonzero(omega) == 2
