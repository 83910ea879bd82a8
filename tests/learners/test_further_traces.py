"""Watkins' Q(lambda) and true online SARSA(lambda): twins that sweep, numbers by hand, the forward view, the book.

With epsilon 1 each action comes from the stream alone, so that rounding cannot change a trajectory. Where greedy
actions are compared as well, no sum rounds.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.matching import compare, compare_with_step, goes_on_through_files, twin_of
from tests.learners.test_masks import masked_mdp
from tests.learners.worlds import corridor, random_maze, random_mdp
from tests.reference.true_online_sarsa_lambda import online_lambda_return
from tuckerl import QLearning, Sarsa, SarsaLambda, TabularMDP, TeamQ, TensorStep, TrueOnlineSarsaLambda, WatkinsQLambda
from tuckerl.errors import DivergenceWarning, ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.types import FloatArray

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_states=11, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "short limit": random_mdp(5, limit=1),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "many actions": random_mdp(8, n_states=9, n_actions=12, limit=40),
    "masked": masked_mdp(3, n_outcomes=2),
}
VARIANTS: dict[str, tuple[Any, dict[str, Any]]] = {
    "replacing": (WatkinsQLambda, {}),
    "accumulating": (WatkinsQLambda, {"trace": "accumulating"}),
    "carried": (WatkinsQLambda, {"trace": "accumulating", "carry_trace": True}),
    "dutch": (TrueOnlineSarsaLambda, {}),
}
NUMBERS = [(0.1, 0.95, 0.95), (1.0, 0.9, 0.5), (0.3, 1.0, 1.0), (0.5, 0.0, 0.9), (0.5, 0.9, 0.0), (0.2, 1e-100, 1e-200)]
HALVES: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "lambda_": 0.5, "seed": 0}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_equals_the_sweep(variant: str, name: str) -> None:
    made, own = VARIANTS[variant]
    for number, (alpha, gamma, lambda_) in enumerate(NUMBERS):
        parameters = {"gamma": gamma, "lambda_": lambda_, "bootstrap_terminal": number % 3 == 0} | own
        if "trace" in own:
            alpha /= 10  # what grows without bound compares rounding only
        initial_q = 0.25 * (number % 2)
        n_agents = 1 + number % 2
        compare(made, PROBLEMS[name], 9, n_agents=n_agents, epsilon=1.0, alpha=alpha, initial_q=initial_q, **parameters)


@pytest.mark.parametrize("variant", ["replacing", "dutch"])
def test_long_episodes_equal_the_sweep(variant: str) -> None:
    # Thousands of steps, so that epochs begin dozens of times and traces are flushed as there are too many. Of one
    # action, which is greedy, Watkins' traces are never cut.
    made, own = VARIANTS[variant]
    for n_actions in (1, 3):
        problem = random_mdp(9, n_states=25, n_actions=n_actions, limit=2000, ends=0.0)
        for gamma, lambda_ in [(0.95, 0.95), (0.7, 0.1), (0.999, 1.0)]:
            compare(made, problem, 2, alpha=0.05, gamma=gamma, lambda_=lambda_, epsilon=1.0, **own)


@pytest.mark.parametrize("ties", ["first", "random"])
@pytest.mark.parametrize("variant", ["replacing", "dutch"])
def test_greedy_actions_and_decay_equal_the_twin(variant: str, ties: str) -> None:
    made, own = VARIANTS[variant]
    parameters = HALVES | own | {"ties": ties, "epsilon": 0.5, "epsilon_decay": 0.75}
    _, (slow,) = compare(made, corridor(4, limit=8), 4, **parameters)
    assert variant != "replacing" or slow.n_cuts > 0


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "mean"])
@pytest.mark.parametrize("variant", ["carried", "dutch"])
def test_the_tensor_step_equals_its_twin(variant: str, share: str) -> None:
    made, own = VARIANTS[variant]
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), share=share, floor=0.1)
    problem = random_mdp(11, n_outcomes=2, limit=15)
    compare_with_step(made, problem, step, 3, gamma=0.9, lambda_=1.0, **own)


@settings(deadline=None, max_examples=40)
@given(
    variant=st.sampled_from(list(VARIANTS)),
    gamma=st.floats(0, 1),
    lambda_=st.floats(0, 1),
    bootstrap_terminal=st.booleans(),
    episodes=st.integers(1, 5),
    limit=st.integers(1, 40),
    seed=st.integers(0, 2**32),
)
def test_any_numbers_equal_the_sweep(variant: str, episodes: int, limit: int, seed: int, **parameters: Any) -> None:
    made, own = VARIANTS[variant]
    problem = random_mdp(seed, n_states=6, limit=limit, n_outcomes=1 + seed % 2)
    compare(made, problem, episodes, alpha=0.1, epsilon=1.0, **own, **parameters)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("variant", ["carried", "dutch"])
def test_it_goes_on_through_files(variant: str, tmp_path: Path) -> None:
    made, own = VARIANTS[variant]
    goes_on_through_files(made, random_mdp(31, n_states=9, n_outcomes=2), tmp_path, lambda_=0.8, **own)


def test_a_visited_row_is_recorded_though_the_errors_around_the_visit_cancel() -> None:
    # 0 -> 1 -> 0 -> end, by chance. Errors: 0; then 1 at phi 0.25; then -3.875 - 0.125 at phi 0.0625: together 0. But
    # Q(0) is 0.125 - 0.5 x 4.
    rewards, ends = [[[0.0, -3.875]], [[1.0, 1.0]]], [[[False, True]], [[False, False]]]
    problem = TabularMDP([[[1, 1]], [[0, 0]]], rewards, ends, np.full((2, 1, 2), 0.5))
    step, found = TensorStep(every=5, ranks=(1, 1, 1, 1)), 0
    for seed in range(30):
        learner = SarsaLambda(problem, tensor_step=step, **HALVES | {"seed": seed}).learn(1)
        if learner.steps.item() == 3:
            log, found = learner.change_logs[0], found + 1
            assert learner.q[0, :, 0].tolist() == [-1.875, 0.0]
            assert sorted(log.state[: log.end[0]].tolist()) == [0, 1]
    assert found > 0


# Watkins' Q(lambda)


def test_watkins_by_hand() -> None:
    # gamma lambda is 0.25, one action. Errors: -1; -1 + 0.5 x 0; 10. As SARSA(lambda) has it, since all is greedy.
    states = np.arange(3)[:, None]
    problem = TabularMDP(np.minimum(states + 1, 2), np.where(states == 2, 10.0, -1.0), states == 2)
    learner = WatkinsQLambda(problem, **HALVES).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [-0.3125, 0.75, 5.0])


def test_an_action_that_is_not_greedy_cuts_what_came_before_it() -> None:
    # 0 -> 1 -> end; in state 1 action 0 is worth 1 and action 1 nothing; both pay 4.
    problem = TabularMDP([[1, 1], [1, 1]], [[0.0, 0.0], [4.0, 4.0]], [[False, False], [True, True]])
    seen = set()
    for seed in range(20):
        table = np.array([[0.0, 0.0], [1.0, 0.0]])
        q = WatkinsQLambda(problem, **HALVES | {"lambda_": 1.0, "seed": seed}, epsilon=1.0, initial_q=table).learn(1).q
        seen.add((bool(q[0, 1, 0] != 1.0), float(q[0, 0].max())))
    # Its own step brings 0.5 (0.5 x 1) = 0.25; then, if action 0 follows, half of that action's error, 0.5 (3 x 0.5).
    assert seen == {(True, 1.0), (False, 0.25)}


@pytest.mark.parametrize("ends", [{"lambda_": 0.0}, {"gamma": 0.0}])
def test_without_lambda_it_is_q_learning_to_the_last_bit(ends: dict[str, Any]) -> None:
    problem = random_mdp(61, n_states=30, n_outcomes=2)
    parameters: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.2, "seed": 3, "n_agents": 2}
    one_step: dict[str, Any] = {name: value for name, value in ends.items() if name == "gamma"}
    ours, theirs = WatkinsQLambda(problem, **ends, **parameters), QLearning(problem, **one_step, **parameters)
    np.testing.assert_array_equal(ours.learn(30).q, theirs.learn(30).q)
    np.testing.assert_array_equal(ours.steps, theirs.steps)


def test_a_team_of_one_agent_is_watkins() -> None:
    problem = random_mdp(62, n_outcomes=2)
    ours, theirs = (kind(problem, epsilon=0.3, seed=1).learn(40) for kind in (WatkinsQLambda, TeamQ))
    np.testing.assert_array_equal(ours.q, theirs.q)
    np.testing.assert_array_equal(ours.steps, theirs.steps)


# True online SARSA(lambda)


def test_true_online_by_hand() -> None:
    # It stays in its only state for two steps. The first makes Q 0.5; the trace is then 0.25 x 0.5 + 1 = 1.125, and Q
    # becomes 0.5 + 0.5 x (1 + 0.5 x 0.5 - 0) x 1.125 - 0.5 x (0.5 - 0).
    problem = TabularMDP([[0]], [[1.0]], [[False]], max_episode_steps=2)
    assert TrueOnlineSarsaLambda(problem, **HALVES).learn(1).q.item() == 0.953125
    # The forward view: from 0 towards 0.5 x 1 + 0.5 x (1 + 0.5 x 1 + 0.25 x 0.5), then towards 1 + 0.5 x 0.5.
    assert 0.5 * 1.3125 + 0.5 * (1.25 - 0.5 * 1.3125) == 0.953125


@pytest.mark.parametrize("number", range(4))
def test_each_episode_ends_with_the_table_of_the_online_lambda_return(number: int) -> None:
    problem = random_mdp(2, n_states=5, n_outcomes=3, limit=60)
    alpha, gamma, lambda_ = NUMBERS[number]
    omega = np.array([1.0, 0.4, 0.7])  # the equality holds for each action's own step size
    slow: Any = twin_of(
        TrueOnlineSarsaLambda, problem, seed=3, alpha=alpha, gamma=gamma, lambda_=lambda_, epsilon=1.0, initial_q=0.5
    )
    for _ in range(6):
        before = slow.q.copy()
        slow.episode(omega)
        forward = online_lambda_return(before, slow.experience, lambda_, alpha * omega)
        np.testing.assert_allclose(slow.q, forward, rtol=1e-9, atol=1e-12)


def test_a_row_is_recorded_though_the_errors_after_its_visit_cancel() -> None:
    # 0 -> 1 -> 0 -> end, by chance. Errors: 0; then 1 at phi 0.25; then -4 at phi 0.0625: together 0. But Q(0) is
    # 0.125 - 4 x 0.5 x (0.5 x 0.0625 + 1) - 0.5 x 0.125 = -2.
    rewards, ends = [[[0.0, -4.0]], [[1.0, 1.0]]], [[[False, True]], [[False, False]]]
    problem = TabularMDP([[[1, 1]], [[0, 0]]], rewards, ends, np.full((2, 1, 2), 0.5))
    step, found = TensorStep(every=5, ranks=(1, 1, 1, 1)), 0
    for seed in range(30):
        learner = TrueOnlineSarsaLambda(problem, tensor_step=step, **HALVES | {"seed": seed}).learn(1)
        if learner.steps.item() == 3:
            log, found = learner.change_logs[0], found + 1
            assert learner.q[0, :, 0].tolist() == [-2.0, 0.0]
            assert 0 in log.state[: log.end[0]]
    assert found > 0


def test_without_lambda_it_is_sarsa_to_the_last_bit() -> None:
    problem = random_mdp(61, n_states=30, n_outcomes=2)
    parameters: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.2, "seed": 3, "n_agents": 2}
    ours = TrueOnlineSarsaLambda(problem, lambda_=0.0, **parameters).learn(30)
    theirs = Sarsa(problem, **parameters).learn(30)
    np.testing.assert_array_equal(ours.q, theirs.q)
    np.testing.assert_array_equal(ours.steps, theirs.steps)


# Sutton and Barto's random walk of 19 states


def random_walk() -> TabularMDP:
    """To the left or to the right by chance; leaving on the left pays -1, on the right 1 (example 7.1)."""
    states = np.arange(19)
    there = np.stack([np.maximum(states - 1, 0), np.minimum(states + 1, 18)], axis=1)[:, None, :]
    rewards, ends = np.zeros((19, 1, 2)), np.zeros((19, 1, 2), dtype=np.bool_)
    rewards[0, 0, 0], rewards[18, 0, 1] = -1.0, 1.0
    ends[0, 0, 0] = ends[18, 0, 1] = True
    return TabularMDP(there, rewards, ends, np.full((19, 1, 2), 0.5), start=9)


WALK, VALUES = random_walk(), (np.arange(19) - 9) / 10.0


def rms_error(made: Any, alpha: float, lambda_: float, **own: Any) -> float:
    """Over the first 10 episodes, the mean of 20 runs (figures 12.6 and 12.8)."""
    learner = made(WALK, alpha=alpha, gamma=1.0, lambda_=lambda_, n_agents=20, seed=0, **own)
    errors: list[FloatArray] = []
    for _ in range(10):
        learner.learn(1)
        errors.append(np.sqrt(((learner.q[:, :, 0] - VALUES) ** 2).mean(axis=1)))
    return float(np.mean(errors))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.DivergenceWarning")
def test_the_random_walk_has_the_shape_of_the_figures() -> None:
    def best(made: Any, lambda_: float, alphas: tuple[float, ...], **own: Any) -> float:
        return min(rms_error(made, alpha, lambda_, **own) for alpha in alphas)

    alphas = {0.0: (0.6, 0.8), 0.8: (0.2, 0.3, 0.4), 0.95: (0.05, 0.1, 0.2), 1.0: (0.01, 0.02, 0.05)}
    dutch = {lambda_: best(TrueOnlineSarsaLambda, lambda_, tried) for lambda_, tried in alphas.items()}
    plain = {lambda_: best(SarsaLambda, lambda_, tried, trace="accumulating") for lambda_, tried in alphas.items()}
    assert dutch[0.8] < 0.3 < min(dutch[0.0], dutch[1.0])  # in between is best
    assert dutch[0.0] == plain[0.0]
    assert all(dutch[lambda_] < plain[lambda_] for lambda_ in (0.8, 0.95, 1.0))
    # Large steps: what true online SARSA(lambda) bears, accumulating traces do not.
    assert (
        rms_error(TrueOnlineSarsaLambda, 0.8, 0.95)
        < 0.55
        < 1e3
        < rms_error(SarsaLambda, 0.8, 0.95, trace="accumulating")
    )


def test_values_of_the_walk_are_learned() -> None:
    learner = TrueOnlineSarsaLambda(WALK, alpha=0.02, gamma=1.0, lambda_=0.8, n_agents=5, seed=1).learn(2000)
    np.testing.assert_allclose(learner.q[:, :, 0].mean(axis=0), VALUES, atol=0.05)


# What is refused


@pytest.mark.parametrize("made", [WatkinsQLambda, TrueOnlineSarsaLambda])
def test_divergence_stops_learning(made: Any) -> None:
    problem = TabularMDP([[0, 0]], [[1e308, 1e308]], [[False, False]], max_episode_steps=50)
    with pytest.warns(DivergenceWarning, match="not finite any more in episode 0"):
        learner = made(problem, alpha=1.0, gamma=1.0, lambda_=1.0, seed=0).learn(5)
    assert learner.diverged_at == 0


@pytest.mark.parametrize(
    ("made", "parameters", "error", "message"),
    [
        (WatkinsQLambda, {"lambda_": 1.5}, ParameterError, r"lambda_ must be a number in \[0, 1\]; got 1.5"),
        (WatkinsQLambda, {"lambda_": "much"}, ParameterTypeError, r"lambda_ must be .*; got 'much'"),
        (
            WatkinsQLambda,
            {"trace": "dutch"},
            UnknownNameError,
            "unknown trace 'dutch': use one of accumulating, replacing",
        ),
        (WatkinsQLambda, {"cut_traces": False}, ParameterTypeError, "WatkinsQLambda has no parameter 'cut_traces'"),
        (TrueOnlineSarsaLambda, {"lambda_": -0.1}, ParameterError, r"lambda_ must be a number in \[0, 1\]; got -0.1"),
        (TrueOnlineSarsaLambda, {"lambda_": None}, ParameterTypeError, r"lambda_ must be .*; got None"),
        (TrueOnlineSarsaLambda, {"trace": "replacing"}, ParameterTypeError, "has no parameter 'trace'"),
        (TrueOnlineSarsaLambda, {"carry_trace": True}, ParameterTypeError, "has no parameter 'carry_trace'"),
    ],
)
def test_bad_input_is_said(made: Any, parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        made(WALK, **parameters)
