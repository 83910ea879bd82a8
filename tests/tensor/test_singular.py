"""Singular vectors by Gram matrices against LAPACK's SVD, in one pass and in two."""

import numpy as np
import pytest

from tests.tensor.examples import Floats, random_tensor
from tuckerl.tensor import singular
from tuckerl.tensor.lapack import new_tools
from tuckerl.tensor.singular import FAILED, NUMERICAL_ZERO, room_for
from tuckerl.tensor.tall import orthonormal, triangle


def leading(A: Floats, count: int, *, has_rows: bool = True) -> tuple[Floats, Floats]:
    """Return the right singular vectors of A as columns and the squares of their values, the weakest first."""
    n_fibres, length = A.shape
    flat = (A if has_rows else A.T).flatten()
    vectors, squares, spare = np.empty(count * length), np.empty(count), np.empty(A.size)
    sizes = (has_rows, length, n_fibres, count)
    room = np.empty(room_for(max(A.shape)))
    status = singular.leading(new_tools(max(A.shape)), flat, *sizes, vectors, squares, room, spare)
    assert status != FAILED
    return vectors.reshape(count, length).T, squares


def with_values(values: Floats, rows: int) -> Floats:
    n = values.size
    left = np.linalg.qr(random_tensor((rows, n)))[0]
    right = np.linalg.qr(random_tensor((n, n), seed=1))[0]
    return np.asarray((left * values) @ right.T)


SPECTRA = {
    "one pass": np.geomspace(1.0, 1e-3, 8),
    "two passes, though not by far": np.geomspace(1.0, 1e-7, 8),
    "two passes": np.geomspace(1.0, 1e-10, 8),
    "rank deficient": np.array([1.0, 0.3, 0.1, 1e-9, 0.0, 0.0]),
}


@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize("is_wide", [False, True])
@pytest.mark.parametrize("has_rows", [False, True])
def test_values_have_the_accuracy_that_is_promised(spectrum: str, is_wide: bool, has_rows: bool) -> None:
    A = with_values(SPECTRA[spectrum], rows=200)
    n = A.shape[1]
    vectors, squares = leading(A.T if is_wide else A, n, has_rows=has_rows)
    expected = SPECTRA[spectrum][::-1]
    np.testing.assert_allclose(np.sqrt(np.maximum(squares, 0.0)), expected, atol=1e-11)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(n), atol=1e-13)
    # A singular vector is stretched by its value, also far below the square root of the rounding.
    stretched = np.linalg.norm(vectors.T @ A if is_wide else A @ vectors, axis=1 if is_wide else 0)
    np.testing.assert_allclose(stretched, expected, atol=1e-11)


@pytest.mark.parametrize("shape", [(30, 6), (6, 30), (6, 6)])
@pytest.mark.parametrize("rank", [6, 2])
def test_leading_vectors_span_what_the_svd_says_and_are_orthonormal(shape: tuple[int, int], rank: int) -> None:
    A = random_tensor((shape[0], rank)) @ random_tensor((rank, shape[1]), seed=1)
    vectors, squares = leading(A, 4)
    _, s, transposed = np.linalg.svd(A)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(4), atol=1e-13)
    np.testing.assert_allclose(np.sqrt(np.maximum(squares, 0.0)), s[:4][::-1], atol=1e-10 * s[0])
    sure = min(4, rank)  # beyond the rank, the vectors are arbitrary
    assert np.count_nonzero(squares > NUMERICAL_ZERO**2 * squares[-1]) == sure
    strongest = vectors[:, -sure:]
    np.testing.assert_allclose(strongest @ strongest.T, transposed[:sure].T @ transposed[:sure], atol=1e-10)


@pytest.mark.parametrize("shape", [(5, 3), (3, 5)])
def test_leading_vectors_of_zeros_are_orthonormal(shape: tuple[int, int]) -> None:
    vectors, squares = leading(np.zeros(shape), 3)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(3), atol=1e-15)
    np.testing.assert_array_equal(squares, np.zeros(3))


def test_the_triangle_has_the_same_gram_matrix() -> None:
    A = random_tensor((50, 6))
    R = triangle(A)
    assert R is not None
    np.testing.assert_array_equal(R, np.triu(R))
    np.testing.assert_allclose(R.T @ R, A.T @ A, rtol=1e-12)
    assert triangle(np.zeros((5, 2))) is None


def test_vectors_are_orthonormal_where_rounding_gives_no_further_direction() -> None:
    A = np.zeros((30, 6))
    A[[3, 17]] = random_tensor((2, 6))
    vectors, _ = leading(A.T, 4)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(4), atol=1e-13)


def test_orthonormal_mends_small_errors_and_keeps_the_span() -> None:
    exact = np.linalg.qr(random_tensor((50, 4)))[0]
    mended = orthonormal(exact @ (np.eye(4) + 1e-6 * random_tensor((4, 4), seed=1)))
    np.testing.assert_allclose(mended.T @ mended, np.eye(4), atol=1e-14)
    np.testing.assert_allclose(mended @ mended.T, exact @ exact.T, atol=1e-14)


@pytest.mark.parametrize("least", [0.0, 1e-9])
def test_orthonormal_replaces_columns_that_have_nothing_of_their_own(least: float) -> None:
    exact = np.linalg.qr(random_tensor((50, 3)))[0]
    mended = orthonormal(exact * [1.0, -1.0, least])
    np.testing.assert_allclose(mended.T @ mended, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(mended[:, :2], exact[:, :2] * [1.0, -1.0], atol=1e-14)
