"""Free runs: compiled learners and twins of other seeds must behave alike, and a faulty twin must not."""

import numpy as np
from scipy.stats import ks_2samp

from tests.learners.worlds import dyna_twin, random_maze, twin
from tuckerl import DynaH, QLearning

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
