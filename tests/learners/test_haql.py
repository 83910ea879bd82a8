"""HAQL: against its twin, as Q-learning where the heuristic does not count, by hand, and on mazes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.matching import compare, compare_with_step, goes_on_through_files
from tests.learners.test_masks import masked_mdp, masks
from tests.learners.worlds import corridor, random_maze, random_mdp
from tests.training.test_going_on import Disturbed, Interrupts, assert_all_same, fail, learned
from tuckerl import HAQL, UCB, Linear, QLearning, TabularMDP, TensorStep, sutton_maze
from tuckerl.errors import DivergenceWarning, ParameterError, ParameterTypeError, ProblemError

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_states=11, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "short limit": random_mdp(5, limit=1),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "many actions": random_mdp(8, n_states=9, n_actions=12, limit=40),
    "masked": masked_mdp(3, n_outcomes=2),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_forced_actions_equal_the_twin(name: str) -> None:
    for alpha, gamma in [(0.1, 0.95), (1.0, 0.9), (0.5, 1.0)]:
        compare(HAQL, PROBLEMS[name], 9, n_agents=2, alpha=alpha, gamma=gamma, epsilon=1.0, initial_q=0.25)


@pytest.mark.parametrize("xi", [0.25, 0.5, 1.0])
@pytest.mark.parametrize("ties", ["first", "random"])
def test_suggested_actions_equal_the_twin(ties: str, xi: float) -> None:
    # Rewards of 0 and 1 and halves of them: no sum rounds, so that choices may be compared.
    rng = np.random.default_rng(5)
    for allowed in (None, masks(1, 6, (4,))):
        problem = TabularMDP(
            rng.integers(6, size=(6, 4)),
            rng.integers(2, size=(6, 4)).astype(np.float64),
            rng.random((6, 4)) < 0.1,
            max_episode_steps=6,
            heuristic=rng.permutation(6).astype(np.float64),
            action_mask=allowed,
        )
        parameters: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "epsilon": 0.25, "ties": ties, "eta": 0.5}
        learner, twins = compare(HAQL, problem, 6, n_agents=2, xi=xi, **parameters)
        assert min(slow.n_suggested for slow in twins) > 5
        # Predictions are by Q + xi H, too; the lowest action on ties.
        played = twins[0].q + xi * np.array([twins[0].h(state) for state in range(6)])
        played = played if allowed is None else np.where(allowed, played, -np.inf)
        for deterministic in (None, True):
            predicted = learner.predict(np.arange(6), deterministic=deterministic)[0]
            np.testing.assert_array_equal(predicted, played.argmax(axis=1))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "mean"])
def test_the_tensor_step_equals_its_twin(share: str) -> None:
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), share=share, floor=0.1)
    compare_with_step(HAQL, random_mdp(11, n_outcomes=2, limit=15), step, 3, gamma=0.9)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_it_goes_on_through_files(tmp_path: Path) -> None:
    problem, heuristic = random_mdp(31, n_states=9, n_outcomes=2), np.arange(9.0)
    goes_on_through_files(HAQL, problem, tmp_path, heuristic=heuristic, xi=Linear(0.9, 0.1, 10), eta=0.5)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("step", [None, TensorStep(every=5, ranks=(3, 2, 2, 2), floor=0.1)])
def test_without_xi_it_is_q_learning_to_the_last_bit(step: TensorStep | None) -> None:
    problem = random_mdp(61, n_states=30, n_outcomes=2)
    parameters: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.2, "seed": 3, "n_agents": 2, "tensor_step": step}
    ours, theirs = HAQL(problem, xi=0.0, **parameters).learn(30), QLearning(problem, **parameters).learn(30)
    np.testing.assert_array_equal(ours.q, theirs.q)
    np.testing.assert_array_equal(ours.steps, theirs.steps)


@pytest.mark.parametrize(
    ("gap", "xi", "follows"), [(0.9, 0.5, True), (1.1, 0.5, False), (2.9, 0.75, True), (99, 1, True)]
)
def test_what_is_learned_overrules_a_suggestion_that_is_worse_by_more_than_that(
    gap: float, xi: float, follows: bool
) -> None:
    # The bound is xi eta / (1 - xi). Action 0 leads to state 1, action 1 to state 2, which is nearer to the goal.
    ends = np.zeros((3, 2), dtype=np.bool_)
    problem = TabularMDP([[1, 2], [1, 1], [2, 2]], np.zeros((3, 2)), ends, max_episode_steps=1, heuristic=[1, 2, 0])
    table = np.array([[gap, 0.0], [0.0, 0.0], [0.0, 0.0]])
    learner = HAQL(problem, epsilon=0.0, xi=xi, initial_q=table, seed=0)
    learner.learn(1)
    assert learner.trajectories[0].tolist() == [0, 1]  # nothing is known of action 1 yet
    learner = HAQL(problem, epsilon=0.0, xi=xi, initial_q=table, seed=0)
    learner.declared[0]["led_to"][0, 1] = 1 + 2
    learner.learn(1)
    assert learner.trajectories[0].tolist() == [0, 2 if follows else 1]
    assert learner.q[0, 0, int(not follows)] == table[0, int(not follows)]  # choosing left the table as it was


def test_an_action_that_led_no_nearer_is_not_suggested() -> None:
    # Action 1 stays, which is as far as before: the larger value of action 0 decides.
    problem = TabularMDP(
        [[1, 0], [1, 1]], np.zeros((2, 2)), np.zeros((2, 2), bool), max_episode_steps=1, heuristic=[1, 5]
    )
    learner = HAQL(problem, epsilon=0.0, xi=1.0, initial_q=np.array([[1.0, 0.0], [0.0, 0.0]]), seed=0)
    learner.declared[0]["led_to"][0] = 1 + 1, 1 + 0
    assert learner.learn(1).trajectories[0].tolist() == [0, 1]


def test_what_may_not_be_done_any_more_is_not_suggested() -> None:
    # Action 0 leads nearest, but is forbidden now, as an environment's masks may change; action 1 is the next best.
    problem = TabularMDP(
        [[1, 2, 3]] * 4,
        np.zeros((4, 3)),
        np.zeros((4, 3), dtype=np.bool_),
        max_episode_steps=1,
        heuristic=[3, 0, 1, 9],
        action_mask=[[False, True, True]] * 4,
    )
    table = np.zeros((4, 3))
    table[0, 2] = 5.0
    learner = HAQL(problem, epsilon=0.0, xi=1.0, initial_q=table, seed=0)
    learner.declared[0]["led_to"][0] = 1 + 1, 1 + 2, 1 + 3
    assert learner.predict(0)[0] == 1
    assert learner.learn(1).trajectories[0].tolist() == [0, 2]


def test_the_first_episodes_in_a_maze_take_fewer_steps() -> None:
    parameters: dict[str, Any] = {"alpha": 0.1, "n_agents": 10, "seed": 0}
    helped, plain = HAQL(sutton_maze(), **parameters).learn(20), QLearning(sutton_maze(), **parameters).learn(20)
    assert helped.steps[1:].mean() < 0.5 * plain.steps[1:].mean()
    assert (helped.steps[1:].mean(axis=0) < plain.steps[1:].mean(axis=0)).all()  # each of the ten


def test_a_heuristic_is_assigned_and_given() -> None:
    problem = corridor()
    learner = HAQL(problem, seed=0)
    np.testing.assert_array_equal(learner.heuristic, problem.heuristic)
    learner.heuristic, learner.xi = np.zeros(5), 0.25
    assert not learner.heuristic.any()
    plain = QLearning(problem, seed=0).learn(5)  # a heuristic that tells nothing apart suggests nothing
    np.testing.assert_array_equal(learner.learn(5).q, plain.q)


NO_HEURISTIC = TabularMDP([[0, 1], [1, 1]], np.zeros((2, 2)), [[False, True], [True, True]])


@pytest.mark.parametrize(
    ("problem", "parameters", "error", "message"),
    [
        (
            NO_HEURISTIC,
            {},
            ProblemError,
            "HAQL needs a heuristic and this problem has none of its own: pass heuristic=, 2 numbers, larger where the "
            "goal is farther; or use QLearning",
        ),
        (NO_HEURISTIC, {"heuristic": [1.0]}, ProblemError, r"heuristic must be 2 finite numbers.*shape \(1,\)"),
        (NO_HEURISTIC, {"heuristic": [1.0, np.nan]}, ProblemError, "heuristic must be 2 finite numbers.*not finite"),
        (corridor(), {"xi": 1.5}, ParameterError, r"xi must be a number in \[0, 1\]; got 1.5"),
        (corridor(), {"xi": "half"}, ParameterTypeError, r"xi must be a number.*; got 'half'"),
        (corridor(), {"xi": Linear(2.0, 0.0, 5)}, ParameterError, r"xi must stay in \[0, 1\] in all episodes"),
        (corridor(), {"eta": 0.0}, ParameterError, "eta must be a.* number.*; got 0.0"),
        (corridor(), {"eta": None}, ParameterTypeError, "eta must be a.* number.*; got None"),
    ],
)
def test_bad_input_is_said(problem: Any, parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        HAQL(problem, **parameters)


def test_what_is_broken_off_leaves_nothing_of_the_heuristic_in_the_table(tmp_path: Path) -> None:
    # UCB keeps a row to undo its count while the row holds Q + xi H for the moment.
    parameters: dict[str, Any] = {"policy": UCB(0.7), "heuristic": np.arange(6.0), "alpha": 0.3, "seed": 3}
    whole = HAQL(lambda: Disturbed(Interrupts(None)), **parameters).learn(12)
    learner, n_stops = learned(HAQL(lambda: Disturbed(Interrupts(fail, 7, 8, 40)), **parameters), 12)
    assert n_stops == 3
    assert_all_same(learner, whole, tmp_path)


def test_divergence_stops_learning() -> None:
    problem = TabularMDP([[0, 0]], [[1e308, 1e308]], [[False, False]], max_episode_steps=50, heuristic=[0.0])
    with pytest.warns(DivergenceWarning, match="not finite any more in episode 0"):
        HAQL(problem, alpha=1.0, gamma=1.0, seed=0).learn(5)
