"""Each factorisation has several ways, which agree, and an error of its own where none leads anywhere."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.tensor.examples import Floats, random_tensor
from tuckerl import tucker
from tuckerl.errors import DecompositionError
from tuckerl.tensor import solvers
from tuckerl.tensor.singular import leading, orthonormal
from tuckerl.tensor.solvers import few_eigen


def clustered_grams(n: int) -> Iterator[Floats]:
    """Yield Gram matrices of the kind on which a build of LAPACK gave up: most eigenvalues 1, or next to nothing."""
    rng = np.random.default_rng(0)
    for i in range(n):
        size = int(rng.integers(20, 100))
        noise = 10.0 ** rng.integers(-18, -6) * rng.standard_normal((size, size))
        if i % 3 == 0:  # what a second pass sees: columns of length 1, or of rounding
            A = np.linalg.qr(rng.standard_normal((200, size)))[0]
            A[:, size // 3 :] *= 10.0 ** rng.uniform(-12, -6, size - size // 3)
            yield A.T @ A
        elif i % 3 == 1:  # the identity in a part, zeros in the rest, and rounding
            yield np.diag(np.arange(size) < size // 2).astype(np.float64) + (noise @ noise.T)
        else:  # tables that are equal over the episodes of a window
            A = np.repeat(rng.standard_normal((200, 5)), size // 5 + 1, axis=1)
            A += 1e-9 * rng.standard_normal(A.shape)
            yield A.T @ A


@pytest.mark.parametrize("way", [solvers._eigh, solvers._robust_eigh, solvers._eigen_by_svd])
def test_every_way_finds_the_eigenvalues_of_clustered_matrices(way: Callable[[Floats], Any]) -> None:
    for A in clustered_grams(60):
        values, vectors = way(A)
        largest = np.abs(A).max() * len(A)
        assert np.all(np.diff(values) >= -1e-12 * largest), "smallest first"
        np.testing.assert_allclose((vectors * values) @ vectors.T, A, atol=1e-13 * largest)
        np.testing.assert_allclose(vectors.T @ vectors, np.eye(len(A)), atol=1e-12)


@pytest.mark.long
def test_every_way_finds_them_in_thousands_of_matrices() -> None:
    for A in clustered_grams(5000):
        expected = solvers._eigh(A)[0]
        for way in (solvers._robust_eigh, solvers._eigen_by_svd):
            np.testing.assert_allclose(way(A)[0], expected, atol=1e-12 * np.abs(A).max() * len(A))


@pytest.mark.parametrize("way", [solvers._svd, solvers._svd_by_qr_steps])
def test_every_way_finds_the_singular_values(way: Callable[[Floats], Any]) -> None:
    A = random_tensor((30, 30))
    values, transposed = way(A)
    np.testing.assert_allclose(values, np.linalg.svd(A, compute_uv=False), atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(A @ transposed.T, axis=0), values, atol=1e-13)


USUAL = ["numpy.linalg.eigh", "scipy.linalg.lapack.dsyevd"]


def give_up(*arguments: Any, **parameters: Any) -> Any:
    raise np.linalg.LinAlgError("did not converge")


def answer_nan(A: Floats, *arguments: Any, **parameters: Any) -> Any:
    return (np.full(len(A), np.nan), A, 0)[: 3 if "overwrite_a" in parameters else 2]


@pytest.mark.parametrize("failure", [give_up, answer_nan])
@pytest.mark.parametrize("broken", [USUAL, [*USUAL, "scipy.linalg.eigh"]])
def test_a_tensor_is_decomposed_where_the_usual_way_fails(
    failure: Any, broken: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    X = random_tensor((40, 4, 5))
    expected = tucker(X, (3, 2, 2))
    for name in broken:
        monkeypatch.setattr(name, failure)
    found = tucker(X, (3, 2, 2))
    np.testing.assert_allclose(found.core, expected.core, atol=1e-10)
    for factor, other in zip(found.factors, expected.factors, strict=True):
        np.testing.assert_allclose(factor, other, atol=1e-10)


def test_weak_directions_are_found_where_the_usual_svd_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    X = np.einsum("ia,ja,ka,a->ijk", *(random_tensor((n, 2), seed=n) for n in (30, 4, 5)), [1.0, 1e-8])
    expected = tucker(X, (2, 2, 2))
    usual = np.linalg.svd
    monkeypatch.setattr("numpy.linalg.svd", give_up)
    found = tucker(X, (2, 2, 2))
    monkeypatch.setattr("numpy.linalg.svd", usual)
    np.testing.assert_allclose(found.to_tensor(), expected.to_tensor(), atol=1e-12)
    assert found.fit == pytest.approx(1.0)


def test_where_no_way_leads_anywhere_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*USUAL, "scipy.linalg.eigh", "numpy.linalg.svd"):
        monkeypatch.setattr(name, give_up)
    with pytest.raises(DecompositionError, match=r"gave no factors of a finite \d+ x \d+ matrix in 3 ways: decompose"):
        tucker(random_tensor((40, 4, 5)), (3, 2, 2))


def test_orthonormal_goes_on_where_cholesky_gives_up() -> None:
    # Twelve columns whose products are all 0.0999: each is a small error, but together the matrix is indefinite.
    gram = np.full((12, 12), -0.0999)
    np.fill_diagonal(gram, 1.0)
    values, vectors = np.linalg.eigh(gram)
    A = np.zeros((20, 12))
    A[:12] = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    assert np.abs(A.T @ A - np.eye(12)).max() < 0.1 + 1e-2
    mended = orthonormal(A)
    np.testing.assert_allclose(mended.T @ mended, np.eye(12), atol=1e-12)


@pytest.mark.parametrize("size", [1.7e308, 1e300, 1e-300, 3e-310, 5e-324])
def test_numbers_at_the_edges_of_float_have_the_factors_of_others(size: float) -> None:
    X = np.sign(random_tensor((9, 3, 4)))
    expected = tucker(X, (2, 2, 2))
    with np.errstate(over="ignore"):  # the norm of the largest lies beyond the floats, and so does the core
        found = tucker(X * size, (2, 2, 2))
    for factor, other in zip(found.factors, expected.factors, strict=True):
        np.testing.assert_allclose(factor, other, atol=1e-12)
    assert found.fit == pytest.approx(expected.fit)


def graded(n: int, ratio: float) -> Floats:
    """Return a symmetric matrix with eigenvalues that fall by `ratio` each."""
    Q = np.linalg.qr(np.random.default_rng(n).normal(size=(n, n)))[0]
    A: Floats = (Q * ratio ** np.arange(n)) @ Q.T
    return (A + A.T) / 2


@pytest.mark.parametrize(("n", "count"), [(200, 25), (400, 15), (600, 3)])
@pytest.mark.parametrize("ratio", [0.9, 0.99])
def test_few_eigenvectors_are_those_of_all(n: int, count: int, ratio: float) -> None:
    A = graded(n, ratio)
    found = few_eigen(A, count)
    assert found is not None
    values, vectors = np.linalg.eigh(A)
    np.testing.assert_allclose(found[0], values[-count:], rtol=1e-12)
    projected = found[1] @ found[1].T
    np.testing.assert_allclose(projected, vectors[:, -count:] @ vectors[:, -count:].T, atol=1e-11)


@pytest.mark.parametrize("A", [np.eye(300), np.kron(np.eye(100), np.ones((3, 3)))])
def test_few_eigenvectors_are_the_same_each_time(A: Floats) -> None:
    found = [few_eigen(A, 15) for _ in range(3)]
    assert found[0] is not None
    assert len({vectors.tobytes() for _, vectors in filter(None, found)}) == 1


def test_few_of_a_small_matrix_or_many_of_a_large_one_are_left_to_the_other_way() -> None:
    assert few_eigen(graded(199, 0.9), 2) is None
    assert few_eigen(graded(200, 0.9), 26) is None


def test_what_lanczos_does_not_find_in_time_is_left_to_the_other_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solvers, "_RESTARTS", 1)
    A = graded(300, 0.9999)
    assert few_eigen(A, 20) is None
    factor: Floats = np.linalg.cholesky(A).T.astype(np.float64)
    largest: Floats = np.linalg.eigvalsh(A)[-20:].astype(np.float64)
    np.testing.assert_allclose(leading(factor, 20).squares, largest, rtol=1e-9)
