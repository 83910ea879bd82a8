"""Learners that plan with a model of what they observed, against their slow twins and in numbers worked out by hand.

With epsilon 1 each real action comes from the stream alone, and planned ones come from the model: rounding cannot
change a trajectory, so it must agree step by step and the tables to 1e-9.
"""

from typing import Any

import numpy as np
import pytest

from tests.learners.book_problems import blocking_maze, dyna_maze, greedy_length, shortcut_maze
from tests.learners.test_masks import masked_mdp
from tests.learners.test_update import one_way
from tests.learners.worlds import (
    corridor,
    dyna_q_plus_twin,
    dyna_q_twin,
    prioritized_sweeping_twin,
    r_max_twin,
    random_maze,
    random_mdp,
)
from tests.reference import tensor_step
from tuckerl import DynaQ, DynaQPlus, PrioritizedSweeping, RMax, TabularMDP, TensorStep
from tuckerl.training.learner import Learner

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "short limit": random_mdp(5, limit=1),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "masked": masked_mdp(3),
    "masked and stochastic": masked_mdp(4, n_outcomes=2),
}
TWINS: dict[Any, Any] = {
    DynaQ: dyna_q_twin,
    DynaQPlus: dyna_q_plus_twin,
    PrioritizedSweeping: prioritized_sweeping_twin,
    RMax: r_max_twin,
}
OWN: dict[Any, list[dict[str, Any]]] = {
    DynaQ: [{"planning_steps": 0}, {"planning_steps": 1}, {"planning_steps": 10}],
    DynaQPlus: [
        {"planning_steps": 0, "kappa": 1.0},
        {"planning_steps": 1, "kappa": 0.1},
        {"planning_steps": 10, "kappa": 0.0},
    ],
    PrioritizedSweeping: [
        {"planning_steps": 1, "theta": 0.0},
        {"planning_steps": 10, "theta": 0.0},
        {"planning_steps": 5, "theta": 0.2},
    ],
    RMax: [{"m": 1, "tol": 1e-13}, {"m": 3, "tol": 1e-13}, {"m": 10, "tol": 1e-13}],
}
STEP_TAKERS = [kind for kind in TWINS if kind is not RMax]
NUMBERS = [(0.1, 0.95), (1.0, 0.9), (0.5, 1.0)]
EPISODES = 6


def compare(kind: Any, problem: TabularMDP, **parameters: Any) -> None:
    learner = kind(problem, n_agents=2, seed=8, **parameters).learn(EPISODES)
    for agent in range(2):
        slow = TWINS[kind](problem, seed=8, agent=agent, **parameters)
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(EPISODES)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        np.testing.assert_allclose(learner.returns[:, agent], [total for _, total in played], rtol=0, atol=1e-9)
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)
        assert learner.trajectories[agent].tolist() == slow.trajectory


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("kind", TWINS)
def test_planning_equals_the_twin(kind: Any, name: str, number: int) -> None:
    alpha, gamma = NUMBERS[number]
    gamma = min(gamma, 0.95) if kind is RMax else gamma
    compare(kind, PROBLEMS[name], alpha=alpha, gamma=gamma, epsilon=1.0, initial_q=0.25, **OWN[kind][number])


@pytest.mark.parametrize("ties", ["random", "first"])
@pytest.mark.parametrize("kind", STEP_TAKERS)
def test_greedy_actions_equal_the_twin(kind: Any, ties: str) -> None:
    # Tables of updates by powers of two: no rounding, so greedy actions may be compared as well.
    own = {"kappa": 0.0} if kind is DynaQPlus else {}
    compare(
        kind, corridor(4), ties=ties, alpha=0.5, gamma=0.5, epsilon=0.5, epsilon_decay=0.75, planning_steps=2, **own
    )


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("kind", STEP_TAKERS)
def test_the_tensor_step_equals_its_twin(kind: Any) -> None:
    problem, step = random_mdp(12, n_states=12, limit=5), TensorStep(every=4, ranks=(15, 2, 9, 1), floor=0.3, tol=1e-6)
    settings: dict[str, Any] = {"alpha": 0.3, "epsilon": 1.0, "initial_q": -0.75, "seed": 3, "planning_steps": 3}
    learner = kind(problem, n_agents=3, tensor_step=step, **settings).learn(10)
    agents = [TWINS[kind](problem, agent=j, **settings) for j in range(3)]
    numbers: dict[str, Any] = {"floor": step.floor, "tol": step.tol, "max_iterations": step.max_iterations}
    steps, windows = tensor_step.play(
        agents, 10, seed=3, every=4, ranks=(15, 2, 9, 1), weights="paper", sharing="max", **numbers
    )
    assert learner.steps.tolist() == steps
    np.testing.assert_allclose(learner.action_weights, windows[-1].omega, rtol=0, atol=1e-9)
    for agent, slow in enumerate(agents):
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)


# By hand


def test_dyna_q_by_hand() -> None:
    # Step 1 learns (0) = -0.5 and can only plan (0) again: -0.5 + 0.5 (-1 + 0.5 x 0 + 0.5) = -0.75. From then on plans
    # are drawn, but with one planning step the first episode can hold no more than this of state 0's first two updates.
    learner = DynaQ(one_way(1), planning_steps=1, alpha=0.5, gamma=0.5, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [7.5])  # 5, then 5 + 0.5 (10 - 5)
    learner = DynaQ(one_way(1), planning_steps=2, alpha=0.5, gamma=0.5, seed=0).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [8.75])


def test_a_truncated_step_bootstraps_in_plans_too() -> None:
    # Real and planned: 8 -> -1 + 0.5 x 8 = 3, as the episode is cut off and the return goes on.
    for kind in (DynaQ, DynaQPlus):
        own: dict[str, Any] = {"kappa": 0.0} if kind is DynaQPlus else {}
        parameters: dict[str, Any] = {"alpha": 1.0, "gamma": 0.5, "initial_q": 8.0, "planning_steps": 3, "seed": 0}
        learner = kind(one_way(3, limit=1), **parameters, **own).learn(1)
        np.testing.assert_array_equal(learner.q[0, :, 0], [3.0, 8.0, 8.0])


def test_dyna_q_plus_pays_for_what_was_not_tried_for_long() -> None:
    # One state, one action, alpha 1: after a step, tau is 0 and plans pay 10; what a plan pays is all that Q holds.
    learner = DynaQPlus(one_way(1), planning_steps=1, kappa=3.0, alpha=1.0, gamma=0.0, seed=0).learn(1)
    assert learner.q[0, 0, 0] == 10.0
    # Two actions: the one that was not taken was last tried 0 steps after the beginning, so after 4 episodes of one
    # step with ties to the first action it is worth kappa sqrt(4), more than it ever paid.
    still = TabularMDP([[0, 0]], [[1.0, 0.0]], [[True, True]], max_episode_steps=1)
    curious = DynaQPlus(still, planning_steps=50, kappa=0.1, alpha=1.0, gamma=0.0, epsilon=0.0, ties="first", seed=0)
    curious.learn(4)
    np.testing.assert_allclose(curious.q[0], [[1.0, 0.1 * 2.0]], rtol=1e-15)
    # Never tried: back to the same state with no reward, so with gamma the state's own value is in it.
    with_gamma = DynaQPlus(still, planning_steps=50, kappa=0.1, alpha=1.0, gamma=0.5, epsilon=0.0, ties="first", seed=0)
    np.testing.assert_allclose(with_gamma.learn(4).q[0], [[1.0, 0.1 * 2.0 + 0.5 * 1.0]], rtol=1e-15)


def test_without_a_bonus_and_with_all_tried_both_plan_the_same() -> None:
    # Of one action, nothing in an observed state is untried, and both draw alike.
    parameters: dict[str, Any] = {"planning_steps": 5, "alpha": 0.3, "seed": 1}
    plain = DynaQ(random_mdp(4, n_actions=1), **parameters).learn(5)
    plus = DynaQPlus(random_mdp(4, n_actions=1), kappa=0.0, **parameters).learn(5)
    assert plain.q.all(axis=2).any()
    np.testing.assert_array_equal(plus.q, plain.q)
    for name, array in plain.declared[0].items():
        np.testing.assert_array_equal(plus.declared[0][name], array)


# Sutton and Barto's examples


def test_figure_8_2_more_planning_finds_the_way_sooner() -> None:
    # "The n = 0 agent took about 25 episodes to reach (epsilon-)optimal performance, whereas the n = 5 agent took about
    # five episodes, and the n = 50 agent took only three episodes", over 30 repetitions.
    settings: dict[str, Any] = {"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "n_agents": 30, "seed": 1}
    steps = {n: DynaQ(dyna_maze(), planning_steps=n, **settings).learn(30).steps.mean(axis=1) for n in (0, 5, 50)}
    reached = {n: int(np.argmax(mean < 25)) + 1 for n, mean in steps.items()}  # 14 is optimal, without exploring
    assert reached[50] == 3
    assert 4 <= reached[5] <= 6
    assert 20 <= reached[0] <= 30
    assert steps[50][9] < steps[5][1] < steps[0][1]


def episodes_after(kind: Any, env: Any, change_at: int, seed: int, **parameters: Any) -> tuple[int, float]:
    """Return how many episodes were finished in the 3000 steps after a change, and the latest episodes' mean steps."""
    learner = kind(env, alpha=1.0, gamma=0.95, epsilon=0.1, seed=seed, **parameters).learn(steps=change_at + 3000)
    ends = learner.steps[:, 0].cumsum()
    return int(((ends > change_at) & (ends <= change_at + 3000)).sum()), float(learner.steps[-20:].mean())


@pytest.mark.filterwarnings("ignore::tuckerl.errors.StepCapWarning")
@pytest.mark.parametrize("seed", range(3))
def test_example_8_3_only_dyna_q_plus_finds_the_shortcut(seed: int) -> None:
    # 16 steps by the old gap and 10 by the new one, and 1 in 10 is random.
    plain, plain_steps = episodes_after(DynaQ, shortcut_maze(), 3000, seed, planning_steps=50)
    curious, curious_steps = episodes_after(DynaQPlus, shortcut_maze(), 3000, seed, planning_steps=50, kappa=1e-3)
    assert curious > 1.2 * plain
    assert plain_steps > 16.0
    assert curious_steps < 15.0


@pytest.mark.filterwarnings("ignore::tuckerl.errors.StepCapWarning")
def test_example_8_2_dyna_q_plus_finds_the_new_way_sooner_where_the_old_one_is_blocked() -> None:
    found: dict[Any, list[int]] = {DynaQ: [], DynaQPlus: []}
    for kind, own in ((DynaQ, {}), (DynaQPlus, {"kappa": 1e-4})):
        found[kind] = [episodes_after(kind, blocking_maze(), 1000, seed, **own)[0] for seed in range(5)]
    assert np.median(found[DynaQPlus]) > np.median(found[DynaQ])
    assert min(found[DynaQPlus]) > 20, "each of them finds it"


def test_example_8_4_prioritized_sweeping_needs_fewer_updates_than_dyna_q() -> None:
    # Five updates for each step at most, as in the book, until the greedy way is the shortest. Half of the actions are
    # random: so what counts is how fast values spread, not how long it takes to come upon the shortest way.
    problem = dyna_maze()
    settings: dict[str, Any] = {"alpha": 0.5, "epsilon": 0.5}
    plain, sweeping = [], []
    for seed in range(6):
        learner = DynaQ(problem, planning_steps=4, seed=seed, **settings)
        while greedy_length(problem, learner.q[0], 15) > 14:
            learner.learn(1)
        plain.append(5 * learner.steps.sum())
        slow = prioritized_sweeping_twin(problem, planning_steps=5, seed=seed, **settings)  # it counts
        while greedy_length(problem, slow.q, 15) > 14:
            slow.episode(np.ones(4))
        sweeping.append(slow.n_updates)
    assert np.median(sweeping) < 0.5 * np.median(plain)


def test_prioritized_sweeping_by_hand() -> None:
    # A line of three; alpha 1, gamma 0.5, theta 0.5. The steps' pairs have the priorities 1, 1 and 10. With two updates
    # for each step: (0) = -1; (1) = -1, and (0) changes by |-1 - 0.5 + 1| = 0.5, which is not above theta; (2) = 10,
    # and (1), with |-1 + 5 + 1| = 5, is next: (1) = 4, and (0), with |-1 + 2 + 1| = 2, waits in the queue.
    settings: dict[str, Any] = {"planning_steps": 2, "theta": 0.5, "alpha": 1.0, "gamma": 0.5, "seed": 0}
    learner = PrioritizedSweeping(one_way(3), **settings).learn(1)
    np.testing.assert_array_equal(learner.q[0, :, 0], [-1.0, 4.0, 10.0])
    waiting = learner.declared[0]["queue"].to_arrays()
    assert (waiting["pair"].tolist(), waiting["priority"].tolist()) == ([0], [2.0])
    np.testing.assert_array_equal(learner.learn(1).q[0, :, 0], [1.0, 4.0, 10.0])  # all is known
    np.testing.assert_array_equal(learner.learn(5).q[0, :, 0], [1.0, 4.0, 10.0])


def learns(kind: type[Learner], **parameters: Any) -> Learner:
    return kind(corridor(), seed=0, **parameters)


@pytest.mark.parametrize(
    ("kind", "parameters", "message"),
    [
        (DynaQ, {"planning_steps": -1}, "planning_steps must be a whole number from 0 to .*; got -1"),
        (DynaQPlus, {"kappa": -0.1}, "kappa must be a finite number of at least 0; got -0.1"),
        (DynaQPlus, {"kappa": float("nan")}, "kappa must be a finite number of at least 0"),
        (DynaQPlus, {"planning_steps": 2**70}, "planning_steps must be"),
        (PrioritizedSweeping, {"theta": -1e-9}, "theta must be a finite number of at least 0; got -1e-09"),
        (PrioritizedSweeping, {"planning_steps": 0}, "planning_steps must be a whole number from 1 to .*; got 0"),
        (DynaQ, {"kappa": 0.1}, "DynaQ has no parameter 'kappa'"),
    ],
)
def test_impossible_parameters_are_refused(kind: Any, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        learns(kind, **parameters)
