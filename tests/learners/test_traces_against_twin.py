"""SARSA, SARSA(lambda) and Team-Q against twins that sweep over all pairs at every step, with actions forced.

With epsilon 1 each action comes from the stream alone, so that rounding cannot change a trajectory; the tables agree to
1e-9 of each entry. Where greedy actions are compared as well, no sum rounds or gaps are far above rounding.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.worlds import (
    corridor,
    drift,
    random_maze,
    random_mdp,
    sarsa_lambda_twin,
    sarsa_twin,
    team_twin,
)
from tests.reference import tensor_step
from tests.reference.q_learning import QLearner, Table
from tests.reference.team_q import TeamQLearner
from tuckerl import Sarsa, SarsaLambda, Simulator, TabularMDP, TeamQ, TensorStep, cart_pole
from tuckerl.generalization.change_log import EPISODES as N_EPISODES
from tuckerl.generalization.change_log import ChangeLog

PROBLEMS: dict[str, TabularMDP | Simulator] = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_states=11, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "short limit": random_mdp(5, limit=1),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "joint actions": random_mdp(8, n_states=9, n_actions=12, limit=40, action_sizes=(3, 2, 2)),
    "drift": drift(),
    "cart pole": cart_pole(start="uniform"),
}
NUMBERS = [(0.1, 0.95, 0.95), (1.0, 0.9, 0.5), (0.3, 1.0, 1.0), (0.5, 0.0, 0.9), (0.5, 0.9, 0.0), (0.2, 1e-100, 1e-200)]
EPISODES = 9
TWINS: dict[Any, Any] = {Sarsa: sarsa_twin, SarsaLambda: sarsa_lambda_twin, TeamQ: team_twin}
MADE: dict[str, Any] = {"Sarsa": Sarsa, "SarsaLambda": SarsaLambda, "TeamQ": TeamQ}


def assert_close(ours: Table, theirs: Table) -> None:
    """To 1e-9 of each entry, or of what rounding leaves where large changes cancel each other."""
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-14 * float(np.abs(theirs).max()) + 1e-290)


def compare(
    made: type[Any], problem: TabularMDP | Simulator, episodes: int, *, n_agents: int = 1, **parameters: Any
) -> list[QLearner]:
    """Let learner and twins play; return the twins."""
    learner = made(problem, seed=5, n_agents=n_agents, **parameters).learn(episodes)
    twins = [TWINS[made](problem, seed=5, agent=agent, **parameters) for agent in range(n_agents)]
    for agent, slow in enumerate(twins):
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(episodes)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        np.testing.assert_allclose(learner.returns[:, agent], [total for _, total in played], rtol=1e-9, atol=1e-9)
        assert learner.trajectories[agent].tolist() == slow.trajectory
        assert_close(learner.q[agent], slow.q)
    return twins


@pytest.mark.parametrize("bootstrap_terminal", [False, True])
@pytest.mark.parametrize("name", PROBLEMS)
def test_sarsa_equals_its_twin(name: str, bootstrap_terminal: bool) -> None:
    for alpha, gamma, _ in NUMBERS:
        compare(
            Sarsa,
            PROBLEMS[name],
            EPISODES,
            n_agents=2,
            alpha=alpha,
            gamma=gamma,
            epsilon=1.0,
            bootstrap_terminal=bootstrap_terminal,
        )


@pytest.mark.parametrize("carry_trace", [False, True])
@pytest.mark.parametrize("trace", ["replacing", "accumulating"])
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("learner", ["SarsaLambda", "TeamQ"])
def test_traces_equal_the_sweep(learner: str, name: str, trace: str, carry_trace: bool) -> None:
    for number, (alpha, gamma, lambda_) in enumerate(NUMBERS):
        if trace == "accumulating":
            alpha /= 10  # what grows without bound compares rounding only
        compare(
            MADE[learner],
            PROBLEMS[name],
            EPISODES,
            n_agents=1 + number % 2,
            alpha=alpha,
            gamma=gamma,
            lambda_=lambda_,
            epsilon=1.0,
            trace=trace,
            carry_trace=carry_trace,
            bootstrap_terminal=number % 3 == 0,
            initial_q=0.25 * (number % 2),
        )


@pytest.mark.parametrize("carry_trace", [False, True])
@pytest.mark.parametrize("trace", ["replacing", "accumulating"])
@pytest.mark.parametrize("learner", ["SarsaLambda", "TeamQ"])
def test_long_episodes_equal_the_sweep(learner: str, trace: str, carry_trace: bool) -> None:
    # Thousands of steps, so that epochs begin dozens of times and traces are flushed as there are too many.
    problem = random_mdp(9, n_states=25, limit=4000, ends=0.0)
    for gamma, lambda_ in [(0.95, 0.95), (0.7, 0.1), (0.999, 1.0)]:
        parameters: dict[str, Any] = {"alpha": 0.05, "gamma": gamma, "lambda_": lambda_, "trace": trace}
        if learner == "TeamQ":
            parameters["cut_traces"] = False
        compare(MADE[learner], problem, 2, epsilon=1.0, carry_trace=carry_trace, **parameters)


def test_the_smallest_traces_count() -> None:
    # A ring of 3000 states without rewards but the last: traces of 1e-150 are all that the first ones ever get.
    states = np.arange(3000)
    problem = TabularMDP(
        np.minimum(states + 1, 2999)[:, None], (states == 2999)[:, None].astype(np.float64), (states == 2999)[:, None]
    )
    learner = SarsaLambda(problem, alpha=0.5, gamma=0.95, lambda_=0.95, seed=0).learn(1)
    expected = 0.5 * np.exp(np.log(0.95**2) * (2999.0 - states))
    assert expected[0] < 1e-130
    np.testing.assert_allclose(learner.q[0, :, 0], expected, rtol=1e-9)


def test_small_errors_count_among_large_ones() -> None:
    # After an error of 1e12 come errors of 1e-9, which one running sum would lose.
    rewards = np.full((50, 1), 1e-9)
    rewards[0] = 1e12
    states = np.arange(50)[:, None]
    problem = TabularMDP(np.minimum(states + 1, 49), rewards, states == 49)
    compare(SarsaLambda, problem, 1, alpha=0.5, gamma=0.5, lambda_=1.0)


@pytest.mark.parametrize("lambda_", [0.9, 1e-7])
@pytest.mark.parametrize("learner", ["SarsaLambda", "TeamQ"])
def test_a_pair_without_a_trace_does_not_meet_its_rows_large_errors(learner: str, lambda_: float) -> None:
    # State 0 stays for 1e6 a step until action 1 leads away for 1e-6: that pair's value has sixteen digits, too.
    problem = TabularMDP([[0, 1], [1, 1]], [[1e6, 1e-6], [1e-6, 1e-6]], [[False, False], [True, True]])
    parameters: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "lambda_": lambda_, "epsilon": 1.0}
    if learner == "TeamQ":
        parameters["cut_traces"] = False
    for seed in range(10):
        learned = MADE[learner](problem, seed=seed, **parameters).learn(1).q[0]
        slow = TWINS[MADE[learner]](problem, seed=seed, **parameters)
        slow.episode(np.ones(2))
        np.testing.assert_allclose(learned, slow.q, rtol=1e-9, atol=0)


def test_traces_that_decay_fast_cost_no_digits() -> None:
    # State 0 stays or ends by chance: its row is visited again before it has caught up with the step before.
    chances = np.full((2, 1, 2), 0.5)
    ends = [[[False, True]], [[True, True]]]
    problem = TabularMDP([[[0, 1]], [[1, 1]]], np.ones((2, 1, 2)), ends, chances)
    parameters: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "lambda_": 1e-7, "seed": 3}
    learned = SarsaLambda(problem, **parameters).learn(20).q[0]
    slow = sarsa_lambda_twin(problem, **parameters)
    for _ in range(20):
        slow.episode(np.ones(1))
    np.testing.assert_allclose(learned, slow.q, rtol=1e-13)


DYADIC: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "ties": "first", "epsilon": 0.5, "epsilon_decay": 0.75}


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("exploration", ["independent", "joint"])
@pytest.mark.parametrize("ties", ["first", "random"])
def test_greedy_teams_and_cuts_equal_the_twin(ties: str, exploration: str, cut: bool) -> None:
    # Few powers of two are added, so nothing is rounded and greedy actions may be compared as well.
    rng = np.random.default_rng(3)
    problem = TabularMDP(
        rng.integers(5, size=(5, 6)),
        rng.integers(-2, 3, size=(5, 6)).astype(np.float64),
        rng.random((5, 6)) < 0.2,
        max_episode_steps=8,
        action_sizes=(3, 2),
    )
    parameters = DYADIC | {"ties": ties, "exploration": exploration, "cut_traces": cut, "lambda_": 0.5}
    (slow,) = compare(TeamQ, problem, 5, **parameters)
    assert isinstance(slow, TeamQLearner)
    assert (slow.n_cuts > 0) == cut


@pytest.mark.parametrize("ties", ["first", "random"])
@pytest.mark.parametrize("learner", ["Sarsa", "SarsaLambda"])
def test_greedy_actions_and_decay_equal_the_twin(learner: str, ties: str) -> None:
    parameters = DYADIC | {"ties": ties} | ({} if learner == "Sarsa" else {"lambda_": 0.5})
    compare(MADE[learner], corridor(4, limit=10), 5, **parameters)


def _played_with_step(made: type[Any], problem: TabularMDP, step: TensorStep, n_agents: int, **parameters: Any) -> None:
    parameters = {"alpha": 0.3, "epsilon": 1.0, "seed": 3} | parameters
    learner = made(problem, n_agents=n_agents, tensor_step=step, **parameters).learn(10)
    twins = [TWINS[made](problem, agent=agent, **parameters) for agent in range(n_agents)]
    assert isinstance(step.weights, str)
    assert isinstance(step.share, str)
    steps, windows = tensor_step.play(
        twins,
        10,
        seed=3,
        every=step.every,
        ranks=step.ranks or (),
        weights=step.weights,
        sharing=step.share,
        floor=step.floor,
    )
    assert learner.steps.tolist() == steps
    assert learner.tensor_step_history.chosen.tolist() == [window.chosen for window in windows]
    np.testing.assert_allclose(
        learner.tensor_step_history.weights, [window.omega for window in windows], rtol=0, atol=1e-9
    )
    for agent, slow in enumerate(twins):
        # The weights themselves agree to 1e-9 only: decompositions differ.
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-8, atol=1e-9)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "min", "mean", "none"])
@pytest.mark.parametrize("weights", ["paper", "relative", "constant", "permuted", "none"])
@pytest.mark.parametrize("learner", ["SarsaLambda", "TeamQ"])
def test_tensor_step_equals_its_twin(learner: str, weights: str, share: str) -> None:
    # Episodes are short and gamma lambda is 0.9, so what is carried from a window into the next matters.
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), weights=weights, share=share, floor=0.1)
    problem = random_mdp(11, n_outcomes=2, limit=15, action_sizes=(3, 1))
    for n_agents, trace, carry_trace in [(3, "accumulating", True), (1, "accumulating", False), (3, "replacing", True)]:
        parameters = {"alpha": 0.1, "gamma": 0.9, "lambda_": 1.0, "trace": trace, "carry_trace": carry_trace}
        _played_with_step(MADE[learner], problem, step, n_agents, **parameters)


@pytest.mark.parametrize("share", ["consensus", "best", "random", "visits"])
def test_other_shares_equal_their_twins(share: str) -> None:
    step = TensorStep(every=4, ranks=(3, 2, 2, 1), share=share)
    problem = random_mdp(12, limit=15)
    _played_with_step(SarsaLambda, problem, step, 3, carry_trace=True)
    _played_with_step(Sarsa, problem, step, 3)


def tables_in(log: ChangeLog, first: Table) -> list[Table]:
    """The dense table after each episode of a window, from the rows that changed."""
    tables, table, entry = [], first.copy(), 0
    for episode in range(log.cursor[N_EPISODES]):
        for place in range(entry, log.end[episode]):
            table[log.state[place]] = log.row[place]
        entry = int(log.end[episode])
        tables.append(table.copy())
    return tables


@pytest.mark.parametrize("carry_trace", [False, True])
@pytest.mark.parametrize("learner", ["SarsaLambda", "TeamQ"])
def test_snapshots_inside_a_window_are_the_twins_tables(learner: str, carry_trace: bool) -> None:
    problem = random_mdp(13, n_states=20, limit=12)
    parameters: dict[str, Any] = {"seed": 4, "epsilon": 1.0, "lambda_": 0.9, "carry_trace": carry_trace}
    step = TensorStep(every=6, ranks=(2, 2, 2, 1))
    made = MADE[learner](problem, tensor_step=step, **parameters).learn(5)
    slow = TWINS[MADE[learner]](problem, **parameters)
    tables = tables_in(made.change_logs[0], np.zeros((20, 3)))
    assert len(tables) == 5
    for table in tables:
        slow.episode(np.ones(3))
        assert_close(table, slow.q)
    assert_close(made.q[0], slow.q)


@settings(deadline=None, max_examples=60)
@given(
    gamma=st.floats(0, 1),
    lambda_=st.floats(0, 1),
    trace=st.sampled_from(["replacing", "accumulating"]),
    carry_trace=st.booleans(),
    bootstrap_terminal=st.booleans(),
    episodes=st.integers(1, 6),
    limit=st.integers(1, 40),
    seed=st.integers(0, 2**32),
    learner=st.sampled_from(["SarsaLambda", "TeamQ"]),
)
def test_any_numbers_equal_the_sweep(
    gamma: float,
    lambda_: float,
    trace: str,
    carry_trace: bool,
    episodes: int,
    limit: int,
    seed: int,
    learner: str,
    **other: Any,
) -> None:
    problem = random_mdp(seed, n_states=6, limit=limit, n_outcomes=1 + seed % 2)
    parameters = {"alpha": 0.1, "gamma": gamma, "lambda_": lambda_, "trace": trace, "carry_trace": carry_trace, **other}
    compare(MADE[learner], problem, episodes, epsilon=1.0, **parameters)
