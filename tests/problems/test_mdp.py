"""TabularMDP: what it keeps and what it refuses."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.problems.mdp import OUTCOME, TabularMDP
from tuckerl.problems.parts import NO_LIMIT

GOOD: dict[str, Any] = {
    "next_state": [[0, 1], [0, 1]],
    "reward": [[0.0, 1.0], [0.0, 0.0]],
    "terminated": [[False, True], [True, True]],
}
# Two outcomes for each pair; (0, 0) is certain and (0, 1) is not.
RISKY: dict[str, Any] = {
    "next_state": [[[0, 1], [0, 1]], [[0, 1], [0, 1]]],
    "reward": [[[0, 9], [1, 2]], [[3, 9], [4, 5]]],
    "terminated": [[[False, True], [False, True]], [[True, True], [True, True]]],
    "probability": [[[1, 0], [0.25, 0.75]], [[1, 0], [0.5, 0.5]]],
}


def test_one_outcome_each() -> None:
    mdp = TabularMDP(**GOOD, start=1, max_episode_steps=7, heuristic=[2, 0])
    arrays = mdp.arrays
    assert (mdp.n_states, mdp.n_actions, mdp.max_episode_steps) == (2, 2, 7)
    assert arrays.next_state.tolist() == [0, 1, 0, 1]
    assert arrays.reward.tolist() == [0, 1, 0, 0]
    assert arrays.terminated.tolist() == [False, True, True, True]
    assert arrays.offsets.size == arrays.cumulative.size == 0
    assert arrays.start_state.tolist() == [1]
    assert arrays.max_episode_steps == 7
    assert np.asarray(mdp.heuristic).tolist() == [2, 0]
    assert repr(mdp) == "TabularMDP(2 states, 2 actions, 4 outcomes, max_episode_steps=7)"
    dtypes = [a.dtype for a in arrays if isinstance(a, np.ndarray)]
    assert dtypes == [OUTCOME, np.int64, np.float64, np.uint32, np.float64, np.bool_]


def test_several_outcomes_and_those_of_probability_0_dropped() -> None:
    arrays = TabularMDP(**RISKY).arrays
    assert arrays.next_state.tolist() == [0, 0, 1, 0, 0, 1]
    assert arrays.reward.tolist() == [0, 1, 2, 3, 4, 5]
    assert arrays.terminated.tolist() == [False, False, True, True, True, True]
    assert arrays.offsets.tolist() == [0, 1, 3, 4, 6]
    assert arrays.cumulative.tolist() == [1, 0.25, 1, 1, 0.5, 1]


def test_certain_outcomes_among_several_make_a_deterministic_problem() -> None:
    arrays = TabularMDP(**{**RISKY, "probability": [[[1, 0], [0, 1]], [[1, 0], [0, 1]]]}).arrays
    assert arrays.offsets.size == 0
    assert arrays.next_state.tolist() == [0, 1, 0, 1]
    assert arrays.reward.tolist() == [0, 2, 3, 5]


def test_start_distribution() -> None:
    arrays = TabularMDP([[0], [1], [2]], [[0], [0], [0]], [[True]] * 3, start=[0.5, 0, 0.5]).arrays
    assert arrays.start_state.tolist() == [0, 2]
    assert arrays.start_cumulative.tolist() == [0.5, 1]


def test_arrays_are_read_only_copies() -> None:
    reward = np.array(GOOD["reward"])
    heuristic = np.array([2.0, 0.0])
    mdp = TabularMDP(**{**GOOD, "reward": reward}, heuristic=heuristic)
    reward[0, 1] = heuristic[0] = 99
    assert mdp.arrays.reward[1] == 1
    assert np.asarray(mdp.heuristic)[0] == 2
    assert not any(a.flags.writeable for a in (*mdp.arrays, mdp.heuristic) if isinstance(a, np.ndarray))


def test_time_limit_can_be_changed_and_removed() -> None:
    mdp = TabularMDP(**GOOD, heuristic=[1, 0])
    assert mdp.max_episode_steps is None
    assert mdp.arrays.max_episode_steps == NO_LIMIT
    limited = mdp.with_time_limit(5)
    assert (limited.max_episode_steps, limited.arrays.max_episode_steps) == (5, 5)
    assert limited.arrays.outcomes is mdp.arrays.outcomes
    assert limited.heuristic is mdp.heuristic
    assert (limited.n_states, limited.n_actions) == (2, 2)
    assert limited.with_time_limit(None).max_episode_steps is None
    assert mdp.with_time_limit(10**30).max_episode_steps is None  # what kernels cannot count to is no limit
    with pytest.raises(ParameterError, match="max_episode_steps must be a whole number of at least 1; got 0"):
        mdp.with_time_limit(0)


def test_actions_of_several_agents() -> None:
    arrays: dict[str, Any] = {"next_state": [[0] * 6], "reward": [[0] * 6], "terminated": [[True] * 6]}
    assert TabularMDP(**arrays).action_sizes == (6,)
    mdp = TabularMDP(**arrays, action_sizes=[2, 3])
    assert mdp.action_sizes == (2, 3)
    assert mdp.with_time_limit(5).action_sizes == (2, 3)
    assert TabularMDP.from_arrays(mdp.arrays, 1).action_sizes == (6,)
    assert TabularMDP.from_arrays(mdp.arrays, 1, None, mdp.action_sizes).action_sizes == (2, 3)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"next_state": [0, 1]}, ProblemError, r"next_state must have the shape \(S, A\).*got \(2,\)"),
        ({"next_state": [[[0]]]}, ProblemError, r"or \(S, A, K\) with probability.*got \(1, 1, 1\)"),
        ({"next_state": np.zeros((2, 0), dtype=int)}, ProblemError, r"no axis empty; got \(2, 0\)"),
        ({"next_state": [[0, 1], [0]]}, ProblemError, r"next_state must be one array; .*inhomogeneous"),
        ({"next_state": [[0.0, 1.0], [0.0, 1.0]]}, ParameterTypeError, r"next_state must hold integers; got .*float64"),
        ({"next_state": [[0, 1], [2, 1]]}, ProblemError, r"from 0 to 1; got 2 for \(s, a\) = \(1, 0\)"),
        ({"next_state": [[0, -1], [0, 1]]}, ProblemError, r"from 0 to 1; got -1 for \(s, a\) = \(0, 1\)"),
        ({"reward": [[0, 1]]}, ProblemError, r"reward must have the shape of next_state, \(2, 2\); got \(1, 2\)"),
        ({"reward": [["a", "b"], ["c", "d"]]}, ParameterTypeError, r"reward must hold numbers"),
        ({"reward": [[0, math.nan], [0, 0]]}, ProblemError, r"reward must be finite everywhere"),
        ({"reward": [[0, math.inf], [0, 0]]}, ProblemError, r"reward must be finite everywhere"),
        ({"terminated": [[0, 1], [1, 1]]}, ParameterTypeError, r"terminated must hold booleans; got dtype int64"),
        ({"terminated": [[True, False]]}, ProblemError, r"terminated must have the shape of next_state"),
        ({"start": 2}, ParameterError, r"start must be a whole number from 0 to 1; got 2"),
        ({"start": None}, ParameterTypeError, r"start must be a whole number"),
        ({"start": [1.0]}, ProblemError, r"start must be a state or 2 probabilities.*got shape \(1,\)"),
        ({"start": [0.5, 0.6]}, ProblemError, r"start's probabilities must .* sum to 1"),
        ({"start": [-1, 2]}, ProblemError, r"start's probabilities must be at least 0"),
        ({"start": [math.nan, 1]}, ProblemError, r"start's probabilities"),
        ({"start": [math.inf, -math.inf]}, ProblemError, r"start's probabilities"),
        ({"start": ["a", "b"]}, ParameterTypeError, r"start must hold numbers"),
        ({"max_episode_steps": 0}, ParameterError, r"max_episode_steps must be .* at least 1; got 0"),
        ({"max_episode_steps": 2.0}, ParameterTypeError, r"max_episode_steps must be a whole number"),
        ({"action_sizes": (2, 2)}, ProblemError, r"must multiply to the number of actions, 2; got \(2, 2\)$"),
        ({"action_sizes": ()}, ProblemError, r"must multiply to the number of actions, 2; got \(\)$"),
        ({"action_sizes": (-1, -2)}, ParameterError, r"each of action_sizes must be .* at least 1; got -1"),
        ({"action_sizes": (2.0,)}, ParameterTypeError, r"each of action_sizes must be a whole number"),
        ({"action_sizes": 2}, ParameterTypeError, r"action_sizes must be one whole number for each agent; got 2"),
        ({"heuristic": [1, 2, 3]}, ProblemError, r"heuristic must be 2 finite numbers.*got an array of shape \(3,\)$"),
        (
            {"heuristic": np.broadcast_to(0.0, (10**6, 10**6))},
            ProblemError,
            r"got an array of shape \(1000000, 1000000\)$",
        ),
        ({"action_names": ["up", 10**5000]}, ProblemError, "action_names must be 2 names.*cannot be written"),
        ({"heuristic": [1, math.inf]}, ProblemError, r"heuristic must be 2 finite numbers.*not finite"),
        ({"heuristic": ["a", "b"]}, ParameterTypeError, r"heuristic must hold numbers"),
    ],
)
def test_bad_problems_are_refused(change: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        TabularMDP(**{**GOOD, **change})


@pytest.mark.parametrize(
    ("probability", "error", "message"),
    [
        ([[[1], [1]], [[1], [1]]], ProblemError, r"shape of next_state, \(2, 2, 2\); got \(2, 2, 1\)"),
        ([[[1, 0], [0.5, 0.4]], [[1, 0], [1, 0]]], ProblemError, r"sum to 1; those of \(s, a\) = \(0, 1\)"),
        ([[[1, 0], [1, 0]], [[2, -1], [1, 0]]], ProblemError, r"at least 0 .* those of \(s, a\) = \(1, 0\)"),
        ([[[1, 0], [1, math.nan]], [[1, 0], [1, 0]]], ProblemError, r"those of \(s, a\) = \(0, 1\)"),
        ([[[1, 0], [1, 0]], [[1, 0], [math.inf, -math.inf]]], ProblemError, r"those of \(s, a\) = \(1, 1\)"),
        ([[["1", "0"]] * 2] * 2, ParameterTypeError, r"probability must hold numbers"),
    ],
)
def test_bad_probabilities_are_refused(probability: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        TabularMDP(**{**RISKY, "probability": probability})


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_probabilities_that_sum_to_1_within_their_own_rounding_are_normalised(dtype: type) -> None:
    thirds: NDArray[Any] = np.full((1, 1, 3), 1 / 3, dtype=dtype)
    assert abs(thirds.astype(np.float64).sum() - 1) > 1e-8
    parts = [[[0, 0, 0]]], np.zeros((1, 1, 3)), np.ones((1, 1, 3), dtype=np.bool_)
    mdp = TabularMDP(*parts, thirds, start=np.ones(1, dtype=dtype))
    np.testing.assert_allclose(mdp.arrays.cumulative, [1 / 3, 2 / 3, 1.0], rtol=1e-15)
    with pytest.raises(ProblemError, match=r"sum is (1\.000|0\.999).* \(1e-08 is .*: divide them by it, in float64"):
        TabularMDP(*parts, thirds.astype(np.float64) + 1e-7)


def test_rewards_of_minus_infinity_are_answered_by_the_mask() -> None:
    with pytest.raises(ProblemError, match=r"reward must be finite everywhere.*say by action_mask which actions"):
        TabularMDP(**GOOD | {"reward": [[0.0, -math.inf], [0.0, 0.0]]})


def test_probability_needs_an_axis_of_outcomes() -> None:
    with pytest.raises(ProblemError, match=r"\(S, A, K\) as probability is given.*got \(2, 2\)"):
        TabularMDP(**GOOD, probability=[[1, 1], [1, 1]])


def test_negative_probabilities_are_refused_even_if_the_sum_is_1() -> None:
    with pytest.raises(ProblemError, match=r"those of \(s, a\) = \(0, 0\) are \[ ?0\.9 +0\.6 +-0\.5\]"):
        TabularMDP([[[0, 0, 0]]], [[[0, 0, 0]]], [[[True] * 3]], [[[0.9, 0.6, -0.5]]])


@pytest.mark.parametrize("off", [1e-6, -1e-6])
def test_sums_of_probabilities_are_1_to_eight_digits(off: float) -> None:
    probability = np.array(RISKY["probability"], dtype=np.float64)
    probability[1, 1, 0] += off
    with pytest.raises(ProblemError, match=r"must be at least 0 and sum to 1; those of \(s, a\) = \(1, 1\)"):
        TabularMDP(**{**RISKY, "probability": probability})
    with pytest.raises(ProblemError, match="start's probabilities must be at least 0 and sum to 1"):
        TabularMDP(**GOOD, start=[0.5, 0.5 + off])
    probability[1, 1, 0] -= off * 0.999
    TabularMDP(**{**RISKY, "probability": probability})
