"""Windows whose tables cannot be decomposed, and tables near the largest float."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor
from tuckerl import QLearning, TabularMDP, TensorStep
from tuckerl.errors import DecompositionError, DecompositionWarning
from tuckerl.generalization import step as tensor_step
from tuckerl.reports.inspect.file import inspect_file
from tuckerl.reports.inspect.page import write_inspection
from tuckerl.tensor import decompose

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")

STEP = TensorStep(every=2, ranks=(2, 2, 1, 1), share="max")


def fail_at(monkeypatch: pytest.MonkeyPatch, *calls: int) -> None:
    """Let these calls of the decomposition fail, counted from 0."""
    count = iter(range(1000))

    def failing(*arguments: Any) -> Any:
        if next(count) in calls:
            raise DecompositionError("LAPACK gave no factors")
        return decompose(*arguments)

    monkeypatch.setattr(tensor_step, "decompose", failing)


def learner(step: TensorStep = STEP) -> QLearning:
    return QLearning(corridor(4), n_agents=2, alpha=0.5, epsilon=0.5, initial_q=1.0, seed=3, tensor_step=step)


def test_weights_and_tables_stay_and_learning_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    fail_at(monkeypatch, 1, 3)
    made = learner().learn(2)
    assert not made.tensor_step_history.failed.any()
    weights, shared = made.action_weights, made.tensor_step_history.chosen
    assert shared[0] >= 0
    with pytest.warns(DecompositionWarning, match="could not be decomposed .*LAPACK gave.* stay as they are") as caught:
        made.learn(8)
    assert len(caught) == 1, "it is said once"
    assert caught[0].filename == __file__, "the line that learns is named"
    history = made.tensor_step_history
    assert history.failed.tolist() == [False, True, False, True, False]
    np.testing.assert_array_equal(history.weights[1], weights)
    np.testing.assert_array_equal(history.weights[3], history.weights[2])
    assert history.chosen[[1, 3]].tolist() == [-1, -1]
    assert np.isnan(history.fit[[1, 3]]).all()
    assert np.isfinite(history.fit[[0, 2, 4]]).all()
    assert made.diverged_at is None


def test_nothing_is_shared(monkeypatch: pytest.MonkeyPatch) -> None:
    fail_at(monkeypatch, 0)
    with pytest.warns(DecompositionWarning):
        made = learner().learn(2)
    alone = QLearning(corridor(4), n_agents=2, alpha=0.5, epsilon=0.5, initial_q=1.0, seed=3).learn(2)
    np.testing.assert_array_equal(made.q, alone.q)
    assert made.loadings is None


@pytest.mark.slow
def test_files_and_pages_tell_of_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fail_at(monkeypatch, 1)
    made = learner()
    with pytest.warns(DecompositionWarning):
        made.learn(6)
    made.save(tmp_path / "agent.tuckerl")
    loaded = QLearning.load(tmp_path / "agent.tuckerl")
    np.testing.assert_array_equal(loaded.tensor_step_history.failed, [False, True, False])
    inspection, lines = inspect_file(tmp_path / "agent.tuckerl")
    assert "No decomposition could be found after 1 window: weights and tables stayed" in lines
    page = write_inspection(inspection, tmp_path / "page").read_text()
    assert "No decomposition could be found after 1 window" in page
    assert "nothing was learned yet" not in page


@pytest.mark.parametrize("initial_q", [1e308, -1e308, [[1e308, 1.2e308]] * 40])
def test_tables_near_the_largest_float_are_decomposed(initial_q: Any) -> None:
    # Forty rows that nobody touched stand in the tensor as few, whose squares and sums leave the range of floats.
    problem = TabularMDP([[0, 0]] * 40, np.zeros((40, 2)), [[True, True]] * 40, start=0)
    made = QLearning(problem, initial_q=initial_q, alpha=0.25, epsilon=1.0, seed=0, tensor_step=STEP)
    small = QLearning(problem, initial_q=np.multiply(initial_q, 2.0**-1000), alpha=0.25, epsilon=1.0, seed=0)
    small = QLearning(problem, initial_q=small.initial_q, alpha=0.25, epsilon=1.0, seed=0, tensor_step=STEP)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", category=UserWarning)  # clipped ranks
        for one in (made, small):
            one.learn(6)
    assert made.diverged_at is None
    assert np.isfinite(made.tensor_step_history.fit).all()
    np.testing.assert_allclose(made.tensor_step_history.weights, small.tensor_step_history.weights, rtol=1e-12)
    assert made.loadings is not None
    assert np.isfinite(made.loadings.core).all()
