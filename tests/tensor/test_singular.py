"""Singular vectors by Gram matrices against LAPACK's SVD, in one pass and in two."""

import numpy as np
import pytest

from tests.tensor.examples import Floats, random_tensor
from tuckerl.tensor.singular import left_vectors, orthonormal, right_vectors


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
def test_right_vectors_have_the_accuracy_that_is_promised(spectrum: str) -> None:
    A = with_values(SPECTRA[spectrum], rows=200)
    values, vectors = right_vectors(A, A.shape[1])
    np.testing.assert_allclose(values, SPECTRA[spectrum], atol=1e-11)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(values.size), atol=1e-13)
    # A right singular vector is stretched by its value, also far below the square root of the rounding.
    np.testing.assert_allclose(np.linalg.norm(A @ vectors, axis=0), SPECTRA[spectrum], atol=1e-11)


@pytest.mark.parametrize("shape", [(30, 6), (6, 30), (6, 6)])
@pytest.mark.parametrize("rank", [6, 2])
def test_left_vectors_span_what_the_svd_says_and_are_orthonormal(shape: tuple[int, int], rank: int) -> None:
    A = random_tensor((shape[0], rank)) @ random_tensor((rank, shape[1]), seed=1)
    vectors, values = left_vectors(A, 4)
    U, s, _ = np.linalg.svd(A)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(4), atol=1e-13)
    np.testing.assert_allclose(values, s[:4], atol=1e-10 * s[0])
    sure = min(4, rank)  # beyond the rank, the vectors are arbitrary
    expected = U[:, :sure] @ U[:, :sure].T
    np.testing.assert_allclose(vectors[:, :sure] @ vectors[:, :sure].T, expected, atol=1e-10)


@pytest.mark.parametrize("shape", [(5, 3), (3, 5)])
def test_left_vectors_of_zeros_are_orthonormal(shape: tuple[int, int]) -> None:
    vectors, values = left_vectors(np.zeros(shape), 3)
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(3), atol=1e-15)
    np.testing.assert_array_equal(values, np.zeros(3))


def test_left_vectors_are_orthonormal_where_rounding_gives_no_further_direction() -> None:
    A = np.zeros((30, 6))
    A[[3, 17]] = random_tensor((2, 6))
    vectors, _ = left_vectors(A, 4)
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
