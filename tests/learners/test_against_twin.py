"""Kernels against their slow twins, with actions forced.

With epsilon 1 each real action comes from the stream alone, and Dyna-H's planned ones come from its model: rounding
cannot change a trajectory, so it must agree step by step and the tables to 1e-9.
"""

from typing import Any, Literal

import numpy as np
import pytest

from tests.learners.worlds import corridor, dyna_twin, random_maze, random_mdp, twin
from tests.reference import tensor_step
from tests.reference.q_learning import QLearner
from tuckerl import DynaH, QLearning, TabularMDP, TensorStep

SearchControl = Literal["trajectory", "restart", "random"]

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_outcomes=3),
    "stochastic start": random_mdp(3, n_outcomes=2, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "short limit": random_mdp(5, limit=1),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "other maze": random_maze(7, 6, 3).to_mdp(max_episode_steps=80),
    "corridor": corridor(),
}
NUMBERS = [(0.1, 0.95), (1.0, 0.9), (0.3, 0.0), (0.5, 1.0)]
EPISODES = 12


@pytest.mark.parametrize(("alpha", "gamma"), NUMBERS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_q_learning_equals_its_twin(name: str, alpha: float, gamma: float) -> None:
    problem = PROBLEMS[name]
    learner = QLearning(problem, alpha=alpha, gamma=gamma, epsilon=1.0, n_agents=3, seed=5).learn(EPISODES)
    for agent in range(3):
        slow = twin(problem, seed=5, agent=agent, alpha=alpha, gamma=gamma, epsilon=1.0)
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(EPISODES)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        np.testing.assert_allclose(learner.returns[:, agent], [total for _, total in played], rtol=0, atol=1e-9)
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)
        assert learner.trajectories[agent].tolist() == slow.trajectory


@pytest.mark.parametrize("search_control", ["trajectory", "restart", "random"])
@pytest.mark.parametrize("planning_steps", [0, 1, 10])
@pytest.mark.parametrize("name", PROBLEMS)
def test_dyna_h_equals_its_twin(name: str, planning_steps: int, search_control: SearchControl) -> None:
    problem = PROBLEMS[name]
    alpha, gamma = NUMBERS[planning_steps % 4]
    learner = DynaH(
        problem,
        planning_steps=planning_steps,
        search_control=search_control,
        alpha=alpha,
        gamma=gamma,
        epsilon=1.0,
        initial_q=0.25,
        n_agents=2,
        seed=8,
    ).learn(EPISODES)
    for agent in range(2):
        slow = dyna_twin(
            problem,
            seed=8,
            agent=agent,
            planning_steps=planning_steps,
            search_control=search_control,
            alpha=alpha,
            gamma=gamma,
            epsilon=1.0,
            initial_q=0.25,
        )
        steps = [slow.episode(np.ones(problem.n_actions))[0] for _ in range(EPISODES)]
        assert learner.steps[:, agent].tolist() == steps
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("alpha", [1.0, 0.4])
@pytest.mark.parametrize("gamma", [0.0, 1.0])
def test_dyna_h_equals_its_twin_at_the_ends_of_gamma(gamma: float, alpha: float) -> None:
    problem = PROBLEMS["maze"]
    learner = DynaH(problem, alpha=alpha, gamma=gamma, epsilon=1.0, seed=1).learn(EPISODES)
    slow = dyna_twin(problem, alpha=alpha, gamma=gamma, epsilon=1.0, seed=1)
    assert learner.steps[:, 0].tolist() == [slow.episode(np.ones(4))[0] for _ in range(EPISODES)]
    np.testing.assert_allclose(learner.q[0], slow.q, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("ties", ["random", "first"])
def test_greedy_actions_and_decay_equal_the_twin(ties: Literal["random", "first"]) -> None:
    # Tables of one update by a power of two: no rounding, so greedy actions may be compared as well.
    problem = corridor(6)
    settings: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "epsilon": 0.5, "epsilon_decay": 0.75}
    learner = QLearning(problem, ties=ties, seed=2, **settings).learn(8)
    slow = twin(problem, ties=ties, seed=2, **settings)
    assert learner.steps[:, 0].tolist() == [slow.episode(np.ones(2))[0] for _ in range(8)]
    np.testing.assert_array_equal(learner.q[0], slow.q)


def _compare_with_step(
    problem: TabularMDP, step: TensorStep, n_agents: int, *, dyna: bool = False, initial_q: float = 0.0
) -> None:
    settings: dict[str, Any] = {"alpha": 0.3, "epsilon": 1.0, "initial_q": initial_q, "seed": 3}
    if dyna:
        learner: QLearning | DynaH = DynaH(
            problem,
            planning_steps=3,
            n_agents=n_agents,
            tensor_step=step,
            **settings,
        )
        agents: list[QLearner] = [dyna_twin(problem, planning_steps=3, agent=j, **settings) for j in range(n_agents)]
    else:
        learner = QLearning(problem, n_agents=n_agents, tensor_step=step, **settings)
        agents = [twin(problem, agent=j, **settings) for j in range(n_agents)]
    learner.learn(10)
    assert isinstance(step.weights, str)
    assert isinstance(step.share, str)
    steps, windows = tensor_step.play(
        agents,
        10,
        seed=3,
        every=step.every,
        ranks=step.ranks or (),
        weights=step.weights,
        sharing=step.share,
        floor=step.floor,
        tol=step.tol,
        max_iterations=step.max_iterations,
        shrink=step.shrink,
        share_every=step.share_every,
    )
    history = learner.tensor_step_history
    assert learner.steps.tolist() == steps
    np.testing.assert_allclose(history.weights, [window.omega for window in windows], rtol=0, atol=1e-9)
    np.testing.assert_allclose(learner.action_weights, windows[-1].omega, rtol=0, atol=1e-9)
    assert history.episode.tolist() == list(range(step.interval, 11, step.interval))
    assert history.chosen.tolist() == [window.chosen for window in windows]
    if step.needs_decomposition:
        assert history.ranks.tolist() == [list(window.ranks) for window in windows]
    for agent, slow in enumerate(agents):
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "min", "best", "random", "mean", "visits", "consensus", "none"])
@pytest.mark.parametrize("weights", ["paper", "relative", "constant", "permuted", "none"])
def test_tensor_step_equals_its_twin(weights: str, share: str) -> None:
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), weights=weights, share=share)
    _compare_with_step(random_mdp(11, n_outcomes=2), step, n_agents=3)


@pytest.mark.parametrize("ranks", ["auto", 0.8, 0.999, 1.0])
@pytest.mark.parametrize("initial_q", [0.0, -0.75])
def test_tensor_step_with_ranks_by_energy_equals_its_twin(ranks: str | float, initial_q: float) -> None:
    # Rows that nobody touched have energy, too, where values do not begin at 0.
    problem = random_mdp(13, n_states=12, n_outcomes=2, limit=5)
    _compare_with_step(problem, TensorStep(every=4, ranks=ranks), n_agents=2, initial_q=initial_q)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("dyna", [False, True])
@pytest.mark.parametrize("initial_q", [0.0, -0.75])
def test_tensor_step_of_dyna_h_and_of_touched_tables_equals_its_twin(
    n_agents: int, dyna: bool, initial_q: float
) -> None:
    # Seven states of which an episode of 5 steps leaves some untouched; ranks beyond what is possible.
    problem = random_mdp(12, n_states=12, limit=5)
    step = TensorStep(every=4, ranks=(15, 2, 9, 1), floor=0.3, tol=1e-6)
    _compare_with_step(problem, step, n_agents, dyna=dyna, initial_q=initial_q)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize(
    ("every", "share_every", "weights", "share"),
    [
        (4, 2, "paper", "visits"),
        (6, 2, "paper", "mean"),
        (4, 1, "permuted", "random"),
        (2, 4, "paper", "visits"),
        (2, 4, "relative", "max"),
        (3, 9, "constant", "best"),
        (9, 3, "none", "visits"),
        (1, 2, "none", "visits"),
    ],
)
def test_sharing_more_and_less_often_equals_its_twin(every: int, share_every: int, weights: str, share: str) -> None:
    # Of 30 states a window touches few: rows stand still, and rows change in one part of a window only.
    problem = random_mdp(14, n_states=30, n_outcomes=2, limit=6)
    step = TensorStep(every, (3, 2, 2, 2), weights=weights, share=share, share_every=share_every)
    _compare_with_step(problem, step, n_agents=3, initial_q=-0.5)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize(
    ("shrink", "n_agents", "share_every", "weights", "share"),
    [
        (0.25, 3, None, "paper", "visits"),
        (1.0, 3, None, "none", "max"),
        (0.5, 3, 4, "paper", "mean"),
        (0.5, 3, 4, "none", "none"),
        (0.5, 1, None, "none", "visits"),
    ],
)
def test_shrinking_equals_its_twin(
    shrink: float, n_agents: int, share_every: int | None, weights: str, share: str
) -> None:
    problem = random_mdp(14, n_states=30, n_outcomes=2, limit=6)
    step = TensorStep(2, (3, 2, 2, 2), weights=weights, share=share, shrink=shrink, share_every=share_every)
    _compare_with_step(problem, step, n_agents, initial_q=-0.5)


def test_truncated_hosvd_equals_its_twin() -> None:
    step = TensorStep(every=4, ranks=(2, 2, 2, 1), max_iterations=0)
    _compare_with_step(random_mdp(13), step, n_agents=3)
