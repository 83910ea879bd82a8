"""What a Tucker decomposition must be: its definition, bounds, known tensors and two other libraries."""

import copy
import pickle
import tracemalloc
import warnings
from random import Random
from typing import Any

import numpy as np
import pytest
import tensorly
import tensorly.decomposition
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pyttb.tensor import tensor as ttb_tensor
from pyttb.tucker_als import tucker_als

from tests.reference import tensor as reference
from tests.tensor.examples import Floats, low_rank, random_tensor
from tuckerl.tensor import TuckerDecomposition, decompose, decomposition, mode_product, tucker, unfold
from tuckerl.tensor.hooi import iterate

CASES = [
    ((9, 6), (3, 3)),
    ((30, 4), (2, 2)),
    ((5, 6, 7), (2, 3, 4)),
    ((40, 3, 4), (6, 2, 3)),
    ((3, 40, 4), (2, 5, 3)),
    ((4, 3, 50), (2, 2, 4)),
    ((3, 4, 5, 3), (2, 2, 3, 2)),
    ((130, 4, 5, 3), (15, 3, 4, 2)),
    ((70, 4, 10, 1), (8, 3, 7, 1)),
    ((3, 2, 4, 3, 2), (2, 2, 3, 2, 1)),
    ((2, 80, 3, 2, 3), (2, 6, 2, 1, 2)),
]


def relative_error(X: Floats, d: TuckerDecomposition) -> float:
    return float(np.linalg.norm(X - d.to_tensor()) / np.linalg.norm(X))


@pytest.mark.parametrize(("shape", "ranks"), CASES)
@pytest.mark.parametrize("iterations", [0, 1, 3])
def test_the_tensor_is_that_of_the_slow_twin(shape: tuple[int, ...], ranks: tuple[int, ...], iterations: int) -> None:
    X = low_rank(shape, ranks, noise=0.3)
    d = tucker(X, ranks, tol=0.0, max_iterations=iterations)
    assert d.iterations == iterations
    np.testing.assert_allclose(d.to_tensor(), reference.tucker(X, ranks, iterations), atol=1e-9)


@pytest.mark.parametrize(("shape", "ranks"), CASES)
def test_parts_belong_together(shape: tuple[int, ...], ranks: tuple[int, ...]) -> None:
    X = random_tensor(shape)
    d = tucker(X, ranks)
    assert d.ranks == d.core.shape == ranks
    core = X
    for mode, factor in enumerate(d.factors):
        assert factor.shape == (shape[mode], ranks[mode])
        np.testing.assert_allclose(factor.T @ factor, np.eye(ranks[mode]), atol=1e-12)
        assert np.all(factor[np.abs(factor).argmax(axis=0), np.arange(ranks[mode])] > 0.0)
        core = mode_product(core, factor.T, mode)
    np.testing.assert_allclose(d.core, core, atol=1e-11)
    assert d.fit == pytest.approx(1.0 - relative_error(X, d), abs=1e-12)


@pytest.mark.parametrize(("shape", "ranks"), CASES)
def test_the_fit_never_falls_over_the_sweeps(shape: tuple[int, ...], ranks: tuple[int, ...]) -> None:
    fits = [tucker(random_tensor(shape), ranks, tol=0.0, max_iterations=k).fit for k in range(6)]
    assert np.all(np.diff(fits) >= -1e-13)
    # A matrix is done at once, and so is a tensor that one factor determines; the others must gain.
    assert len(shape) == 2 or fits[-1] > fits[0]


@pytest.mark.parametrize(("shape", "ranks"), CASES)
def test_the_truncated_higher_order_svd_keeps_its_error_bound(shape: tuple[int, ...], ranks: tuple[int, ...]) -> None:
    X = random_tensor(shape)
    error = np.linalg.norm(X - tucker(X, ranks, max_iterations=0).to_tensor()) ** 2
    cut = [np.sum(np.linalg.svd(unfold(X, n), compute_uv=False)[r:] ** 2) for n, r in enumerate(ranks)]
    assert max(cut) - 1e-9 <= error <= sum(cut) + 1e-9


def test_sweeps_stop_when_the_fit_changes_by_less_than_tol() -> None:
    X = random_tensor((12, 10, 8))
    fits = [tucker(X, (3, 3, 3), tol=0.0, max_iterations=k).fit for k in range(12)]
    changes = np.abs(np.diff(fits))
    tol = float(np.sqrt(changes[3] * changes[4]))
    expected = 1 + int(np.flatnonzero(changes < tol)[0])
    assert 1 < expected < 12
    assert tucker(X, (3, 3, 3), tol=tol).iterations == expected


@pytest.mark.parametrize(
    ("shape", "ranks"), [((300, 4, 10, 3), (5, 3, 4, 2)), ((8, 9, 10), (2, 3, 4)), ((20, 3), (2, 2))]
)
def test_a_low_rank_tensor_is_recovered(shape: tuple[int, ...], ranks: tuple[int, ...]) -> None:
    X = low_rank(shape, ranks)
    d = tucker(X, ranks)
    assert d.fit > 1.0 - 1e-10
    np.testing.assert_allclose(d.to_tensor(), X, atol=1e-12)


@pytest.mark.parametrize("least", [1e-3, 1e-6, 1e-9])
def test_weak_directions_of_a_long_mode_are_found(least: float) -> None:
    # Slices that differ by so little: squaring loses the difference, which the second pass is for.
    X = random_tensor((60, 3, 4))
    X[:, 2] = X[:, 1] + least * random_tensor((60, 4), seed=1)
    d = tucker(X, (12, 3, 4))
    assert d.ranks == (12, 3, 4)
    assert d.fit > 1.0 - 1e-10
    np.testing.assert_allclose(d.factors[0].T @ d.factors[0], np.eye(12), atol=1e-12)
    np.testing.assert_allclose(d.to_tensor(), X, atol=1e-10)


@pytest.mark.parametrize(("shape", "ranks"), [((90, 4, 10, 2), (8, 3, 5, 2)), ((9, 8, 7), (3, 2, 3))])
def test_tensorly_and_pyttb_agree(shape: tuple[int, ...], ranks: tuple[int, ...]) -> None:
    X = low_rank(shape, ranks, noise=0.1)
    d = tucker(X, ranks, tol=1e-14, max_iterations=200)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = tensorly.decomposition.tucker(X, list(ranks), init="svd", tol=1e-13, n_iter_max=200)
        model, _, _ = tucker_als(ttb_tensor(X), list(ranks), stoptol=1e-13, maxiters=200, init="nvecs", printitn=0)
    for other in (tensorly.tucker_to_tensor(theirs), model.full().double()):
        assert d.fit == pytest.approx(1.0 - np.linalg.norm(X - other) / np.linalg.norm(X), abs=1e-10)
        np.testing.assert_allclose(d.to_tensor(), other, atol=1e-6)


def test_the_same_bits_twice() -> None:
    X = random_tensor((200, 4, 5, 3))
    one, two = tucker(X, (9, 3, 4, 2)), tucker(X.copy(), (9, 3, 4, 2))
    for a, b in zip((one.core, *one.factors), (two.core, *two.factors), strict=True):
        np.testing.assert_array_equal(a, b)
    assert (one.fit, one.iterations) == (two.fit, two.iterations)


def test_a_decomposition_can_be_copied_before_anybody_has_read_it() -> None:
    d = tucker(random_tensor((30, 3, 4)), (3, 2, 2))
    assert repr(d).startswith("TuckerDecomposition(ranks=(3, 2, 2), fit=0.")
    pickled = pickle.loads(pickle.dumps(d))  # noqa: S301  # our own bytes
    for copied in (pickled, copy.deepcopy(d)):
        for a, b in zip((d.core, *d.factors), (copied.core, *copied.factors), strict=True):
            np.testing.assert_array_equal(a, b)
        assert (copied.fit, copied.iterations) == (d.fit, d.iterations)


def test_factors_are_a_sequence() -> None:
    factors = tucker(random_tensor((30, 3, 1, 4)), (3, 2, 1, 2)).factors
    assert len(factors) == 4
    assert factors[-1] is factors[3]
    assert [factor.shape for factor in factors[::2]] == [(30, 3), (1, 1)]
    with pytest.raises(IndexError):
        factors[4]


def test_a_sign_is_settled_by_the_first_of_equal_entries() -> None:
    X = np.outer([-1.0, 1.0, 1.0, -1.0], [2.0, 0.0])
    d = tucker(X, (1, 1))
    np.testing.assert_allclose(np.abs(d.factors[0]), 0.5)
    np.testing.assert_allclose(d.to_tensor(), X, atol=1e-15)


shapes_and_ranks = st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=2, max_size=4).map(
    lambda pairs: (tuple(a for a, _ in pairs), tuple(b for _, b in pairs))
)


def decompose_quietly(X: Floats, ranks: tuple[int, ...], iterations: int) -> TuckerDecomposition:
    return decompose(np.ascontiguousarray(X), ranks, 0.0, iterations)


@settings(deadline=None, max_examples=60)
@given(shapes_and_ranks, st.integers(0, 99), st.sampled_from([-3.0, 1e-200, 1e160, 2.0**-30]))
def test_a_scaled_tensor_has_the_same_factors_and_a_scaled_core(
    sizes: tuple[tuple[int, ...], tuple[int, ...]], seed: int, scale: float
) -> None:
    shape, ranks = sizes
    X = random_tensor(shape, seed)
    one, other = decompose_quietly(X, ranks, 2), decompose_quietly(scale * X, ranks, 2)
    assert one.ranks == other.ranks
    assert one.fit == pytest.approx(other.fit, abs=1e-7)
    np.testing.assert_allclose(other.to_tensor() / scale, one.to_tensor(), atol=1e-6)


@settings(deadline=None, max_examples=60)
@given(shapes_and_ranks, st.integers(0, 99), st.randoms(use_true_random=False))
def test_a_permuted_tensor_has_permuted_parts(
    sizes: tuple[tuple[int, ...], tuple[int, ...]], seed: int, random: Random
) -> None:
    shape, ranks = sizes
    X = random_tensor(shape, seed)
    # The truncated SVD treats all modes alike; sweeps go in order, so they do not.
    axes = list(range(X.ndim))
    random.shuffle(axes)
    rows = [np.random.default_rng(seed + n).permutation(size) for n, size in enumerate(shape)]
    one = decompose_quietly(X, ranks, 0)
    assume(one.ranks == tuple(map(min, ranks, shape)))
    shuffled = X[np.ix_(*rows)].transpose(axes)
    other = decompose_quietly(shuffled, tuple(ranks[n] for n in axes), 0)
    assert other.ranks == tuple(one.ranks[n] for n in axes)
    np.testing.assert_allclose(other.to_tensor(), one.to_tensor()[np.ix_(*rows)].transpose(axes), atol=1e-6)


@pytest.mark.parametrize("rows", [3, 30])
def test_factors_are_orthonormal_where_a_projection_has_fewer_directions(rows: int) -> None:
    # Of rank 3 in each mode, but with the third factor at its last unit vector only one direction is left.
    cube = np.zeros((3, 3, 3))
    cube[0, 1, 2], cube[1, 2, 0], cube[2, 0, 1] = 3.0, 2.0, 1.0
    X = mode_product(cube, np.linalg.qr(random_tensor((rows, 3)))[0], 0)
    d = tucker(X, (2, 2, 1))
    assert d.ranks == (2, 2, 1)
    for factor in d.factors:
        np.testing.assert_allclose(factor.T @ factor, np.eye(factor.shape[1]), atol=1e-12)
    np.testing.assert_allclose(d.to_tensor(), reference.tucker(X, (2, 2, 1), 1), atol=1e-9)


@pytest.mark.parametrize("mode", [0, 1])
def test_sweeps_see_the_long_mode_compressed(mode: int, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, ...]] = []

    def spy(X: Floats, *arguments: Any) -> Any:
        seen.append(X.shape)
        return iterate(X, *arguments)

    monkeypatch.setattr(decomposition, "iterate", spy)
    shape = [3, 4]
    shape.insert(mode, 500)
    tucker(random_tensor(tuple(shape)), (2, 2, 2), max_iterations=1)
    shape[mode] = 12
    assert seen == [tuple(shape)]


@pytest.mark.parametrize("mode", [0, 2])
def test_a_long_tensor_takes_little_memory(mode: int) -> None:
    shape = [25, 10, 2]
    shape.insert(mode, 8192)
    ranks = [10, 9, 1]
    ranks.insert(mode, 50)
    tracemalloc.start()
    try:
        X = random_tensor(tuple(shape))
        tracemalloc.reset_peak()
        tucker(X, tuple(ranks), max_iterations=2)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert X.nbytes < peak < 3 * X.nbytes


def test_what_is_changed_afterwards_changes_no_factor() -> None:
    X = np.random.default_rng(0).normal(size=(60, 3, 4, 2))
    expected = tucker(X.copy(), (5, 2, 3, 2)).factors[0].copy()
    found = tucker(X, (5, 2, 3, 2))
    X[:] = 0.0
    np.testing.assert_array_equal(found.factors[0], expected)
