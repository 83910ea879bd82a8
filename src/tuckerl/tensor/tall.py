"""Matrices of many more rows than columns: the triangle that stands for them, and orthonormal columns."""

import numpy as np

from tuckerl._jit import routine
from tuckerl.tensor.lapack import cholesky, gram, new_tools
from tuckerl.tensor.modes import Floats
from tuckerl.tensor.singular import orthonormalise
from tuckerl.types import FloatArray, IntArray


def triangle(A: Floats) -> Floats | None:
    """Return the upper triangular R of a tall A = QR by Cholesky, R'R = A'A, as far as squares resolve it.

    Parameters
    ----------
    A : (m, n) float64, m >= n

    Returns
    -------
    (n, n) float64, or None
        None if A'A is not positive definite in floats.
    """
    n, flat = A.shape[1], A.reshape(-1)
    R = np.empty(n * n)
    found = _write_triangle(new_tools(0), flat if flat.flags.writeable else flat.copy(), n, R)
    return R.reshape(n, n) if found else None


@routine
def _write_triangle(tools: IntArray, A: FloatArray, n: int, R: FloatArray) -> bool:
    """Do what `triangle` does; return whether A'A is positive definite.

    Parameters
    ----------
    tools : (T,) int64
        As of `new_tools`.
    A : (M * N,) float64
    n : int
    R : (N * N,) float64
        Written.
    """
    gram(tools, A, False, n, A.size // n, R)
    for row in range(1, n):
        for place in range(row):
            R[row * n + place] = 0.0
    return cholesky(tools, R, n)


def orthonormal(A: Floats) -> Floats:
    """Make nearly orthonormal columns orthonormal to rounding, by Cholesky QR, keeping what they span.

    Parameters
    ----------
    A : (m, r) float64
        ``A'A`` is the identity but for small errors, as when singular vectors came from a Gram matrix. Columns
        that have nothing of their own, for want of rank, are replaced by some that are orthonormal to the rest.

    Returns
    -------
    (m, r) float64
    """
    length, n = A.shape
    rows = A.T.flatten()
    orthonormalise(new_tools(0), rows, n, length, np.empty(n * n))
    return rows.reshape(n, length).T
