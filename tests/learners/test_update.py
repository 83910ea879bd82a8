"""The updates in numbers that were worked out by hand, and tables that are known in closed form."""

import numpy as np
import pytest

from tests.learners.worlds import agent_of, corridor
from tuckerl import DynaH, QLearning, TabularMDP, sutton_maze
from tuckerl.learners.q_learning import QLearningState, update
from tuckerl.training.agent_arrays import Transition


def one_way(length: int, limit: int = 100) -> TabularMDP:
    """One action, that goes from state 0 to the end; each step costs 1, the last pays 10."""
    states = np.arange(length)
    last = states == length - 1
    return TabularMDP(
        np.minimum(states + 1, length - 1)[:, None],
        np.where(last, 10.0, -1.0)[:, None],
        last[:, None],
        max_episode_steps=limit,
        heuristic=length - 1.0 - states,
    )


def test_one_update_by_hand() -> None:
    q = np.array([[1.0, 2.0], [4.0, 3.0]])
    agent = agent_of(q)
    agent.step_sizes[:] = 1.0, 0.25
    # 2 + 0.25 (1 + 0.5 x 4 - 2) = 2.25
    assert update(QLearningState(), agent, Transition(0, 1, 1.0, 0.5, 1, False), 0)
    np.testing.assert_array_equal(q, [[1.0, 2.25], [4.0, 3.0]])
    # At the end nothing is bootstrapped: 4 + 1 (-2 - 4) = -2
    assert update(QLearningState(), agent, Transition(1, 0, -2.0, 0.0, 0, True), 0)
    np.testing.assert_array_equal(q, [[1.0, 2.25], [-2.0, 3.0]])


def test_q_learning_by_hand() -> None:
    learner = QLearning(one_way(3), alpha=0.5, gamma=0.5, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [-0.5, -0.5, 5.0])
    learner.learn(1)
    # -0.5 + 0.5 (-1 - 0.25 + 0.5); -0.5 + 0.5 (-1 + 2.5 + 0.5); 5 + 0.5 (10 - 5)
    np.testing.assert_array_equal(learner.q[0, :, 0], [-0.875, 0.5, 7.5])
    assert learner.returns.tolist() == [[8.0], [8.0]]


def test_a_truncated_step_bootstraps() -> None:
    learner = QLearning(one_way(3, limit=1), alpha=1.0, gamma=0.5, initial_q=8.0, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [3.0, 8.0, 8.0])
    assert learner.steps.tolist() == [[1]]


def test_dyna_h_by_hand() -> None:
    # Step 1 learns (0) = -0.5 and plans (0) again: -0.5 + 0.5 (-1 + 0.5 x 0 + 0.5) = -0.75.
    # Step 2 learns (1) = -0.5 and plans (1) = -0.75; step 3 learns (2) = 5 and plans (2) = 7.5.
    learner = DynaH(one_way(3), planning_steps=1, alpha=0.5, gamma=0.5, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [-0.75, -0.75, 7.5])


def test_dyna_h_plans_with_the_farthest_action() -> None:
    # State 0 is its own neighbour by action 1 and 2 and leads to the end by action 0; 2 goes farthest, to state 1.
    problem = TabularMDP(
        [[2, 0, 1], [1, 1, 1], [2, 2, 2]],
        [[0.0, 0.0, -1.0], [-1.0, -1.0, -1.0], [0.0, 0.0, 0.0]],
        [[True, False, False], [False, False, False], [True, True, True]],
        max_episode_steps=1,
        heuristic=[1.0, 5.0, 0.0],
    )
    learner = DynaH(problem, planning_steps=1, search_control="restart", alpha=0.5, gamma=0.0, epsilon=1.0, seed=3)
    q = np.zeros(3)
    tried: set[int] = set()
    for _ in range(30):
        before = learner.q[0, 0]
        learner.learn(1)
        after = learner.q[0, 0]
        if tried >= {0, 1, 2}:
            assert after[2] < before[2]  # planned with every time, whatever was played
        tried |= {int(a) for a in np.flatnonzero(after != before)} | ({0, 1} if len(tried) > 0 else set())
        q = after
    assert q[2] == pytest.approx(-1.0, abs=1e-6)
    assert q[:2].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("gamma", [0.9, 1.0])
def test_q_learning_finds_the_optimal_table_of_a_corridor(gamma: float) -> None:
    problem = corridor(5)
    learner = QLearning(problem, alpha=1.0, gamma=gamma, epsilon=0.5, seed=1).learn(400)
    optimal = np.zeros((5, 2))
    arrays = problem.arrays
    for _ in range(200):  # value iteration
        target = np.where(arrays.terminated, 0.0, gamma * optimal.max(axis=1)[arrays.next_state])
        optimal = (arrays.reward + target).reshape(5, 2)
    np.testing.assert_allclose(learner.q[0], optimal, rtol=0, atol=1e-12)


def test_weights_scale_the_learning_rate_of_their_action() -> None:
    learner = QLearning(one_way(1), alpha=0.5, gamma=0.9, seed=0)
    learner._state.weights[0] = 0.5
    learner.learn(1)
    assert learner.q[0, 0, 0] == 2.5  # 0 + 0.5 x 0.5 x 10


def test_dyna_h_finds_the_shortest_path_of_suttons_maze() -> None:
    learner = DynaH(sutton_maze(), alpha=0.5, epsilon=0.1, seed=0).learn(150)
    assert learner.steps.min() == 14
    # Its greedy policy is the shortest path, too.
    maze, state, steps = sutton_maze(), sutton_maze().state((2, 0)), 0
    arrays = maze.to_mdp().arrays
    while state != maze.state(maze.goal) and steps < 100:
        action, _ = learner.predict(state)
        state = int(arrays.next_state[state * 4 + action])
        steps += 1
    assert steps == 14


def test_epsilon_decays_by_episode() -> None:
    learner = QLearning(corridor(), epsilon=0.8, epsilon_decay=0.5, n_agents=2, seed=0).learn(3)
    assert learner.scheduled("epsilon").tolist() == [0.8, 0.4, 0.2]
    # In the fourth episode, then, 1 in 10 of predicted actions is random, and 1 in 2 of these is not the greedy one.
    others = [learner.predict(0, deterministic=False)[0] != learner.predict(0)[0] for _ in range(4000)]
    assert abs(np.mean(others) - 0.05) < 0.012


def test_epsilon_zero_and_first_tie_take_the_lowest_action() -> None:
    learner = QLearning(corridor(limit=7), epsilon=0.0, ties="first", alpha=0.1, seed=0).learn(1)
    # In 0: left, then right as left has cost 0.1, then both cost 0.1 and left is tried again; in 1: left, then right.
    assert learner.trajectories[0].tolist() == [0, 0, 1, 0, 0, 1, 2, 1]
