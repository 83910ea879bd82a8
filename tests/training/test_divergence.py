"""A run that diverges stops there and says so."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, random_mdp, sarsa_lambda_twin
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TabularMDP, TeamQ, TensorStep
from tuckerl.errors import DivergenceWarning

# It stays where it is for ever, and each step adds 1e307: the value overflows with the 18th.
RUNAWAY = TabularMDP([[0, 0]], [[1e307, 1e307]], [[False, False]], max_episode_steps=4, heuristic=[0.0])
SETTINGS: dict[str, Any] = {"alpha": 1.0, "gamma": 1.0, "epsilon": 0.0, "ties": "first", "seed": 0}

TRACING = (SarsaLambda, TeamQ)


@pytest.mark.parametrize("step", [None, TensorStep(every=3, ranks=(1, 1, 1, 1), weights="none", share="max")])
@pytest.mark.parametrize("n_agents", [1, 2])
def test_learning_stops_where_a_table_overflows(step: TensorStep | None, n_agents: int) -> None:
    learner = QLearning(RUNAWAY, n_agents=n_agents, tensor_step=step, **SETTINGS)
    with pytest.warns(DivergenceWarning, match="not finite any more in episode 4"):
        learner.learn(10)
    assert learner.diverged_at == learner.episodes == 4  # four whole episodes of four steps, the fifth broke
    assert learner.steps.tolist() == [[4] * n_agents] * 4
    assert np.isfinite(learner.returns).all()
    with pytest.warns(DivergenceWarning, match="episode 4"):
        learner.learn(10)
    assert learner.steps.shape == (4, n_agents)
    assert [trajectory.size for trajectory in learner.trajectories] == [0] * n_agents


@pytest.mark.parametrize("learner", [Sarsa, SarsaLambda, TeamQ])
@pytest.mark.parametrize("n_agents", [1, 2])
def test_other_learners_stop_there_too(learner: Any, n_agents: int) -> None:
    made = learner(RUNAWAY, n_agents=n_agents, **SETTINGS, **({} if learner is Sarsa else {"lambda_": 0.0}))
    with pytest.warns(DivergenceWarning, match="not finite any more in episode 4"):
        made.learn(10)
    assert made.diverged_at == 4
    assert made.steps.tolist() == [[4] * n_agents] * 4


@pytest.mark.parametrize("carry_trace", [False, True])
def test_accumulating_traces_with_alpha_1_overflow_where_the_sweep_does(carry_trace: bool) -> None:
    problem = random_mdp(2, n_states=3, limit=40, ends=0.0)
    parameters: dict[str, Any] = {"alpha": 1.0, "trace": "accumulating", "epsilon": 1.0, "carry_trace": carry_trace}
    slow = sarsa_lambda_twin(problem, seed=1, **parameters)
    with np.errstate(over="ignore", invalid="ignore"):
        episodes = 0
        slow.episode(np.ones(3))
        while np.isfinite(slow.q).all():
            episodes += 1
            slow.episode(np.ones(3))
    assert episodes > 3
    learner = SarsaLambda(problem, seed=1, **parameters)
    with pytest.warns(DivergenceWarning, match=f"in episode {episodes}"):
        learner.learn(1000)
    assert learner.diverged_at == len(learner.steps) == episodes


@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
def test_an_overflow_in_a_row_that_is_never_looked_at_again_is_noticed(learner: Any, tmp_path: Path) -> None:
    # The last error, 1.5e308, is finite and so is its own pair; the first pair, which had 1e308, gets both.
    states = np.arange(3)
    problem = TabularMDP(
        np.minimum(states + 1, 2)[:, None], np.array([[1e308], [0.0], [1.5e308]]), (states == 2)[:, None]
    )
    made = learner(problem, alpha=1.0, gamma=1.0, lambda_=1.0, seed=1)
    with pytest.warns(DivergenceWarning, match="in episode 0"):
        made.learn(3)
    assert made.episodes == 0


@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
def test_nothing_is_pending_after_a_divergence(learner: Any) -> None:
    states = np.arange(3)
    # Errors of 1 and 2e307 come before one that is infinite: they have reached their pairs.
    rewards = np.array([[1.0], [2e307], [1e308]])
    problem = TabularMDP(np.minimum(states + 1, 2)[:, None], rewards, (states == 2)[:, None])
    made = learner(problem, alpha=0.5, gamma=0.5, lambda_=1.0, initial_q=[[0.0], [0.0], [-1.5e308]], seed=1)
    with pytest.warns(DivergenceWarning, match="in episode 0"):
        made.learn(3)
    error = 2e307 - 0.5 * 1.5e308
    np.testing.assert_allclose(made.q[0, :, 0], [0.25 * error, 0.5 * error, -1.5e308])


@pytest.mark.parametrize("learner", [QLearning, Sarsa, SarsaLambda, TeamQ])
def test_weights_above_1_can_overflow_in_the_last_step(learner: Any) -> None:
    made = learner(TabularMDP([[0]], [[1e300]], [[True]]), seed=1, **({"lambda_": 0.0} if learner in TRACING else {}))
    made._state.weights[0] = 1e20  # as a user's function may answer
    with pytest.warns(DivergenceWarning, match="in episode 0"):
        made.learn(1)
    assert made.episodes == 0


def test_dyna_h_notices_an_overflow_in_planning() -> None:
    learner = DynaH(RUNAWAY, planning_steps=5, **SETTINGS)
    with pytest.warns(DivergenceWarning, match="episode 0"):  # each step is six updates
        learner.learn(2)
    assert learner.steps.shape == (0, 1)


def test_a_run_without_overflow_says_nothing() -> None:
    assert QLearning(RUNAWAY, **SETTINGS).learn(4).diverged_at is None


def test_tables_that_sharing_broke_stop_the_run() -> None:
    # Mixing beyond the tables, by weights that still sum to 1, doubles them each window.
    step = TensorStep(every=1, ranks=(1, 1, 1, 1), weights="none", share=lambda context: [1e6, 1 - 1e6])
    learner = QLearning(corridor(3), n_agents=2, alpha=1.0, epsilon=1.0, seed=1, tensor_step=step)
    with pytest.warns(DivergenceWarning, match="not finite any more"):
        learner.learn(500)
    assert learner.diverged_at is not None
    assert learner.episodes == learner.diverged_at < 500


def test_divergence_survives_a_file(tmp_path: Path) -> None:
    learner = QLearning(RUNAWAY, **SETTINGS)
    with pytest.warns(DivergenceWarning):
        learner.learn(10)
    learner.save(tmp_path / "learner")
    again = QLearning.load(tmp_path / "learner")
    assert again.diverged_at == 4
    with pytest.warns(DivergenceWarning):
        again.learn(1)
    assert again.episodes == 4


def test_a_window_that_is_not_finite_is_not_factorised() -> None:
    step = TensorStep(every=5, ranks=(1, 1, 1, 1))
    learner = QLearning(corridor(3), epsilon=1.0, seed=1, tensor_step=step).learn(9)
    learner.change_logs[0].row[0, 0] = np.inf
    before = learner.tensor_step_history
    with pytest.warns(DivergenceWarning, match="episode 9"):
        learner.learn(6)
    assert learner.diverged_at == learner.episodes == len(learner.steps) == 9
    np.testing.assert_array_equal(learner.tensor_step_history.weights, before.weights)


@pytest.mark.parametrize("every", [3, 5])
def test_a_learner_that_diverged_in_a_window_is_saved_and_copied(every: int, tmp_path: Path) -> None:
    step = TensorStep(every=every, ranks=(1, 1, 1, 1), floor=0.1)
    learner = QLearning(RUNAWAY, tensor_step=step, **SETTINGS)
    with pytest.warns(DivergenceWarning, match="episode 4"):
        learner.learn(10)
    learner.save(tmp_path / "agent.tuckerl")
    for again in (QLearning.load(tmp_path / "agent.tuckerl"), copy.deepcopy(learner)):
        assert again.diverged_at == 4
        np.testing.assert_array_equal(again.steps, learner.steps)


def test_a_return_that_leaves_the_range_is_infinite_and_nobody_warns() -> None:
    problem = TabularMDP([[0, 0]], [[1e308, 1e308]], [[False, False]], max_episode_steps=2)
    learner = QLearning(problem, alpha=1e-9, seed=0).learn(2)
    np.testing.assert_array_equal(learner.returns, [[np.inf], [np.inf]])
    assert learner.evaluate(1).mean == np.inf
