"""The compressed window is the stack of whole tables, entry by entry or as far as the factors can see."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.learners.worlds import random_mdp
from tuckerl import DynaH, QLearning, TensorStep
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
    learner, windows = play_windows(monkeypatch, learner_class, TABLES[initial_q], share)
    assert learner._run is not None
    touched = learner._run.snapshots.states
    assert 0 < np.unique(touched).size == touched.size < PROBLEM.n_states  # some rows are never touched
    initial = np.zeros((14, 3)) + TABLES[initial_q]
    for tensor, dense in windows:
        assert dense.shape == (14, 3, EVERY, AGENTS)
        n_touched = tensor.shape[0] - 3 if initial_q.startswith("a table") else tensor.shape[0]
        n_touched -= initial_q == "one number"
        places = touched[:n_touched]
        np.testing.assert_array_equal(tensor[:n_touched], dense[places])
        untouched = np.setdiff1d(np.arange(14), places)
        np.testing.assert_array_equal(
            dense[untouched], np.broadcast_to(initial[untouched, :, None, None], dense[untouched].shape)
        )
        for mode in (1, 2, 3):
            ours, theirs = unfold(tensor, mode), unfold(dense, mode)
            np.testing.assert_allclose(ours @ ours.T, theirs @ theirs.T, rtol=1e-12, atol=1e-12)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_untouched_zeros_cost_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    learner, windows = play_windows(monkeypatch, QLearning, 0.0, "max")
    assert learner._run is not None
    assert windows[-1][0].shape[0] == learner._run.snapshots.states.size
    for tensor, dense in windows:
        assert tensor.shape[0] >= np.count_nonzero(dense.any(axis=(1, 2, 3)))
    _, windows = play_windows(monkeypatch, QLearning, 1.0, "max")
    assert windows[-1][0].shape[0] <= 14


def test_when_every_state_was_touched_no_row_is_added() -> None:
    problem = random_mdp(52, n_states=2)
    for initial_q in (0.5, np.full((2, 3), 0.5)):
        step = TensorStep(every=10, ranks=(1, 1, 1, 1))
        learner = QLearning(problem, epsilon=1.0, initial_q=initial_q, tensor_step=step, seed=0).learn(9)
        assert learner._run is not None
        assert learner._run.snapshots.tensor(learner._logs).shape == (2, 3, 10, 1)
