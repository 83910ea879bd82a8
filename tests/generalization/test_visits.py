"""Sharing by visits: entry by entry, the agents' values weighted by in how many episodes each changed the entry."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.worlds import random_mdp
from tests.reference.tensor_step import by_visits
from tests.training.test_resume import assert_same
from tuckerl import QLearning, TensorStep
from tuckerl.errors import ParameterError
from tuckerl.generalization.change_log import ChangeLog, close_episode, empty_log, record_change
from tuckerl.generalization.mixtures import share_tables
from tuckerl.generalization.sharing import SHARING_RULES, ShareContext
from tuckerl.generalization.snapshots import Snapshots
from tuckerl.types import FloatArray, IntArray

PROBLEM = random_mdp(71, n_states=8, n_actions=3)
VISITS = TensorStep(every=4, weights="none", share="visits")


def logged(tables: FloatArray, first: FloatArray, also: list[int] | None = None) -> ChangeLog:
    """Return the log of an agent with these tables, (E, S, A), after each episode; `also` is recorded each time."""
    n_states, n_actions = first.shape
    log, before = empty_log(n_states, n_actions, len(tables)), first
    for table in tables:
        for state in np.flatnonzero((table != before).any(axis=1)).tolist() + (also or []):
            record_change(log, state)
        close_episode(log, table)
        before = table
    return log


def counted(windows: FloatArray, first: FloatArray, also: list[int] | None = None) -> tuple[IntArray, IntArray]:
    """Return what `Snapshots.changes` does for tables (N, E, S, A) that all begin as `first`, (S, A)."""
    return Snapshots(first, len(windows)).changes(tuple(logged(tables, first, also) for tables in windows), 0)


def shared(windows: FloatArray, first: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the tables (N, S, A) after such a window, shared by visits, and the mixture."""
    states, changes = counted(windows, first)
    q = windows[:, -1].copy()
    mixture = SHARING_RULES["visits"].mix(
        ShareContext(None, np.zeros((windows.shape[1], len(windows))), np.random.default_rng(0), changes=changes)
    )
    assert mixture is not None
    share_tables(q, mixture, states)
    return q, mixture


@st.composite
def played(draw: st.DrawFn) -> tuple[FloatArray, FloatArray]:
    """Tables (N, E, S, A) in which a few entries change in each episode, perhaps back, and the first ones."""
    n_agents, n_episodes, n_states, n_actions = (draw(st.integers(1, 4)) for _ in range(4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    first = rng.integers(-2, 3, (n_states, n_actions)) / 3
    windows = np.empty((n_agents, n_episodes, n_states, n_actions))
    for tables in windows:
        table = first.copy()
        for after in tables:
            after[...] = table = np.where(rng.random(table.shape) < 0.3, rng.integers(-2, 3, table.shape) / 3, table)
    return windows, first


def changes_of(tables: FloatArray, first: FloatArray) -> FloatArray:
    """Return in how many episodes each entry of (E, S, A) tables changed, by comparing whole tables."""
    befores = [first, *tables[:-1]]
    changed = [after != before for before, after in zip(befores, tables, strict=True)]
    return np.asarray(np.sum(changed, axis=0), dtype=np.float64)


@settings(deadline=None, max_examples=60)
@given(played())
def test_it_is_the_weighted_mean_of_whole_tables(case: tuple[FloatArray, FloatArray]) -> None:
    windows, first = case
    q, mixture = shared(windows, first)
    slow = by_visits([tables[-1] for tables in windows], [changes_of(tables, first) for tables in windows])
    np.testing.assert_allclose(q, np.broadcast_to(slow, q.shape), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(mixture.sum(axis=0), 1.0, rtol=1e-15)
    assert (mixture >= 0).all()
    assert (q[0] <= windows[:, -1].max(axis=0) + 1e-12).all()
    assert (q[0] >= windows[:, -1].min(axis=0) - 1e-12).all()


@settings(deadline=None, max_examples=30)
@given(played(), st.randoms())
def test_the_order_of_the_agents_does_not_matter(case: tuple[FloatArray, FloatArray], random: Any) -> None:
    windows, first = case
    order = random.sample(range(len(windows)), len(windows))
    np.testing.assert_allclose(
        shared(windows[order], first)[0][0], shared(windows, first)[0][0], rtol=1e-12, atol=1e-15
    )


@settings(deadline=None, max_examples=30)
@given(played(), st.integers(1, 4))
def test_equal_tables_stay_to_the_last_bit(case: tuple[FloatArray, FloatArray], n_agents: int) -> None:
    windows, first = case
    same = np.repeat(windows[:1], n_agents, axis=0)
    np.testing.assert_array_equal(shared(same, first)[0], same[:, -1])


def test_who_changed_an_entry_alone_keeps_it_to_the_last_bit() -> None:
    first = np.full((2, 2), 0.1)
    windows = np.repeat(first[None, None], 3, axis=0).repeat(2, axis=1)
    windows[1, :, 0, 1] = 0.7, 1 / 3  # in both episodes; others in none
    q, mixture = shared(windows, first)
    np.testing.assert_array_equal(q, np.broadcast_to([[0.1, 1 / 3], [0.1, 0.1]], q.shape))
    np.testing.assert_array_equal(mixture, np.broadcast_to([[[1 / 3, 0]], [[1 / 3, 1]], [[1 / 3, 0]]], (3, 1, 2)))


def test_it_counts_episodes_by_hand() -> None:
    first = np.zeros((1, 2))
    windows = np.zeros((2, 4, 1, 2))
    windows[0, :, 0, 0] = 1, 1, 0, 2  # changed in three episodes, once to what it was before the window
    windows[1, :, 0, 0] = 0, 0, 0, 6  # in one
    windows[0, :, 0, 1] = 5, 5, 5, 5
    states, changes = counted(windows, first)
    assert states.tolist() == [0]
    assert changes.tolist() == [[[3, 1]], [[1, 0]]]
    q, _ = shared(windows, first)
    assert q.tolist() == [[[3.0, 5.0]]] * 2


def test_what_changed_and_changed_back_within_an_episode_does_not_count() -> None:
    first = np.ones((3, 2))
    windows = np.ones((2, 2, 3, 2))
    states, changes = counted(windows, first, also=[2])  # recorded as changed, but the same at each episode's end
    assert states.tolist() == [2]
    assert not changes.any()


def test_rows_that_nobody_changed_cost_nothing() -> None:
    first = np.zeros((50, 2))
    windows = np.zeros((2, 3, 50, 2))
    windows[0, 1:, 7] = 1.0
    states, changes = counted(windows, first)
    assert states.tolist() == [7]
    assert changes.shape == (2, 1, 2)


# In learners


def test_all_agents_go_on_with_one_table() -> None:
    settings: dict[str, Any] = {"epsilon": 0.5, "alpha": 0.4, "n_agents": 3, "seed": 3, "initial_q": -0.5}
    apart = QLearning(PROBLEM, **settings)
    tables = [apart.learn(1).q for _ in range(4)]
    learner = QLearning(PROBLEM, tensor_step=VISITS, **settings).learn(4)
    windows, first = np.moveaxis(np.array(tables), 0, 1), np.full((8, 3), -0.5)
    slow = by_visits([tables[-1] for tables in windows], [changes_of(tables, first) for tables in windows])
    np.testing.assert_allclose(learner.q, np.broadcast_to(slow, learner.q.shape), rtol=1e-13)
    assert learner.tensor_step_history.chosen.tolist() == [-1]
    assert learner.tensor_step_history.ranks.tolist() == [[0] * 4]
    assert np.isnan(learner.tensor_step_history.fit).all()
    assert learner.loadings is None


def test_one_agent_is_left_alone_and_nothing_is_kept_for_it() -> None:
    plain = QLearning(PROBLEM, epsilon=0.5, seed=3).learn(12)
    alone = QLearning(PROBLEM, epsilon=0.5, seed=3, tensor_step=VISITS).learn(12)
    np.testing.assert_array_equal(alone.q, plain.q)
    assert not alone.change_logs[0].enabled


def test_a_function_of_one_agent_is_told_of_no_rows() -> None:
    def look(context: ShareContext) -> FloatArray:
        assert (context.states.size, context.rows.shape, context.changes.shape) == (0, (1, 0, 3), (1, 0, 3))
        return np.ones(context.changes.shape)

    plain = QLearning(PROBLEM, epsilon=0.5, seed=3).learn(4)
    for ranks in (None, (2, 2, 2, 1)):
        step = TensorStep(every=2, ranks=ranks, weights="none", share=look)
        np.testing.assert_array_equal(QLearning(PROBLEM, epsilon=0.5, seed=3, tensor_step=step).learn(4).q, plain.q)


def test_it_works_with_weights_of_a_decomposition() -> None:
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), weights="paper", share="visits")
    settings: dict[str, Any] = {"epsilon": 1.0, "n_agents": 3, "seed": 3}
    decomposed = QLearning(PROBLEM, tensor_step=step, **settings).learn(4)
    np.testing.assert_array_equal(decomposed.q, QLearning(PROBLEM, tensor_step=VISITS, **settings).learn(4).q)
    assert decomposed.action_weights.max() < 1


def entry_by_entry(context: ShareContext) -> FloatArray:
    """What "visits" does, as a user writes it."""
    assert context.rows.shape == context.changes.shape == (3, context.states.size, 3)
    assert context.returns.shape == (4, 3)
    total = context.changes.sum(axis=0)
    return np.asarray(np.where(total > 0, context.changes / np.maximum(total, 1), 1 / 3))


def test_a_users_function_may_mix_entries() -> None:
    settings: dict[str, Any] = {"epsilon": 0.5, "n_agents": 3, "seed": 3}
    ours = QLearning(PROBLEM, tensor_step=VISITS, **settings).learn(12)
    theirs = TensorStep(every=4, weights="none", share=entry_by_entry)
    np.testing.assert_array_equal(QLearning(PROBLEM, tensor_step=theirs, **settings).learn(12).q, ours.q)


def test_the_rows_are_those_at_the_end_of_the_window() -> None:
    def look(context: ShareContext) -> None:
        np.testing.assert_array_equal(context.rows, learner.q[:, context.states])
        others = np.delete(learner.q, context.states, axis=1)
        np.testing.assert_array_equal(others, np.broadcast_to(others[0], others.shape))

    step = TensorStep(every=2, weights="none", share=look)
    learner = QLearning(PROBLEM, n_agents=3, tensor_step=step, epsilon=0.5, seed=3)
    learner.learn(10)


def test_rows_that_an_unshared_window_left_different_get_the_mean(tmp_path: Path) -> None:
    seen: list[ShareContext] = []

    def second_time(context: ShareContext) -> FloatArray | None:
        seen.append(context)
        return None if len(seen) == 1 else entry_by_entry(context._replace(returns=np.zeros((4, 3))))

    problem = random_mdp(12, n_states=60, limit=3)  # of which a window of one episode leaves most untouched
    step = TensorStep(every=1, weights="none", share=second_time)
    learner = QLearning(problem, n_agents=3, tensor_step=step, epsilon=1.0, seed=3).learn(1)
    before = learner.q
    learner.save(tmp_path / "agent")
    learner.learn(1)
    first, second = seen
    differing = np.flatnonzero((before != before[0]).any(axis=(0, 2)))
    assert set(differing) <= set(first.states) & set(second.states)
    unchanged = np.setdiff1d(differing, second.states[second.changes.any(axis=(0, 2))])
    assert unchanged.size
    np.testing.assert_allclose(learner.q[0][unchanged], before[:, unchanged].mean(axis=0), rtol=1e-15)
    np.testing.assert_array_equal(learner.q, np.broadcast_to(learner.q[0], learner.q.shape))
    learner.learn(1)
    assert len(seen[2].states) < len(second.states), "tables were equal when the third window began"
    again = QLearning.load(tmp_path / "agent", tensor_step=step).learn(2)
    assert_same(again, learner)


def test_norms_are_refused_where_nothing_was_decomposed() -> None:
    step = TensorStep(every=2, weights="none", share=lambda context: int(np.argmax(context.agent_norms)))
    learner = QLearning(PROBLEM, n_agents=2, tensor_step=step, seed=3)
    with pytest.raises(
        ParameterError, match=r"agent_norms are the row norms .* give TensorStep ranks, or read returns"
    ):
        learner.learn(2)


@pytest.mark.parametrize("answer", ["nothing", "twice", "transposed", "nan"])
def test_weights_of_entries_that_do_not_sum_to_one_are_refused(answer: str) -> None:
    def wrong(context: ShareContext) -> FloatArray:
        shares = np.full(context.changes.shape, 0.5)
        shares[0, 0, 0] = {"nothing": 0.0, "twice": 1.0, "nan": np.nan}.get(answer, 0.5)
        return shares.T if answer == "transposed" else shares

    step = TensorStep(every=2, weights="none", share=wrong)
    with pytest.raises(
        ParameterError, match=r"weights \(2, \d+, 3\) of the entries of \d+ rows that sum to 1 over the"
    ):
        QLearning(PROBLEM, n_agents=2, tensor_step=step, seed=3).learn(2)
