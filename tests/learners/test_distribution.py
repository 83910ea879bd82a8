"""Free runs: compiled learners and twins of other seeds must behave alike, and a faulty twin must not."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import ks_2samp

from tests.learners.worlds import dyna_twin, random_maze, random_mdp, sarsa_lambda_twin, sarsa_twin, team_twin, twin
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TeamQ

pytestmark = pytest.mark.slow

RUNS, EPISODES = 150, 6
MAZE = random_maze(3, 4, 4).to_mdp(max_episode_steps=500)


def _same(ours: list[int], theirs: list[int]) -> float:
    return float(ks_2samp(ours, theirs).pvalue)


def _dyna_twin_steps(first_seed: int, *, farthest: bool = True) -> list[int]:
    totals = []
    for seed in range(first_seed, first_seed + RUNS):
        slow = dyna_twin(MAZE, seed=seed, planning_steps=5, farthest=farthest)
        totals.append(sum(slow.episode(np.ones(4))[0] for _ in range(EPISODES)))
    return totals


def test_free_dyna_h_runs_are_distributed_as_the_twins_and_not_as_a_faulty_ones() -> None:
    ours = [int(DynaH(MAZE, planning_steps=5, seed=seed).learn(EPISODES).steps.sum()) for seed in range(RUNS)]
    assert _same(ours, _dyna_twin_steps(10_000)) > 0.001
    assert _same(ours, _dyna_twin_steps(10_000, farthest=False)) < 1e-6


def test_free_q_learning_runs_are_distributed_as_the_twins_and_not_as_a_faulty_ones() -> None:
    def slow(epsilon: float) -> list[int]:
        twins = (twin(MAZE, seed=seed, epsilon=epsilon) for seed in range(20_000, 20_000 + RUNS))
        return [sum(one.episode(np.ones(4))[0] for _ in range(EPISODES)) for one in twins]

    ours = [int(QLearning(MAZE, seed=seed).learn(EPISODES).steps.sum()) for seed in range(RUNS)]
    assert _same(ours, slow(0.1)) > 0.001
    assert _same(ours, slow(0.3)) < 1e-4


TEAM = random_mdp(52, n_states=8, n_actions=6, limit=200, ends=0.04, action_sizes=(3, 2))


@pytest.mark.parametrize(
    ("made", "twin_of", "faulty", "right"),
    [
        (Sarsa, sarsa_twin, {"epsilon": 0.4}, {}),
        (SarsaLambda, sarsa_lambda_twin, {"lambda_": 0.0}, {"lambda_": 0.9}),
        (SarsaLambda, sarsa_lambda_twin, {"trace": "replacing"}, {"trace": "accumulating", "lambda_": 0.95}),
    ],
)
def test_free_runs_are_distributed_as_the_twins_and_not_as_a_faulty_ones(
    made: Any, twin_of: Any, faulty: dict[str, Any], right: dict[str, Any]
) -> None:
    parameters = {"alpha": 0.3, "epsilon": 0.1} | right

    def slow(parameters: dict[str, Any]) -> list[int]:
        twins = (twin_of(MAZE, seed=seed, **parameters) for seed in range(30_000, 30_000 + RUNS))
        return [sum(one.episode(np.ones(4))[0] for _ in range(EPISODES)) for one in twins]

    ours = [int(made(MAZE, seed=seed, **parameters).learn(EPISODES).steps.sum()) for seed in range(RUNS)]
    assert _same(ours, slow(parameters)) > 0.001
    assert _same(ours, slow(parameters | faulty)) < 1e-4


def test_free_teams_are_distributed_as_the_twins_and_not_as_a_faulty_ones() -> None:
    def slow(**parameters: Any) -> list[float]:
        twins = (team_twin(TEAM, seed=seed, epsilon=0.3, **parameters) for seed in range(40_000, 40_000 + RUNS))
        return [sum(one.episode(np.ones(6))[1] for _ in range(EPISODES)) for one in twins]

    ours = [float(TeamQ(TEAM, seed=seed, epsilon=0.3).learn(EPISODES).returns.sum()) for seed in range(RUNS)]
    assert ks_2samp(ours, slow()).pvalue > 0.001
    assert ks_2samp(ours, slow(exploration="joint")).pvalue < 1e-3
