"""Traces in numbers worked out by hand, in closed form, and at their cost."""

import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import agent_of, drift, random_mdp
from tuckerl import QLearning, Sarsa, SarsaLambda, Simulator, TabularMDP, TeamQ
from tuckerl.errors import SimulatorError
from tuckerl.generalization.step import TensorStepResult
from tuckerl.learners import traces as module
from tuckerl.learners.team_policy import TeamEpsilonGreedyArrays, choose
from tuckerl.learners.traces import EPOCH, ROWS
from tuckerl.training.learner import Learner

HALVES: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "seed": 0}


def one_way(length: int, limit: int | None = 100) -> TabularMDP:
    """One action, that goes from state 0 to the end; each step costs 1, the last pays 10."""
    states = np.arange(length)
    last = states == length - 1
    return TabularMDP(
        np.minimum(states + 1, length - 1)[:, None],
        np.where(last, 10.0, -1.0)[:, None],
        last[:, None],
        max_episode_steps=limit,
    )


def test_sarsa_by_hand() -> None:
    learner = Sarsa(one_way(3), **HALVES).learn(2)
    # As Q-learning where there is one action: -0.5 + 0.5 (-1 - 0.25 + 0.5); -0.5 + 0.5 (-1 + 2.5 + 0.5); 5 + 0.5 x 5
    np.testing.assert_array_equal(learner.q[0, :, 0], [-0.875, 0.5, 7.5])
    ends = Sarsa(one_way(3), bootstrap_terminal=True, initial_q=8.0, **HALVES).learn(1)
    # The terminal state is here the last one itself: 8 + 0.5 (10 + 0.5 x 8 - 8)
    np.testing.assert_array_equal(ends.q[0, :, 0], [5.5, 5.5, 11.0])


def test_sarsa_takes_the_value_of_the_action_it_takes() -> None:
    # Two states; action 0 of state 1 is worth 4, action 1 is worth -2, and only the random policy takes it.
    problem = TabularMDP([[1, 1], [0, 0]], np.zeros((2, 2)), np.zeros((2, 2), dtype=bool), max_episode_steps=1)
    table = np.array([[0.0, 0.0], [4.0, -2.0]])
    values = set()
    for seed in range(20):
        values |= set(Sarsa(problem, epsilon=1.0, initial_q=table, alpha=0.5, gamma=0.5, seed=seed).learn(1).q[0, 0])
    assert values == {0.0, 1.0, -0.5}


@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
def test_a_chain_by_hand(learner: Any) -> None:
    # gamma lambda is 0.25. Errors of the first episode: -1, -1, 10. So Q(0) = 0.5 (-1 - 0.25 + 0.625) and so on.
    made = learner(one_way(3), lambda_=0.5, **HALVES).learn(1)
    np.testing.assert_array_equal(made.q[0, :, 0], [-0.3125, 0.75, 5.0])
    # Errors of the second: -1 + 0.375 + 0.3125 = -0.3125; -1 + 2.5 - 0.75 = 0.75; 10 - 5 = 5.
    made.learn(1)
    np.testing.assert_array_equal(
        made.q[0, :, 0],
        [-0.3125 + 0.5 * (-0.3125 + 0.75 / 4 + 5 / 16), 0.75 + 0.5 * (0.75 + 5 / 4), 7.5],
    )


def test_traces_of_a_pair_that_is_visited_again_by_hand() -> None:
    # It stays in its only state: errors are 1, then 1 + 0.5 Q - Q; the trace has decayed to 0.25 by then.
    problem = TabularMDP([[0]], [[1.0]], [[False]], max_episode_steps=2)
    replaced = SarsaLambda(problem, lambda_=0.5, **HALVES).learn(1)
    assert replaced.q.item() == 0.5 + 0.5 * 0.75
    accumulated = SarsaLambda(problem, lambda_=0.5, trace="accumulating", **HALVES).learn(1)
    assert accumulated.q.item() == 0.5 + 0.5 * 0.75 * 1.25


def test_carried_traces_by_hand() -> None:
    # One step an episode from a state of two: the first visit's trace is 0.25 when the second's error is made.
    problem = TabularMDP([[1], [1]], [[1.0], [1.0]], [[False], [False]], max_episode_steps=2)
    parameters: dict[str, Any] = {"lambda_": 0.5, **HALVES}
    zeroed = SarsaLambda(problem, **parameters).learn(1)
    np.testing.assert_array_equal(zeroed.q[0, :, 0], [0.625, 0.5])
    # Errors: 1 + 0.25 - 0.625 = 0.625; then 1 + 0.5 Q(1) - Q(1).
    carried = SarsaLambda(problem, carry_trace=True, **parameters).learn(2)
    second = 0.5 + 0.5 * 0.625 * 0.25  # its trace was 1, then 0.25
    third = 1 + 0.5 * second - second
    np.testing.assert_array_equal(carried.q[0, :, 0], [0.625 + 0.5 * (0.625 + third / 4), second + 0.5 * third])


def test_a_copied_agents_traces_replace_what_was_there() -> None:
    learner = SarsaLambda(random_mdp(3, n_states=12), carry_trace=True, lambda_=0.99, n_agents=3, seed=1).learn(4)

    def dense(agent: int) -> Any:
        traces = learner.declared[agent]["traces"]
        slots = traces.slot
        assert set(slots[slots > 0].tolist()) == set(range(1, int(traces.cursor[ROWS]) + 1))
        np.testing.assert_array_equal(traces.state[slots[slots > 0]], np.flatnonzero(slots))
        assert not traces.constant[0].any()
        assert not traces.constant[traces.cursor[ROWS] + 1 :].any()
        return traces.constant[slots]

    before = [dense(agent) for agent in range(3)]
    assert not np.array_equal(before[0], before[1])
    learner._state.share(TensorStepResult(learner.action_weights, np.array([0.0, 1.0, 0.0]), finite=True))
    for agent in range(3):
        np.testing.assert_array_equal(dense(agent), before[1])
        np.testing.assert_array_equal(learner.q[agent], learner.q[1])
    learner.learn(2)
    assert not np.array_equal(dense(0), dense(1))  # copies, not the same memory
    learner._state.share(TensorStepResult(learner.action_weights, np.array([0.5, 0.5, 0.0]), finite=True))
    for agent in range(3):
        assert not dense(agent).any()


def test_a_cut_by_hand() -> None:
    # 0 -> 1 -> end; in state 1 the only greedy action is 0. One agent, who explores always and plays 1 half the time.
    problem = TabularMDP([[1, 1], [1, 1]], [[0.0, 0.0], [4.0, 4.0]], [[False, False], [True, True]])
    table = np.array([[0.0, 0.0], [1.0, 0.0]])
    seen = set()
    for seed in range(20):
        for cut in (True, False):
            made = TeamQ(
                problem, cut_traces=cut, lambda_=1.0, alpha=0.5, gamma=0.5, epsilon=1.0, initial_q=table, seed=seed
            ).learn(1)
            first = float(made.q[0, 0].max())
            greedy = made.q[0, 1, 0] != 1.0
            seen.add((cut, bool(greedy), first))
    # Own step: 0.5 (0 + 0.5 x 1 - 0) = 0.25; then half the error of state 1, 3 or 4, at a trace of a half.
    assert seen == {(True, True, 1.0), (False, True, 1.0), (True, False, 0.25), (False, False, 1.25)}


def test_monte_carlo_at_lambda_1() -> None:
    # Each state is met once, so the errors that follow it sum to G - Q(s), whichever trace it is.
    rng = np.random.default_rng(0)
    rewards, table = rng.normal(size=(400, 1)), rng.normal(size=(400, 1))
    states = np.arange(400)[:, None]
    problem = TabularMDP(np.minimum(states + 1, 399), rewards, states == 399)
    for gamma in (1.0, 0.9):
        returns = np.zeros(401)
        for s in range(399, -1, -1):
            returns[s] = rewards[s, 0] + gamma * returns[s + 1]
        for made, trace in [(SarsaLambda, "replacing"), (SarsaLambda, "accumulating"), (TeamQ, "replacing")]:
            parameters: dict[str, Any] = {"alpha": 0.25, "gamma": gamma, "lambda_": 1.0, "trace": trace, "seed": 1}
            learner: Learner = made(problem, initial_q=table, **parameters).learn(1)
            expected = table[:, 0] + 0.25 * (returns[:400] - table[:, 0])
            np.testing.assert_allclose(learner.q[0, :, 0], expected, rtol=1e-9, atol=1e-12)


def same_bits(one: Learner, other: Learner) -> None:
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.steps, other.steps)
    assert one.trajectories[0].tolist() == other.trajectories[0].tolist()


@pytest.mark.parametrize("ends", [{"lambda_": 0.0}, {"gamma": 0.0}, {"lambda_": 0.0, "trace": "accumulating"}])
def test_without_lambda_it_is_the_one_step_algorithm(ends: Any) -> None:
    problem = random_mdp(61, n_states=30, n_outcomes=2)
    parameters: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.2, "seed": 3, "n_agents": 2}
    one_step = {name: value for name, value in ends.items() if name == "gamma"}
    same_bits(SarsaLambda(problem, **ends, **parameters).learn(30), Sarsa(problem, **one_step, **parameters).learn(30))
    # A team of one agent, too: its draws are those of Q-learning.
    same_bits(TeamQ(problem, **ends, **parameters).learn(30), QLearning(problem, **one_step, **parameters).learn(30))


def test_bootstrap_terminal_means_the_same_to_all() -> None:
    problem = random_mdp(62)
    parameters: dict[str, Any] = {"bootstrap_terminal": True, "seed": 3}
    made = QLearning(problem, **parameters).learn(30)
    same_bits(TeamQ(problem, lambda_=0.0, **parameters).learn(30), made)
    assert not np.array_equal(made.q, QLearning(problem, seed=3).learn(30).q)


def test_the_agents_of_a_team_explore_on_their_own() -> None:
    team = TeamEpsilonGreedyArrays(np.array([0.5]), np.array([3, 2]), np.zeros(2, dtype=np.int64), np.zeros(6))
    agent, counts = agent_of(np.array([[0.0, 0, 0, 1, 0, 0]]), policy=team, seed=1), np.zeros(6)
    for _ in range(20_000):
        counts[choose(team, agent, 0)] += 1
    # The greedy parts are 1 and 1: an agent plays its own with 1/2 + 1/2 / size.
    first, second = np.array([1 / 6, 4 / 6, 1 / 6]), np.array([1 / 4, 3 / 4])
    np.testing.assert_allclose(counts / 20_000, np.outer(first, second).ravel(), atol=0.012)


@pytest.mark.parametrize("carry_trace", [False, True])
@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
def test_nothing_is_pending_after_learning(learner: Any, carry_trace: bool) -> None:
    made = learner(random_mdp(63, limit=700, ends=0.001), carry_trace=carry_trace, seed=1).learn(3)
    traces = made.declared[0]["traces"]
    assert traces.clock.tolist() == [1.0, 0.0, 0.0]
    assert traces.cursor[EPOCH] == 0
    assert not traces.synced[1 : traces.cursor[ROWS] + 1].any()
    assert (traces.cursor[ROWS] > 0) == carry_trace


def test_rows_are_bounded_by_the_length_of_a_trace_not_by_the_states(monkeypatch: pytest.MonkeyPatch) -> None:
    # Ring of 30,000 states, walked once: a trace of 0.5 per step is gone after 1000 steps.
    n_states = 30_000
    states = np.arange(n_states)[:, None]
    ring = TabularMDP((states + 1) % n_states, np.ones((n_states, 1)), states < 0, max_episode_steps=n_states)
    learner = SarsaLambda(ring, gamma=1.0, lambda_=0.5, carry_trace=True, seed=0).learn(1)
    alive = int(learner.declared[0]["traces"].cursor[ROWS])
    assert 900 < alive < 1000
    # The slots that were ever used: those alive, and as many as 40 epochs of 27 steps add before a flush.
    used = int((learner.declared[0]["traces"].state > 0).sum())
    assert alive <= used < alive + module._N_EPOCHS * 27 + 27


def test_updates_per_step_do_not_grow_with_the_states() -> None:
    # Kernels count nothing, so their Python bodies are played, with the one function that changes rows counted.
    script = """
import numpy as np
import tuckerl.learners.sarsa_lambda as sarsa_lambda, tuckerl.learners.traces as traces
from tuckerl import SarsaLambda, TabularMDP
calls = 0
plain = traces.sync_row
def counted(traces, q, step_sizes, log, state):
    global calls
    calls += traces.slot[state] > 0
    plain(traces, q, step_sizes, log, state)
traces.sync_row = sarsa_lambda.sync_row = counted
for n_states in (100, 10_000):
    rng = np.random.default_rng(0)
    ends = np.zeros((n_states, 2), dtype=bool)
    problem = TabularMDP(rng.integers(n_states, size=(n_states, 2)), rng.normal(size=(n_states, 2)), ends,
                         max_episode_steps=1000)
    calls = 0
    SarsaLambda(problem, seed=1).learn(3)
    print(int(calls))
"""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script], capture_output=True, text=True, check=True, env=environment
    )
    few, many = (int(line) for line in done.stdout.split())
    assert 0 < few <= 3 * 3000  # two rows a step that are looked at, and one that is flushed at the end
    assert many <= 3 * 3000


@pytest.mark.parametrize("learner", [Sarsa, SarsaLambda, TeamQ])
@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (7.0, r"from 0 to 4; after step 3 of an episode \(action 0 in state 2\) it was 7"),
        (-2.0, r"from 0 to 4; after step 3 of an episode \(action 0 in state 2\) it was -2"),
        (np.nan, r"finite; after step 3 of an episode \(action 0 in state 2\) the reward was nan"),
    ],
)
def test_a_simulator_that_leaves_its_range_is_an_error(learner: Any, returned: float, message: str) -> None:
    wrong = float(returned)

    def reset(parameters: Any, state: Any, rng: Any) -> None:
        state[0] = 0.0

    def step(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
        state[0] += 1.0
        if state[0] == 3.0:
            if np.isnan(wrong):
                return wrong, False
            state[0] = wrong
        return 1.0, False

    def index(parameters: Any, state: Any) -> int:
        return int(state[0])

    simulator = Simulator(reset, step, index, n_states=5, n_actions=1, state_size=1, max_episode_steps=20)
    made = learner(simulator, seed=0)
    for _ in range(2):
        with pytest.raises(SimulatorError, match=message):
            made.learn(5)
        assert made.episodes == 0


def test_agents_have_their_own_simulators() -> None:
    three = SarsaLambda(drift(), n_agents=3, seed=4).learn(10)
    np.testing.assert_array_equal(three.q[0], SarsaLambda(drift(), seed=4).learn(10).q[0])
    assert not np.array_equal(three.q[0], three.q[1])
