"""The compressed window is the stack of whole tables, entry by entry or as far as the factors can see."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.learners.worlds import random_mdp
from tuckerl import DynaH, QLearning, TabularMDP, TensorStep
from tuckerl.tensor import TuckerDecomposition, decompose, unfold

PROBLEM = random_mdp(51, n_states=14, n_actions=3, limit=4)
EVERY, AGENTS = 4, 3
Table = NDArray[np.float64]

TABLES: dict[str, Any] = {
    "zero": 0.0,
    "one number": -0.75,
    "a table": np.random.default_rng(5).normal(size=(14, 3)),
    "a table with zeros": np.where(np.random.default_rng(5).random((14, 3)) < 0.7, 0.0, 2.0),
}


def play_windows(
    monkeypatch: pytest.MonkeyPatch, learner_class: type[QLearning | DynaH], initial_q: Any, share: str
) -> tuple[QLearning | DynaH, list[tuple[Table, Table]]]:
    """Play window by window, and keep the tensor that was decomposed beside the stack of whole tables."""
    seen: list[Table] = []
    shared: list[Table] = []

    def spy(tensor: Table, *arguments: Any) -> TuckerDecomposition:
        seen.append(tensor.copy())
        shared.append(learner.q)  # the last episode's tables, before they are shared
        return decompose(tensor, *arguments)

    monkeypatch.setattr("tuckerl.generalization.step.decompose", spy)
    step = TensorStep(every=EVERY, ranks=(3, 2, 2, 1), share=share, floor=0.1)
    learner = learner_class(PROBLEM, alpha=0.4, n_agents=AGENTS, initial_q=initial_q, tensor_step=step, seed=7)
    windows = []
    for _ in range(3):
        tables = []
        for episode in range(EVERY):
            learner.learn(1)
            tables.append(learner.q if episode < EVERY - 1 else shared[-1])
        dense = np.moveaxis(np.stack(tables), (2, 3, 0, 1), (0, 1, 2, 3))
        windows.append((seen[-1], dense))
    return learner, windows


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "consensus", "none"])
@pytest.mark.parametrize("initial_q", TABLES)
@pytest.mark.parametrize("learner_class", [QLearning, DynaH])
def test_the_window_holds_the_tables(
    monkeypatch: pytest.MonkeyPatch, learner_class: type[QLearning | DynaH], initial_q: str, share: str
) -> None:
    _, windows = play_windows(monkeypatch, learner_class, TABLES[initial_q], share)
    for tensor, dense in windows:
        assert dense.shape == (14, 3, EVERY, AGENTS)
        for row in dense:
            still = (row == row[:, :1]).all()
            assert still or (tensor == row).all(axis=(1, 2, 3)).any()  # what changed is there entry by entry
        for mode in (1, 2, 3):
            ours, theirs = unfold(tensor, mode), unfold(dense, mode)
            np.testing.assert_allclose(ours @ ours.T, theirs @ theirs.T, rtol=1e-12, atol=1e-12)
        ours, theirs = unfold(tensor, 0), unfold(dense, 0)
        np.testing.assert_allclose(ours.T @ ours, theirs.T @ theirs, rtol=1e-12, atol=1e-12)


def test_the_window_is_as_small_as_what_changed_in_it() -> None:
    n_states = 200
    ring = np.stack([(np.arange(n_states) + 1) % n_states, np.arange(n_states)], axis=1)  # one action moves on
    reward = np.random.default_rng(0).normal(size=ring.shape)
    problem = TabularMDP(ring, reward, np.zeros_like(ring, dtype=bool), max_episode_steps=400)
    step = TensorStep(every=2, ranks=(2, 2, 2, 1))
    learner = QLearning(problem, epsilon=1.0, tensor_step=step, seed=0).learn(2)
    step_state = learner._state.tensor_step
    assert step_state is not None
    touched = step_state.snapshots.states.size
    assert touched > 150
    short = QLearning(problem.with_time_limit(5), epsilon=1.0, seed=0)  # lends its world, where five steps touch few
    learner._state.worlds = short._state.worlds
    learner.learn(1)
    tensor = step_state.snapshots.tensor(learner.change_logs, np.arange(2))
    assert tensor.shape[0] <= 5 + 2
    dense = np.stack([learner.q[0], learner.q[0]], axis=2)  # as after an episode that changes nothing more
    ours, theirs = unfold(tensor, 1), unfold(dense, 1)
    np.testing.assert_allclose((ours @ ours.T), theirs @ theirs.T, rtol=1e-9)


def test_when_every_state_was_touched_no_row_is_added() -> None:
    problem = random_mdp(52, n_states=2)
    for initial_q in (0.5, np.full((2, 3), 0.5)):
        step = TensorStep(every=10, ranks=(1, 1, 1, 1))
        learner = QLearning(problem, epsilon=1.0, initial_q=initial_q, tensor_step=step, seed=0).learn(9)
        step_state = learner._state.tensor_step
        assert step_state is not None
        assert step_state.snapshots.tensor(learner.change_logs, np.arange(10)).shape == (2, 3, 10, 1)


def test_windows_of_equally_many_changes_of_other_states_are_told_apart() -> None:
    n_states = 8
    ends, rewards = np.ones((n_states, 2), dtype=bool), np.ones((n_states, 2))
    problem = TabularMDP(np.zeros((n_states, 2), dtype=int), rewards, ends, start=np.full(n_states, 1 / n_states))
    learner = QLearning(problem, tensor_step=TensorStep(every=1, ranks=(1, 1, 1, 1), floor=0.1), seed=0)
    step_state = learner._state.tensor_step
    assert step_state is not None
    for _ in range(30):
        learner.learn(1)  # of one step, which changes one row
        assert step_state.snapshots.changed.tolist() == learner.trajectories[0][:1].tolist()
