"""What a TensorStep takes, and what it refuses."""

from typing import Any

import numpy as np
import pytest

from tuckerl import TensorStep
from tuckerl.errors import ParameterError, ParameterTypeError, TuckerlError, UnknownNameError
from tuckerl.generalization.loadings import Loadings
from tuckerl.generalization.sharing import ShareContext
from tuckerl.generalization.step import TensorStepState
from tuckerl.types import FloatArray

RIGHT: dict[str, Any] = {"every": 10, "ranks": (15, 3, 9, 1)}


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"every": 0}, ParameterError, "every must be a whole number of at least 1; got 0"),
        ({"every": 2.0}, ParameterTypeError, "every .* got 2.0"),
        ({"ranks": (1, 2, 3)}, ParameterError, r"ranks must be four whole numbers .* got 3: \(1, 2, 3\)"),
        ({"ranks": (1, 2, 3, 4, 5)}, ParameterError, "got 5"),
        ({"ranks": (0, 1, 1, 1)}, ParameterError, "the state rank must be a whole number of at least 1; got 0"),
        ({"ranks": (1, -1, 1, 1)}, ParameterError, "the action rank .* got -1"),
        ({"ranks": (1, 1, 1.5, 1)}, ParameterTypeError, "the episode rank .* got 1.5"),
        ({"ranks": (1, 1, 1, "1")}, ParameterTypeError, "the agent rank .* got '1'"),
        ({"ranks": 3}, ParameterTypeError, "ranks must be four .* got 3"),
        ({"ranks": "1234"}, ParameterTypeError, "got '1234'"),
        (
            {"ranks": None},
            ParameterError,
            "ranks must be given, .* read by weights='paper' and share='max': four whole",
        ),
        ({"ranks": None, "weights": "none"}, ParameterError, r"read by share='max'.* share='visits' needs none"),
        ({"ranks": None, "share": "visits"}, ParameterError, r"read by weights='paper': four whole numbers such as"),
        ({"shrink": -0.1}, ParameterError, r"shrink must be a number in \[0, 1\]; got -0.1"),
        ({"shrink": 1.1}, ParameterError, r"shrink .* got 1.1"),
        ({"shrink": "a lot"}, ParameterTypeError, r"shrink .* got 'a lot'"),
        ({"share_every": 0}, ParameterError, r"share_every must be a whole number of at least 1; got 0"),
        ({"share_every": 2.0}, ParameterTypeError, r"share_every .* got 2.0"),
        ({"share_every": 4, "share": "mean"}, ParameterError, r"one of every and share_every must .* 10 and 4: 8 goes"),
        ({"share_every": 25}, ParameterError, r"must be a multiple of the other; got 10 and 25: 20 goes with 10"),
        ({"share_every": 5}, ParameterError, r"share_every must be a multiple of every where share='max' reads the"),
        ({"share_every": 5, "share": "visits", "shrink": 0.5}, ParameterError, r"where shrink=0.5 reads the factors"),
        (
            {"ranks": None, "weights": "none", "share": "visits", "shrink": 0.5},
            ParameterError,
            r"ranks must be given, as the factors of a decomposition are read by shrink=0.5: four whole numbers",
        ),
        ({"weights": "papr"}, UnknownNameError, "unknown weights 'papr': did you mean 'paper'"),
        ({"weights": "omega"}, UnknownNameError, "use one of constant, none, paper, permuted, relative"),
        ({"weights": None}, ParameterTypeError, "weights must be one of constant, .* got None"),
        ({"share": "maxx"}, UnknownNameError, "unknown share 'maxx': did you mean 'max'"),
        ({"share": 0}, ParameterTypeError, "share must be one of best, .* got 0"),
        ({"floor": -0.1}, ParameterError, r"floor must be a number in \[0, 1\]; got -0.1"),
        ({"floor": 1.1}, ParameterError, "floor .* got 1.1"),
        ({"tol": -1.0}, ParameterError, "tol .* got -1.0"),
        ({"max_iterations": -1}, ParameterError, "max_iterations .* got -1"),
    ],
)
def test_wrong_parameters(parameters: dict[str, Any], error: type[TuckerlError], message: str) -> None:
    with pytest.raises(error, match=message):
        TensorStep(**(RIGHT | parameters))


@pytest.mark.parametrize("ranks", [[15, 3, 9, 1], np.array([15, 3, 9, 1])])
def test_ranks_may_be_any_sequence(ranks: Any) -> None:
    assert TensorStep(every=np.int64(10), ranks=ranks) == TensorStep(**RIGHT)  # type: ignore[arg-type]
    assert TensorStep(every=10, ranks=ranks).ranks == (15, 3, 9, 1)


@pytest.mark.parametrize(
    ("weights", "share", "needed"),
    [
        ("paper", "none", True),
        ("constant", "max", True),
        ("constant", "min", True),
        ("none", "consensus", True),
        ("constant", "none", False),
        ("constant", "best", False),
        ("none", "mean", False),
        ("none", "visits", False),
        ("paper", "visits", True),
        ("none", "random", False),
        ("none", lambda context: 0, True),
        (lambda decomposition: [1.0], "none", True),
    ],
)
def test_tables_are_decomposed_only_where_something_reads_the_factors(weights: Any, share: Any, needed: bool) -> None:
    assert TensorStep(**RIGHT, weights=weights, share=share).needs_decomposition is needed


def test_ranks_are_needed_only_where_something_reads_the_factors() -> None:
    for weights in ("none", "constant"):
        for share in ("visits", "mean", "best", "random", "none", lambda context: None):
            step = TensorStep(every=3, weights=weights, share=share)
            assert step.ranks is None
            assert not step.needs_decomposition


def test_changes_are_kept_only_where_something_reads_them() -> None:
    visits = TensorStep(every=3, weights="none", share="visits")
    assert [visits.logged_episodes(n_agents) for n_agents in (1, 2)] == [0, 3]
    assert TensorStep(every=3, weights="none", share="mean").logged_episodes(2) == 0
    assert TensorStep(**RIGHT).logged_episodes(1) == 10


def test_steps_are_as_far_apart_as_the_more_frequent_of_the_two() -> None:
    for share_every, share_interval, interval in ((None, 10, 10), (5, 5, 5), (30, 30, 10), (10, 10, 10)):
        step = TensorStep(10, weights="none", share="visits", share_every=share_every)
        assert (step.share_interval, step.interval) == (share_interval, interval)
        assert step.logged_episodes(3) == share_interval
    assert TensorStep(10, (1, 1, 1, 1), share="visits", share_every=5).logged_episodes(3) == 10
    assert TensorStep(10, (1, 1, 1, 1), share="visits", share_every=30).logged_episodes(3) == 30
    assert TensorStep(10, (1, 1, 1, 1), share="mean", share_every=30).logged_episodes(3) == 10


def test_a_function_is_given_norms_only_where_they_are_those_of_this_window() -> None:
    def norms(context: ShareContext) -> FloatArray:
        return np.asarray(context.agent_norms / context.agent_norms.sum())

    assert TensorStep(10, (1, 1, 1, 1), share=norms).sharing.needs_decomposition
    assert TensorStep(10, (1, 1, 1, 1), share=norms, share_every=20).sharing.needs_decomposition
    assert not TensorStep(10, (1, 1, 1, 1), share=norms, share_every=5).sharing.needs_decomposition


def test_loadings_that_are_made_while_a_window_closes_take_no_newer_ones_place() -> None:
    state = TensorStepState(TensorStep(every=1, ranks=(1, 1, 1, 1)), np.zeros((2, 2)), 1, np.random.SeedSequence(0))
    older, newer = (Loadings(np.arange(1), (), np.zeros((1, 1, 1, 1)), episode) for episode in (1, 2))

    def make() -> Loadings:
        state._loadings = newer  # as another thread does that closes a window
        return older

    state._loadings = make
    assert state.loadings is older, "of the window that was the latest"
    assert state.loadings is newer
