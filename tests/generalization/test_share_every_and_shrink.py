"""Sharing more or less often than weights change, and drawing tables to what a decomposition says of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import DoubleQLearning, QLearning, TabularMDP, TensorStep
from tuckerl.generalization.sharing import ShareContext
from tuckerl.types import FloatArray

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")

PROBLEM = random_mdp(71, n_states=8, n_actions=3)
SETTINGS: dict[str, Any] = {"epsilon": 0.5, "n_agents": 3, "seed": 3}


@pytest.mark.parametrize(("every", "share_every"), [(3, 6), (6, 3), (6, 2)])
def test_returns_and_changes_are_those_since_the_last_sharing(every: int, share_every: int) -> None:
    seen: list[ShareContext] = []
    step = TensorStep(every, (3, 2, 2, 2), share=seen.append, share_every=share_every)
    learner = QLearning(PROBLEM, tensor_step=step, **SETTINGS)
    tables = [np.zeros((3, 8, 3)), *(learner.learn(1).q for _ in range(12))]  # nothing is shared, as None is answered
    assert len(seen) == 12 // share_every
    for number, context in enumerate(seen):
        window = slice(number * share_every, (number + 1) * share_every)
        np.testing.assert_array_equal(context.returns, learner.returns[window])
        pairs = zip(tables[window], tables[window.start + 1 : window.stop + 1], strict=True)
        changes = np.sum([before != after for before, after in pairs], axis=0)
        np.testing.assert_array_equal(context.changes, changes[:, context.states])
        assert not np.delete(changes, context.states, axis=1).any()


def test_the_history_has_a_row_for_each_step_and_the_weights_change_with_their_windows_only() -> None:
    step = TensorStep(4, (3, 2, 2, 2), share="visits", share_every=2)
    learner = QLearning(PROBLEM, tensor_step=step, **SETTINGS).learn(12)
    history = learner.tensor_step_history
    assert history.episode.tolist() == [2, 4, 6, 8, 10, 12]
    assert (history.weights[0] == 1.0).all()
    for row in (2, 4):
        np.testing.assert_array_equal(history.weights[row], history.weights[row - 1])
    assert [bool(np.isnan(fit)) for fit in history.fit] == [True, False] * 3
    assert [ranks.any() for ranks in history.ranks] == [False, True] * 3
    assert not history.failed.any()
    assert learner.window == 2
    rarely = TensorStep(2, (3, 2, 2, 2), share="max", share_every=4)
    history = QLearning(PROBLEM, tensor_step=rarely, **SETTINGS).learn(8).tensor_step_history
    assert history.episode.tolist() == [2, 4, 6, 8]
    assert [int(chosen) >= 0 for chosen in history.chosen] == [False, True] * 2


def test_tables_are_apart_until_they_are_shared() -> None:
    step = TensorStep(2, weights="none", share="visits", share_every=6)
    learner = QLearning(PROBLEM, tensor_step=step, **SETTINGS)
    for episode in range(1, 13):
        q = learner.learn(1).q
        assert (q == q[0]).all() == (episode % 6 == 0)


def said_of_last_episode(learner: QLearning) -> tuple[Any, FloatArray]:
    """Return the states of the latest window's rows, and what its decomposition says of the last tables, (N, C, A)."""
    loadings = learner.loadings
    assert loadings is not None
    S, A, E, Ag = loadings.factors
    return loadings.states, np.einsum("abcd,sa,tb,c,nd->nst", loadings.core, S, A, E[-1], Ag)


@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("share", ["visits", "none", "max"])
def test_rows_of_the_window_are_drawn_to_what_the_decomposition_says(share: str, n_agents: int) -> None:
    problem = random_mdp(14, n_states=30, limit=5)
    settings = SETTINGS | {"n_agents": n_agents, "epsilon": 1.0, "initial_q": -0.5}
    ranks = (3, 2, 2, 2)
    before = QLearning(problem, tensor_step=TensorStep(2, ranks, share=share), **settings).learn(2)
    shrunk = QLearning(problem, tensor_step=TensorStep(2, ranks, share=share, shrink=0.25), **settings).learn(2)
    states, said = said_of_last_episode(shrunk)
    expected = before.q
    expected[:, states] = 0.75 * expected[:, states] + 0.25 * said
    np.testing.assert_allclose(shrunk.q, expected, rtol=1e-12)
    assert states.size < 30
    assert not np.array_equal(before.q, shrunk.q)


def test_what_is_exact_is_not_moved() -> None:
    # One row and every rank: the decomposition says what the tables are.
    step = TensorStep(2, (9, 3, 2, 2), share="none", shrink=1.0)
    settings = SETTINGS | {"n_agents": 2}
    shrunk = QLearning(random_mdp(3, n_states=3), tensor_step=step, **settings).learn(2)
    plain = QLearning(random_mdp(3, n_states=3), **settings).learn(2)
    np.testing.assert_allclose(shrunk.q, plain.q, atol=1e-12)


def test_tables_near_the_largest_float_are_drawn_in_their_own_unit() -> None:
    problem = TabularMDP([[0, 0]] * 40, np.zeros((40, 2)), [[True, True]] * 40, start=0)
    step = TensorStep(2, (2, 1, 1, 1), weights="none", share="none", shrink=0.5)
    settings: dict[str, Any] = {"alpha": 0.25, "epsilon": 1.0, "seed": 0, "tensor_step": step}
    large, small = (QLearning(problem, initial_q=-unit, **settings).learn(4).q for unit in (2.0**1000, 1.0))
    np.testing.assert_allclose(large, small * 2.0**1000, rtol=1e-9)
    assert len(np.unique(small.round(9))) > 2


def test_tables_of_values_move_with_the_table_that_is_made_of_them(tmp_path: Path) -> None:
    for share in ("visits", "none"):
        step = TensorStep(2, (3, 2, 2, 2), share=share, shrink=0.5)
        learner = DoubleQLearning(PROBLEM, tensor_step=step, **SETTINGS).learn(6)
        for q, held in zip(learner.q, learner.declared, strict=True):
            first, second = (held[name] for name in held if held[name].shape == q.shape)
            np.testing.assert_allclose(q, (first + second) / 2, atol=1e-12)
    learner.learn(1).save(tmp_path / "agent")
    assert_same(DoubleQLearning.load(tmp_path / "agent").learn(4), learner.learn(4))


def test_a_window_without_values_draws_nothing() -> None:
    problem = TabularMDP([[0, 0]], [[0.0, 0.0]], [[True, True]])
    step = TensorStep(2, (1, 1, 1, 1), weights="none", share="visits", shrink=1.0)
    learner = QLearning(problem, n_agents=2, tensor_step=step, seed=0).learn(4)
    np.testing.assert_array_equal(learner.q, np.zeros((2, 1, 2)))
    assert learner.tensor_step_history.episode.tolist() == [2, 4]
