"""gamma = 1: what ends is solved, what does not is refused, with the states."""

import numpy as np
import pytest

import tuckerl
from tests.learners.worlds import corridor, random_mdp
from tests.reference.value_iteration import model_of, optimal_values
from tests.solving.problems import absorbing_mdp
from tuckerl import TabularMDP, solve
from tuckerl.errors import ProblemError
from tuckerl.solving.solve import METHODS


@pytest.mark.parametrize("method", METHODS)
def test_mazes_are_as_long_as_their_shortest_paths(method: str) -> None:
    maze = tuckerl.random_maze(9, 9, seed=2, start=(0, 0), goal=(8, 8))
    solution = solve(maze, 1.0, method)
    lengths = maze._distances().ravel()
    inside = lengths > 0
    np.testing.assert_array_equal(solution.v[inside], 1.0 - lengths[inside])
    assert np.isnan(solution.v[maze.walls.ravel()]).all(), "nobody comes there, and nobody leaves"
    assert solution.bound == 0.0, "whole numbers prove themselves"
    reached = tuckerl.policy_value(maze, solution.policy, 1.0)
    np.testing.assert_array_equal(reached, solution.v)


@pytest.mark.parametrize("method", METHODS)
def test_values_are_the_twins_where_every_policy_ends(method: str) -> None:
    for seed in (0, 1):
        mdp = random_mdp(seed, 8, 3, n_outcomes=3, ends=0.3)
        solution = solve(mdp, 1.0, method)
        np.testing.assert_allclose(solution.v, optimal_values(model_of(mdp), 1.0, 1e-13), atol=1e-9)
        assert solution.bound <= 1e-8
        np.testing.assert_allclose(tuckerl.policy_value(mdp, solution.policy, 1.0), solution.v, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_circles_that_cost_nothing_are_left(method: str) -> None:
    solution = solve("FrozenLake-v1", 1.0, method)
    np.testing.assert_allclose(solution.v[0], 14 / 17, atol=1e-9)  # known: 0.8235
    assert solution.bound == np.inf, "nothing is proven there, and said so"
    certain = solve(corridor(reward=0.0), 1.0, method)
    assert certain.v.tolist() == [0.0] * 5
    assert tuckerl.policy_value("FrozenLake-v1", solution.policy, 1.0)[0] == pytest.approx(14 / 17)


@pytest.mark.parametrize("method", METHODS)
def test_states_in_which_nothing_is_paid_any_more_are_ends(method: str) -> None:
    mdp = absorbing_mdp()
    solution = solve(mdp, 1.0, method)
    assert solution.v[2] == 0.0
    limit = solve(mdp, 1.0 - 1e-9, "policy-iteration")
    np.testing.assert_allclose(solution.v, limit.v, atol=1e-6)


def pit() -> TabularMDP:
    """From 0, on to the end or into 1, from where only 2 follows, and from there 1, at a cost."""
    return TabularMDP([[3, 1], [2, 2], [1, 1], [3, 3]], [[-1.0, 0.0], [-1.0, -1.0], [0.0, 0.0], [0.0, 0.0]],
                      [[True, False], [False, False], [False, False], [True, True]])  # fmt: skip


def bank(gain: float) -> TabularMDP:
    """From 0 to 1 and back gains something; state 1 may also end."""
    return TabularMDP([[1, 1], [0, 1]], [[2.0, 2.0], [gain - 2.0, 0.0]], [[False, False], [False, True]])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("problem", "message"),
    [
        (pit(), "from states 1, 2 no policy ends with probability 1.*use gamma below 1"),
        (TabularMDP([[0]], [[-1.0]], [[False]]), "from state 0 no policy ends"),
        (TabularMDP([[1, 0], [1, 1]], [[1.0, 0.0], [1.0, 1.0]], [[False] * 2] * 2), "from states 0, 1 no policy ends"),
    ],
)
def test_what_never_ends_is_refused_with_its_states(problem: TabularMDP, message: str, method: str) -> None:
    with pytest.raises(ProblemError, match=message):
        solve(problem, 1.0, method)


@pytest.mark.parametrize("method", METHODS)
def test_gains_without_an_end_are_refused_with_their_states(method: str) -> None:
    with pytest.raises(ProblemError, match=r"no bound: a policy can stay in states 0, 1 for ever, and gain"):
        solve(bank(0.5), 1.0, method)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_lost_in_circles_ends(method: str) -> None:
    for gain in (-0.5, 0.0):
        solution = solve(bank(gain), 1.0, method)
        assert solution.v.tolist() == [2.0, 0.0]
        assert solution.policy.tolist() == [0, 1]


@pytest.mark.parametrize("method", METHODS)
def test_states_that_nobody_visits_may_go_on_for_ever(method: str) -> None:
    mdp = TabularMDP([[0], [1]], [[3.0], [-1.0]], [[True], [False]], start=0)
    solution = solve(mdp, 1.0, method)
    assert solution.v[0] == 3.0
    assert np.isnan(solution.v[1])
    with pytest.raises(ProblemError, match="from state 1 no policy ends"):
        solve(TabularMDP([[0], [1]], [[3.0], [-1.0]], [[True], [False]], start=[0.5, 0.5]), 1.0, method)
