"""R-max: numbers worked out by hand, RiverSwim's known optimum, and what it refuses."""

from typing import Any

import numpy as np
import pytest

from tests.learners.book_problems import river_swim
from tests.learners.stepped_worlds import TableEnv
from tests.learners.test_update import one_way
from tests.learners.worlds import corridor, drift
from tests.reference.value_iteration import action_values, average_reward, greedy_policy, model_of, optimal_values
from tuckerl import QLearning, RMax, TabularMDP, TensorStep, load
from tuckerl.errors import ImmutableError, ParameterError, ProblemError


def test_r_max_by_hand() -> None:
    # Each step costs 1, the last pays 10; gamma 0.5. Nothing is known: 10 / (1 - 0.5) = 20. With m = 1 all is after one
    # episode: 10, -1 + 5 = 4, -1 + 2 = 1. With m = 2 all is as before until the second episode.
    once, twice = (RMax(one_way(3), m=m, gamma=0.5, seed=0) for m in (1, 2))
    assert (once.q == 20.0).all()
    np.testing.assert_array_equal(once.learn(1).q[0, :, 0], [1.0, 4.0, 10.0])
    np.testing.assert_array_equal(twice.learn(1).q[0, :, 0], [20.0, 20.0, 20.0])
    np.testing.assert_array_equal(twice.learn(1).q[0, :, 0], [1.0, 4.0, 10.0])


def test_what_is_negative_everywhere_is_hoped_to_end_at_once() -> None:
    # -1 / (1 - 0.5) = -2 is what an endless episode costs; the best is -1, a single step.
    assert (RMax(corridor(), gamma=0.5, seed=0).q == -1.0).all()
    assert (RMax(corridor(), gamma=0.5, r_max=0.0, seed=0).q == 0.0).all()
    assert (RMax(corridor(), gamma=0.5, initial_q=3.0, seed=0).q == 3.0).all()


def test_a_truncated_step_bootstraps() -> None:
    learner = RMax(one_way(3, limit=1), m=1, gamma=0.5, initial_q=8.0, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [3.0, 8.0, 8.0])


def test_outcomes_are_counted() -> None:
    # One state, ends half of the time: with m = 400 trials, Q = r / (1 - gamma p) with p near a half.
    coin = TabularMDP([[[0, 0]]], [[[1.0, 1.0]]], [[[True, False]]], [[[0.5, 0.5]]], max_episode_steps=100)
    learner = RMax(coin, m=400, gamma=0.9, seed=1).learn(300)
    counted = learner.declared[0]["model.counted"][0, 0, :2]
    assert counted["count"].sum() == 400
    goes_on = counted["count"][counted["discount"] > 0.0][0] / 400
    assert abs(goes_on - 0.5) < 0.1
    assert learner.q[0, 0, 0] == pytest.approx(1.0 / (1.0 - 0.9 * goes_on), abs=1e-5)


def test_r_max_swims_up_the_river_where_a_greedy_learner_stays_at_its_mouth() -> None:
    problem, gamma = river_swim(steps=5000), 0.95
    model = model_of(problem)
    best = greedy_policy(model, action_values(model, optimal_values(model, gamma), gamma))
    assert best.tolist() == [1] * 6  # always against the current
    optimum = average_reward(model, best)
    # By hand: places are met in the ratio 1, 3, 9, 27, 81, 81 x 3 / 7, and 0.3 of the visits to the spring pay 10,000.
    assert optimum == pytest.approx(3000.0 * (243 / 7) / (121 + 243 / 7))
    curious = RMax(problem, m=20, gamma=gamma, n_agents=5, seed=0).learn(2)
    greedy = QLearning(problem, alpha=0.1, gamma=gamma, epsilon=0.1, n_agents=5, seed=0).learn(2)
    assert (curious.returns[1] / 5000 > 0.85 * optimum).all()
    assert (greedy.returns[1] / 5000 < 0.1 * optimum).all()


# What it needs, and what it refuses


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"m": 0}, ParameterError, "m must be a whole number from 1 to .*; got 0"),
        (
            {"gamma": 1.0},
            ParameterError,
            "gamma must be below 1 in RMax, as what is not known would be worth infinitely",
        ),
        ({"gamma": 1.5}, ParameterError, r"gamma must be a number in \[0, 1\]"),
        ({"tol": 0.0}, ParameterError, "tol must be a finite number above 0"),
        ({"r_max": -2.0}, ParameterError, "r_max must be at least -1, the largest reward in the problem's .*; got -2"),
        ({"r_max": float("inf")}, ParameterError, "r_max must be a finite number"),
        ({"r_max": 1e308}, ParameterError, r"r_max / \(1 - gamma\) must be finite; got r_max=1e\+308 and gamma=0.95"),
        ({"tensor_step": TensorStep(2, (1, 1, 1, 1))}, ParameterError, 'must have weights="none": R-max computes its'),
        (
            {"tensor_step": TensorStep(2, (1, 1, 1, 1), weights="none")},
            ParameterError,
            "must have share=\"none\": R-max computes each agent's table anew from the agent's own model",
        ),
    ],
)
def test_impossible_parameters_are_refused(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        RMax(corridor(), **parameters)


def test_a_bound_must_be_given_where_none_is_known() -> None:
    with pytest.raises(
        ProblemError, match="RMax needs a bound on rewards, and of this problem none is known: pass r_ma"
    ):
        RMax(drift())
    assert RMax(drift(), r_max=0.25, seed=0).learn(2).episodes == 2


def test_observations_in_bins_are_cut_once(tmp_path: Any) -> None:
    learner = RMax("MountainCar-v0", bins=3, r_max=-1.0, seed=0)
    assert learner.problem.n_states == 9
    learner.tol = 1e-3  # by the constructor
    learner.save(tmp_path / "agent")
    assert load(tmp_path / "agent").problem.n_states == 9
    with pytest.raises(ParameterError, match="bins are for environments whose observations are a Box"):
        RMax(corridor(), bins=3)


def test_a_reward_above_the_bound_ends_learning() -> None:
    learner = RMax(TableEnv(one_way(3)), r_max=5.0, m=1, seed=0)
    with pytest.raises(
        ParameterError, match=r"a step from state 2 by action 0 paid 10, more than r_max=5: make a new RM"
    ):
        learner.learn(1)
    assert learner.episodes == 0
    assert learner.diverged_at is None
    np.testing.assert_array_equal(learner.q, RMax(TableEnv(one_way(3)), r_max=5.0, m=1, seed=0).q)


def test_what_its_table_was_made_by_cannot_change(tmp_path: Any) -> None:
    learner = RMax(corridor(), seed=0).learn(2)
    for name in ("r_max", "m", "gamma", "bootstrap_terminal"):
        with pytest.raises(ImmutableError, match=f"{name} cannot change once a learner is made"):
            setattr(learner, name, 0.5)
    learner.tol = 1e-3
    learner.policy = None
    assert learner.epsilon == 0.0
    learner.save(tmp_path / "agent")
    again = load(tmp_path / "agent")
    assert isinstance(again, RMax)
    assert (again.tol, again.r_max, again.m, again.epsilon) == (1e-3, -1.0, 10, 0.0)
