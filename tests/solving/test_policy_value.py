"""Values of policies: the twin's, and what episodes return on the average."""

import re
from typing import Any

import numpy as np
import pytest

import tuckerl
from tests.reference.value_iteration import distribution_values, model_of, policy_values
from tests.solving.problems import PROBLEMS, absorbing_mdp, two_states
from tuckerl import TabularMDP, policy_value
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.solving import policy_value as solvers
from tuckerl.types import FloatArray


@pytest.mark.parametrize("name", PROBLEMS)
def test_values_are_the_twins(name: str) -> None:
    mdp, rng = PROBLEMS[name](), np.random.default_rng(0)
    model = model_of(mdp)
    probabilities = np.where(model.allowed, rng.random(model.allowed.shape), 0.0)
    probabilities /= probabilities.sum(axis=1, keepdims=True)
    actions = probabilities.argmax(axis=1)
    for gamma in (0.0, 0.9, 0.999):
        expected = distribution_values(model, probabilities, gamma)
        np.testing.assert_allclose(policy_value(mdp, probabilities, gamma), expected, rtol=1e-10, atol=1e-9)
        expected = policy_values(model, actions, gamma)
        np.testing.assert_allclose(policy_value(mdp, actions, gamma), expected, rtol=1e-10, atol=1e-9)
        certain = np.eye(mdp.n_actions)[actions]
        np.testing.assert_allclose(policy_value(mdp, certain, gamma), expected, rtol=1e-10, atol=1e-9)


def test_episodes_return_the_value_on_the_average() -> None:
    mdp = PROBLEMS["random"]()
    uniform = np.full((7, 3), 1 / 3)
    value = policy_value(mdp, uniform, 0.9)[0]
    rng, model = np.random.default_rng(0), model_of(mdp)
    returns = [_discounted(model, rng) for _ in range(2000)]
    error = np.std(returns) / np.sqrt(len(returns))
    assert abs(np.mean(returns) - value) < 4 * error < 0.5


def _discounted(model: Any, rng: np.random.Generator) -> float:
    """The discounted return of an episode of random actions from state 0, over 100 steps."""
    state, total = 0, 0.0
    for step in range(100):
        action = rng.integers(3)
        total += 0.9**step * model.reward[state, action]
        next_state = int((model.transition[state, action].cumsum() <= rng.random()).sum())
        if next_state == 7:
            break
        state = next_state
    return total


def test_all_solvers_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    maze = tuckerl.random_maze(20, 20, seed=1, start=(0, 0), goal=(19, 19))
    uniform = np.full((400, 4), 0.25)
    monkeypatch.setattr(solvers, "_SMALL", 1000)
    directly = policy_value(maze, uniform, 0.99)
    monkeypatch.setattr(solvers, "_SMALL", 10)
    iterated: list[FloatArray | None] = []
    original = solvers._iterated

    def listening(*given: Any) -> FloatArray | None:
        iterated.append(original(*given))
        return iterated[-1]

    monkeypatch.setattr(solvers, "_iterated", listening)
    np.testing.assert_allclose(policy_value(maze, uniform, 0.99), directly, rtol=1e-9)
    assert iterated[0] is not None, "BiCGSTAB was asked, and found it"
    monkeypatch.setattr(solvers, "_iterated", lambda *given: None)
    np.testing.assert_allclose(policy_value(maze, uniform, 0.99), directly, rtol=1e-12)  # by SuperLU
    certain = np.zeros(400, dtype=np.int64)
    factorised = policy_value(maze, certain, 0.99)
    monkeypatch.setattr(solvers, "_SMALL", 1000)
    np.testing.assert_allclose(factorised, policy_value(maze, certain, 0.99), rtol=1e-12)


def test_without_a_discount() -> None:
    maze = tuckerl.sutton_maze()
    values = policy_value(maze, np.full((54, 4), 0.25), 1.0)
    assert values[8] == 0.0 or np.isfinite(values[8])
    walls = maze.walls.ravel()
    assert np.isnan(values[walls]).all(), "nobody comes there, and nobody leaves"
    assert np.isfinite(values[~walls]).all()
    assert policy_value(absorbing_mdp(), [0, 0, 0], 1.0)[2] == 0.0, "where nothing is paid any more"


def test_a_policy_that_goes_on_for_ever_is_refused_without_a_discount() -> None:
    maze = tuckerl.sutton_maze()
    with pytest.raises(ProblemError, match=r"with gamma=1 the policy must end .*: in state 18 it goes on for ever"):
        policy_value(maze, np.full(54, 2), 1.0)
    lake = policy_value("FrozenLake-v1", np.zeros(16, dtype=int), 1.0)
    assert lake[0] == 0.0, "it may go on for ever if it is paid nothing"


@pytest.mark.parametrize(
    ("policy", "kind", "message"),
    [
        (
            [0],
            ParameterError,
            r"policy must be 2 actions, one for each state, or .* shape \(2, 2\); got .* shape \(1,\)",
        ),
        ([[0, 1]], ParameterError, r"got an array of shape \(1, 2\)"),
        ([[0, 1], [1]], ParameterError, "policy must be 2 actions"),
        ([0.0, 1.0], ParameterTypeError, "dtype float64"),
        ([True, False], ParameterTypeError, "dtype bool"),
        ([0, 2], ParameterError, "policy must hold actions from 0 to 1; got 2 in state 1"),
        ([-1, 0], ParameterError, "got -1 in state 0"),
        ([0, 1], ParameterError, "forbids action 1 in state 1"),
        ([[1, 0], [0.5, 0.5]], ParameterError, "forbids action 1 in state 1"),
        ([[0.5, 0.6], [1, 0]], ParameterError, r"sum to 1 in each state; those of state 0 are \[0.5 0.6\]"),
        ([[1.5, -0.5], [1, 0]], ParameterError, "at least 0"),
        ([[np.nan, 1], [1, 0]], ParameterError, "state 0"),
        (np.ma.masked_array([0, 0]), ParameterTypeError, "policy"),
        ("up", ParameterError, "policy must be 2 actions"),
    ],
)
def test_bad_policies(policy: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        policy_value(two_states(), policy)


def test_bad_gamma_and_rewards() -> None:
    with pytest.raises(ParameterError, match=re.escape("gamma must be a number in [0, 1]; got 1.5")):
        policy_value(two_states(), [0, 0], 1.5)
    with pytest.raises(ProblemError, match="scale the rewards down"):
        policy_value(TabularMDP([[0]], [[1e300]], [[False]]), [0])
