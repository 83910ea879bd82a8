"""What is said where greedy episodes fail: made of learners that have learned nothing, and of evaluations by hand."""

import math

import numpy as np
import pytest

import tuckerl
from tuckerl.reports.learner_text import failure_lines
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner

LIMIT = 50
MAZE = tuckerl.sutton_maze().to_mdp().with_time_limit(LIMIT)


@pytest.fixture(scope="module")
def learned() -> Learner:
    return tuckerl.QLearning(MAZE, seed=0, compiled=False).learn(episodes=20)


def evaluation(returns: list[float], steps: list[int]) -> Evaluation:
    column = np.array(returns)[:, None]
    return Evaluation(column, np.array(steps)[:, None], float(column.mean()), math.nan, math.nan)


def test_episodes_that_were_all_cut_off_are_said_with_what_to_try(learned: Learner) -> None:
    last = float(learned.returns[-2:].mean())
    (line,) = failure_lines(learned, evaluation([last - 1, last - 2], [LIMIT, LIMIT]))
    assert line == (
        f"All 2 greedy episodes were cut off after 50 steps, with less return than the last 2 episodes of learning had "
        f"({last:.4g}): without random actions it goes in circles. To try: more episodes (--episodes 200 --resume); "
        "more exploration (--set epsilon=0.3)."
    )


def test_episodes_that_may_have_been_meant_to_last_are_not_called_a_failure(learned: Learner) -> None:
    (line,) = failure_lines(learned, evaluation([100.0, 100.0], [LIMIT, LIMIT]))
    assert line.startswith(
        "All 2 greedy episodes were cut off after 50 steps. If that is not what was wanted, try: more"
    )
    new = tuckerl.QLearning(MAZE, seed=0, compiled=False)  # there is no learning to compare them with
    (line,) = failure_lines(new, evaluation([-50.0], [LIMIT]))
    assert line.startswith("The greedy episode was cut off after 50 steps. If that is not")


def test_equal_returns_below_learnings_are_said(learned: Learner) -> None:
    (line,) = failure_lines(learned, evaluation([-500.0, -500.0], [20, 30]))
    assert line.startswith("All 2 greedy episodes ended with the return -500, less than the last 2 episodes of ")


@pytest.mark.parametrize(
    "fine",
    [
        evaluation([-500.0, -501.0], [20, 30]),  # returns differ
        evaluation([100.0, 100.0], [20, 30]),  # more than learning had
        evaluation([-500.0], [20]),  # one is no pattern
        evaluation([-500.0, -400.0], [LIMIT, 30]),  # one found an end
    ],
)
def test_nothing_is_said_of_other_episodes(learned: Learner, fine: Evaluation) -> None:
    assert failure_lines(learned, fine) == []
    assert failure_lines(learned, None) == []


def test_a_tensor_step_is_to_be_tried_without_its_weights() -> None:
    def line(weights: str, n_agents: int) -> str:
        step = tuckerl.TensorStep(every=10, ranks=(5, 3, 9, 1), weights=weights)
        agent = tuckerl.QLearning(MAZE, policy=tuckerl.Softmax(0.5), n_agents=n_agents, tensor_step=step, seed=0)
        return failure_lines(agent, evaluation([-50.0], [LIMIT]))[0]

    assert line("paper", 3).endswith("without the tensor's weights (--set weights=none --set share=visits).")
    assert line("paper", 1).endswith("(--set weights=none).")
    assert line("none", 3).endswith("try: more episodes (--episodes 10 --resume).")
