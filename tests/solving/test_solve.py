"""Optimal values, by four methods: the twin's, QuantEcon's, Puterman's; and bounds that are bounds."""

import re
from fractions import Fraction
from typing import Any

import gymnasium
import numpy as np
import pytest

import tuckerl
from tests.learners.worlds import drift, random_mdp
from tests.reference.value_iteration import action_values, exact_optimum, model_of, optimal_values
from tests.solving.problems import PROBLEMS, inventory, never_ending_mdp, quantecon_values, two_states
from tuckerl import TabularMDP, solve
from tuckerl.errors import (
    NoTableError,
    ParameterError,
    ParameterTypeError,
    ProblemError,
    SolverError,
    TableSizeError,
    UnknownNameError,
)
from tuckerl.solving.solve import METHODS

SWEEPING = ("value-iteration", "modified-policy-iteration")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("gamma", [0.0, 0.5, 0.9])
def test_values_are_the_twins(name: str, method: str, gamma: float) -> None:
    mdp = PROBLEMS[name]()
    model = model_of(mdp)
    expected = optimal_values(model, gamma)
    solution = solve(mdp, gamma, method, tol=1e-10)
    np.testing.assert_allclose(solution.v, expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(solution.q, action_values(model, expected, gamma), rtol=0, atol=1e-9)
    assert solution.bound <= 1e-10
    assert solution.iterations >= 1 or method == "linear-programming", "HiGHS may need no step"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_values_are_quantecons(name: str, method: str) -> None:
    for gamma in (0.0, 0.95, 0.9999):
        mdp = PROBLEMS[name]()
        peers, solution = quantecon_values(mdp, gamma), solve(mdp, gamma, method)
        assert solution.bound <= (1e-6 if gamma == 0.9999 else 1e-8), "at 0.9999, rounding is seen"
        np.testing.assert_allclose(solution.v, peers, rtol=0, atol=solution.bound + 1e-9 * np.abs(peers).max())


@pytest.mark.parametrize("method", METHODS)
def test_putermans_two_states(method: str) -> None:
    solution = solve(two_states(), 0.95, method, tol=1e-10)
    np.testing.assert_allclose(solution.v, [-60 / 7, -20], atol=1e-9)
    assert solution.policy.tolist() == [0, 0]
    assert solution.q[1, 1] == -np.inf


@pytest.mark.parametrize("method", METHODS)
def test_putermans_inventory(method: str) -> None:
    solution = solve(inventory(3), 1.0, method)
    expected = np.array([[67 / 16, 129 / 16, 194 / 16, 227 / 16], [2, 25 / 4, 10, 21 / 2], [0, 5, 6, 5]])
    np.testing.assert_allclose(solution.v.reshape(3, 4), expected, atol=1e-12)
    assert solution.policy[:4].tolist() == [3, 0, 0, 0], "order three where there is nothing, else none"
    assert solution.bound <= 1e-8


@pytest.mark.parametrize("method", SWEEPING)
def test_bounds_hold_without_any_rounding(method: str) -> None:
    largest = 0.0
    for seed in range(6):
        mdp = random_mdp(seed, 3, 2, n_outcomes=2, ends=0.2 if seed % 2 else 0.0)
        for gamma, tol in ((0.75, 1.0), (0.9921875, 0.1), (0.9921875, 1e-13)):
            solution = solve(mdp, gamma, method, tol)
            exact = exact_optimum(mdp, Fraction(gamma))
            error = max(abs(Fraction(v) - best) for v, best in zip(solution.v.tolist(), exact, strict=True))
            assert error <= solution.bound
            assert solution.bound <= tol or tol == 1e-13
            largest = max(largest, float(error) / solution.bound)
    assert largest > 0.01, "the bound is not far from what it bounds"


@pytest.mark.parametrize("method", METHODS)
def test_q_v_and_policy_belong_together(method: str) -> None:
    for seed, gamma in ((0, 0.9), (1, 0.99)):
        mdp = random_mdp(seed, 12, 3, n_outcomes=2)
        solution, model = solve(mdp, gamma, method, tol=1e-3), model_of(mdp)
        np.testing.assert_array_equal(solution.v, solution.q.max(axis=1))
        np.testing.assert_array_equal(solution.policy, solution.q.argmax(axis=1))
        consistent = action_values(model, solution.v, gamma)
        assert np.abs(solution.q - consistent).max() <= 2 * solution.bound
        # A greedy policy by values within the bound loses at most 2 gamma bound / (1 - gamma) (Singh and Yee 1994).
        reached = tuckerl.policy_value(mdp, solution.policy, gamma)
        exact = solve(mdp, gamma, tol=1e-11).v
        assert (exact - reached).max() <= 2 * solution.bound / (1 - gamma) + 1e-9


def test_policies_get_better_until_none_is() -> None:
    mdp = never_ending_mdp(5)
    policy = np.zeros(8, dtype=np.int64)
    values = tuckerl.policy_value(mdp, policy)
    for _ in range(20):
        policy = action_values(model_of(mdp), values, 0.95).argmax(axis=1)
        better = tuckerl.policy_value(mdp, policy)
        assert (better >= values - 1e-12).all()
        values = better
    solution = solve(mdp, method="policy-iteration")
    np.testing.assert_allclose(solution.v, values, atol=1e-10)
    assert 1 <= solution.iterations <= 5


def test_environments_are_solved_by_what_they_carry() -> None:
    lake = solve("FrozenLake-v1", 0.95)
    for env in (gymnasium.make("FrozenLake-v1", max_episode_steps=3), lambda: gymnasium.make("FrozenLake-v1")):
        np.testing.assert_array_equal(solve(env, 0.95).v, lake.v)  # a time limit is no end
    assert solve(tuckerl.sutton_maze(), 1.0).v[18] == -13.0  # 14 steps, of which the last costs nothing
    assert solve("CliffWalking-v1", 1.0).v[36] == -13.0
    assert solve("tuckerl/RobotRescue-v0", 0.9).q.shape == (36864, 25)


class Told(gymnasium.Env[Any, Any]):
    """A class of a user's own that carries a table, and may play another."""

    observation_space, action_space = gymnasium.spaces.Discrete(2), gymnasium.spaces.Discrete(1)

    def __init__(self, reward: float = 1.0) -> None:
        self.P = {0: {0: [(1.0, 1, 1.0, False)]}, 1: {0: [(1.0, 0, 0.0, True)]}}
        self.initial_state_distrib, self.reward, self.state = np.array([1.0, 0.0]), reward, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.state = 0
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.state += 1
        return self.state % 2, self.reward if self.state == 1 else 0.0, self.state == 2, False, {}


def test_a_users_table_is_believed_if_it_is_played() -> None:
    assert solve(Told()).v.tolist() == [1.0, 0.0]
    with pytest.raises(NoTableError, match=r"reward 2.0 .*which its table does not hold: make a tuckerl.TabularMDP"):
        solve(Told(2.0))


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ("CartPole-v1", "no transition table .* can be extracted from CartPole-v1: make a tuckerl.TabularMDP"),
        ("tuckerl/CartPole-v0", "Simulator.* is played by code: make a tuckerl.TabularMDP"),
        (drift(), "Simulator.* is played by code"),
    ],
)
def test_what_has_no_table_is_refused_by_name(env: Any, message: str) -> None:
    with pytest.raises(NoTableError, match=message):
        solve(env)
    with pytest.raises(NoTableError, match=message):
        tuckerl.policy_value(env, [0])


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ({"gamma": 1.01}, ParameterError, r"gamma must be a number in \[0, 1\]; got 1.01"),
        ({"gamma": -0.1}, ParameterError, r"gamma must be a number in \[0, 1\]"),
        ({"gamma": float("nan")}, ParameterError, "gamma must be"),
        ({"gamma": "1"}, ParameterTypeError, "gamma must be"),
        ({"method": "value_iteration"}, UnknownNameError, "did you mean 'value-iteration'"),
        ({"method": None}, ParameterTypeError, "method must be one of"),
        ({"tol": 0.0}, ParameterError, "tol must be a finite number above 0; got 0.0"),
        ({"tol": -1e-8}, ParameterError, "tol must be a finite number above 0"),
        ({"env": 3}, ParameterTypeError, "env must be"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        solve(**({"env": two_states()} | arguments))


def test_rewards_that_leave_the_range_of_floats_are_refused() -> None:
    huge = TabularMDP([[0]], [[1e300]], [[False]])
    with pytest.raises(ProblemError, match=r"rewards of up to 1e\+300 with gamma=0.95 .*scale the rewards down"):
        solve(huge)


def test_a_programme_that_does_not_fit_is_not_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    maze = tuckerl.Maze(np.zeros((300, 300), dtype=bool), (0, 0), (299, 299))
    monkeypatch.setattr("tuckerl.memory.available_memory", lambda: 100 * 2**20)
    with pytest.raises(TableSizeError, match=r"the linear programme would take .*use method='value-iteration'"):
        solve(maze, method="linear-programming")
    assert solve(maze).bound <= 1e-8


def test_a_programme_that_fails_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    class Failed:
        status, message = 4, "Numerical difficulties encountered."

    monkeypatch.setattr("tuckerl.solving.linear_programming.linprog", lambda *given, **more: Failed())
    message = re.escape("the linear programme of 2 states was not solved (Numerical difficulties")
    with pytest.raises(SolverError, match=message):
        solve(two_states(), method="linear-programming")


def test_a_solution_is_shown_in_a_line() -> None:
    assert re.fullmatch(r"Solution\(2 states, iterations=\d+, bound=\S+\)", repr(solve(two_states())))
