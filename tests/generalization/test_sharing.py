"""Whose table all agents go on with: each rule by hand, and what becomes of the tables."""

from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import QLearning, TensorStep
from tuckerl.errors import ParameterError
from tuckerl.generalization.mixtures import share_tables
from tuckerl.generalization.sharing import SHARING_RULES, ShareContext, custom_sharing
from tuckerl.types import FloatArray

PROBLEM = random_mdp(71, n_states=8, n_actions=3)
RANKS = (3, 2, 2, 2)


def context(norms: list[float], returns: list[list[float]] | None = None, seed: int = 0) -> ShareContext:
    rows = np.zeros((2, len(norms))) if returns is None else np.array(returns)
    return ShareContext(np.array(norms), rows, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("rule", "norms", "mixture"),
    [
        ("max", [0.2, 0.7, 0.5], [0, 1, 0]),
        ("max", [0.5, 0.2, 0.5], [1, 0, 0]),
        ("max", [0.5, 0.2, np.nextafter(0.5, 1)], [1, 0, 0]),
        ("min", [0.2, 0.7, 0.1], [0, 0, 1]),
        ("min", [0.7, 0.2, 0.2], [0, 1, 0]),
        ("min", [0.7, 0.2, np.nextafter(0.2, 0)], [0, 1, 0]),
        ("mean", [0.2, 0.7, 0.1], [1 / 3] * 3),
        ("consensus", [0.2, 0.7, 0.1], [0.2, 0.7, 0.1]),
        ("consensus", [1.0, 2.0, 1.0], [0.25, 0.5, 0.25]),
    ],
)
def test_rules_on_norms(rule: str, norms: list[float], mixture: list[float]) -> None:
    mixed = SHARING_RULES[rule].mix(context(norms))
    assert mixed is not None
    np.testing.assert_allclose(mixed, mixture, rtol=1e-15)


def test_best_looks_at_returns_and_takes_the_lowest_of_equals() -> None:
    mixed = SHARING_RULES["best"].mix(context([1, 1, 1], [[-5, -1, -9], [-5, -8, 0]]))
    np.testing.assert_array_equal(mixed, [0, 1, 0])


def test_random_takes_everyone() -> None:
    mixtures = [SHARING_RULES["random"].mix(context([1, 1, 1], seed=seed)) for seed in range(60)]
    counts = np.sum(mixtures, axis=0)  # type: ignore[arg-type]
    assert counts.sum() == 60
    assert (counts > 8).all()


def test_none_shares_nothing() -> None:
    assert SHARING_RULES["none"].mix(context([1, 1, 1])) is None


def test_tables_are_copied_or_mixed_in_place() -> None:
    q = np.array([[[1.0, 2.0]], [[3.0, 6.0]]])
    share_tables(q, np.array([0.25, 0.75]), None)
    np.testing.assert_array_equal(q, [[[2.5, 5.0]]] * 2)
    q = np.array([[[1.0], [2.0]], [[3.0], [4.0]]])
    share_tables(q, np.array([0.0, 1.0]), np.array([1]))
    np.testing.assert_array_equal(q, [[[1.0], [4.0]], [[3.0], [4.0]]])


def _before_and_after(share: str, n_agents: int = 3) -> tuple[QLearning, FloatArray, FloatArray]:
    """Return a learner after one window, the tables before sharing, and the row norms of the agent factor."""
    kept: list[Any] = []

    def keep(shared: ShareContext) -> None:
        kept.append((learner.q, shared.agent_norms.copy(), shared.returns.copy()))

    settings: dict[str, Any] = {"epsilon": 0.5, "alpha": 0.4, "n_agents": n_agents, "seed": 3, "initial_q": -0.5}
    learner = QLearning(PROBLEM, tensor_step=TensorStep(every=4, ranks=RANKS, share=keep), **settings)
    learner.learn(4)
    shared = QLearning(PROBLEM, tensor_step=TensorStep(every=4, ranks=RANKS, share=share), **settings).learn(4)
    np.testing.assert_array_equal(kept[0][2], shared.returns)
    return shared, kept[0][0], kept[0][1]


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "min", "best", "random"])
def test_all_agents_go_on_with_the_chosen_table(share: str) -> None:
    learner, before, norms = _before_and_after(share)
    chosen = int(learner.tensor_step_history.chosen[0])
    np.testing.assert_array_equal(learner.q, np.broadcast_to(before[chosen], before.shape))
    if share in ("max", "min"):
        assert chosen == (np.argmax(norms) if share == "max" else np.argmin(norms))
    if share == "best":
        assert chosen == np.argmax(learner.returns.mean(axis=0))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["mean", "consensus"])
def test_all_agents_go_on_with_the_mixed_table_entry_by_entry(share: str) -> None:
    learner, before, norms = _before_and_after(share)
    parts = np.ones(3) / 3 if share == "mean" else norms / norms.sum()
    for s in range(PROBLEM.n_states):
        for a in range(PROBLEM.n_actions):
            entry = sum(parts[agent] * before[agent, s, a] for agent in range(3))
            np.testing.assert_allclose(learner.q[:, s, a], entry, rtol=1e-14)
    assert learner.tensor_step_history.chosen.tolist() == [-1]


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_without_sharing_tables_stay_apart() -> None:
    learner, before, _ = _before_and_after("none")
    np.testing.assert_array_equal(learner.q, before)
    assert learner.tensor_step_history.chosen.tolist() == [-1]


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_norms_are_those_of_the_agent_factor() -> None:
    _, _, norms = _before_and_after("none")
    np.testing.assert_allclose((norms**2).sum(), 2.0, rtol=1e-12)  # two orthonormal columns


def test_sharing_without_a_decomposition_gives_the_same_tables() -> None:
    settings: dict[str, Any] = {"epsilon": 0.5, "n_agents": 3, "seed": 3}
    steps = [TensorStep(every=4, ranks=(1, 1, 1, 1), weights=w, share="best") for w in ("none", lambda d: [1, 1, 1])]
    assert [step.needs_decomposition for step in steps] == [False, True]
    quick, thorough = (QLearning(PROBLEM, tensor_step=step, **settings).learn(12) for step in steps)
    np.testing.assert_array_equal(quick.q, thorough.q)
    np.testing.assert_array_equal(quick.tensor_step_history.chosen, thorough.tensor_step_history.chosen)


@pytest.mark.parametrize(
    ("answer", "mixture"),
    [
        (1, [0, 1, 0]),
        (np.int64(2), [0, 0, 1]),
        ([0.5, 0.25, 0.25], [0.5, 0.25, 0.25]),
        ((0, 1, 0), [0, 1, 0]),
        ([2.0, -1.0, 0.0], [2, -1, 0]),
        (None, None),
    ],
)
def test_answers_of_a_share_function(answer: Any, mixture: list[float] | None) -> None:
    mixed = custom_sharing(lambda context: answer, reads_norms=True).mix(context([1, 1, 1]))
    assert (mixed is None) if mixture is None else np.array_equal(mixed, mixture)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "answer", [3, -1, 1.0, True, "max", [1.0, 0.0], [0.5, 0.5, 0.5], [np.nan] * 3, ["a", "b", "c"], [[1.0], [0.0, 0.0]]]
)
def test_wrong_answers_of_a_share_function(answer: Any) -> None:
    rule = custom_sharing(lambda context: answer, reads_norms=True)
    with pytest.raises(
        ParameterError, match="must return an agent's index from 0 to 2, 3 mixture weights that sum to 1"
    ):
        rule.mix(context([1, 1, 1]))
