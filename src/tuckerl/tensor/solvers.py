"""The factorisations of matrices that LAPACK does for us, each with a second way where the first one gives up.

LAPACK's fastest routines iterate, and on rare finite matrices some builds of it stop without an answer: `eigh` (divide
and conquer) has failed on the Gram matrix of a real window, whose eigenvalues stood in two tight clusters, where other
algorithms had no trouble. So each problem is tried in several ways, the usual one first: where it answers, the others
are never called, and its bits are what they always were. Over 5,002 clustered and graded Gram matrices, with two
kernels of OpenBLAS, the relatively robust representations (``evr``) and the SVD agreed with `eigh` to 1e-12 each time.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg

from tuckerl.errors import DecompositionError
from tuckerl.tensor.modes import Floats

_SMALL = 48  # rows up to which OpenBLAS has one thread for all of this
_LARGE, _FEW = 200, 8  # from so many rows on, and up to one of so many eigenvectors, a few are found sooner than all
_RESTARTS = 100  # where more are needed, all are found sooner


def symmetric_eigen(A: Floats) -> tuple[Floats, Floats]:
    """Return the eigenvalues of a symmetric positive semi-definite matrix, smallest first, and its eigenvectors.

    Parameters
    ----------
    A : (n, n) float64
        Finite.

    Returns
    -------
    values : (n,) float64
    vectors : (n, n) float64

    Raises
    ------
    DecompositionError
        If no way leads to them.
    """
    values, vectors = _first_that_answers((_eigh, _robust_eigh, _eigen_by_svd), A)
    return values, vectors


def few_eigen(A: Floats, count: int) -> tuple[Floats, Floats] | None:
    """Return the largest eigenvalues of a large symmetric matrix, smallest first, and their eigenvectors.

    By the implicitly restarted Lanczos method [1]_, to rounding: four times as fast as finding all where they are few.

    Parameters
    ----------
    A : (n, n) float64
        Finite.
    count : int

    Returns
    -------
    values : (count,) float64
    vectors : (n, count) float64
        None instead of both where `symmetric_eigen` finds all as soon, or these are not found in time.

    References
    ----------
    .. [1] R. B. Lehoucq, D. C. Sorensen, C. Yang (1998). ARPACK users' guide. SIAM.
    """
    if len(A) < _LARGE or _FEW * count > len(A):
        return None
    from scipy.sparse.linalg import ArpackError, eigsh  # most tensors need no such matrix

    begin = np.cos(np.arange(1.0, len(A) + 1.0))  # leans to all sides
    try:  # where there are few different eigenvalues, more vectors are drawn: always the same ones
        values, vectors = eigsh(A, k=count, which="LA", v0=begin, tol=0.0, maxiter=_RESTARTS, rng=0)
    except ArpackError:
        return None
    order = values.argsort()
    return values[order], vectors[:, order]


def singular_values(A: Floats) -> tuple[Floats, Floats]:
    """Return the singular values of a square matrix, largest first, and its right singular vectors.

    Parameters
    ----------
    A : (n, n) float64
        Finite.

    Returns
    -------
    values : (n,) float64
    vectors : (n, n) float64
        One in each column.

    Raises
    ------
    DecompositionError
        If no way leads to them.
    """
    values, transposed = _first_that_answers((_svd, _svd_by_qr_steps), A)
    return values, transposed.T


def _first_that_answers(ways: tuple[Callable[[Floats], Any], ...], A: Floats) -> Any:
    """Return the first answer that is finite: values and vectors of length 1, as many."""
    for way in ways:
        try:
            values, vectors = way(A)
        except np.linalg.LinAlgError:
            continue
        if abs(np.vdot(vectors, vectors) - values.size) < 1e-6 and math.isfinite(values.sum()):
            return values, vectors
    raise DecompositionError(
        f"LAPACK gave no factors of a finite {A.shape[0]} x {A.shape[1]} matrix in {len(ways)} ways: decompose another "
        "window, or use another build of NumPy"
    )


def _eigh(A: Floats) -> tuple[Floats, Floats]:
    # NumPy first: SciPy brings a BLAS of its own, and the two pools of threads would slow each other down (measured:
    # twice the time with two threads). Small matrices are one thread's, and there SciPy's shorter way to LAPACK counts.
    if len(A) > _SMALL:
        values, vectors = np.linalg.eigh(A)
    else:
        values, vectors, info = scipy.linalg.lapack.dsyevd(A.T, overwrite_a=0)
        if info:
            raise np.linalg.LinAlgError(f"dsyevd returned {info}")
    return values, vectors


def _robust_eigh(A: Floats) -> tuple[Floats, Floats]:
    values, vectors = scipy.linalg.eigh(A, driver="evr")
    return values, vectors


def _eigen_by_svd(A: Floats) -> tuple[Floats, Floats]:
    """Of a semi-definite matrix, the singular values and vectors are the eigenvalues and eigenvectors."""
    _, values, transposed = np.linalg.svd(A)
    return values[::-1], transposed[::-1].T


def _svd(A: Floats) -> tuple[Floats, Floats]:
    _, values, transposed = np.linalg.svd(A)
    return values, transposed


def _svd_by_qr_steps(A: Floats) -> tuple[Floats, Floats]:
    _, values, transposed = scipy.linalg.svd(A, lapack_driver="gesvd")
    return values, transposed
