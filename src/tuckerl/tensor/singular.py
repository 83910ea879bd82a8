"""Leading singular vectors and values of the matrices that a Tucker decomposition meets.

The right singular vectors of A are the eigenvectors of its Gram matrix A'A, and its left ones those of AA': one matrix
product and an eigenproblem of the shorter side, many times faster than an SVD of A. The price is that squaring
halves the digits: singular values below 1e-8 of the largest are noise. So where a wanted one lies below 1e-5 of the
largest (there the error is still about 1e-11 of the largest), the matrix is rescaled by what the first pass has found,
which leaves it well conditioned, and a second pass resolves the rest: the idea of Cholesky QR, done twice [1]_ [2]_.

References
----------
.. [1] Y. Yamamoto, Y. Nakatsukasa, Y. Yanagisawa, T. Fukaya (2015). Roundoff error analysis of the CholeskyQR2
   algorithm. Electronic Transactions on Numerical Analysis 44, 306-326.
.. [2] T. Fukaya, R. Kannan, Y. Nakatsukasa, Y. Yamamoto, Y. Yanagisawa (2020). Shifted Cholesky QR for computing
   the QR factorization of ill-conditioned matrices. SIAM J. Sci. Comput. 42(1), A477-A503.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg

from tuckerl.tensor.modes import Floats
from tuckerl.tensor.solvers import few_eigen, singular_values, symmetric_eigen

#: Singular values above this part of the largest can be told from zero: the numerical rank counts them.
NUMERICAL_ZERO = 1e-10

#: Singular values above this part of the largest come out of one pass with an error of about 1e-11 of it.
WELL_ABOVE_ZERO = 1e-5

# What the first pass finds below this part of the largest is noise, and is scaled as if it were this large.
_FLOOR = 1e-6


class Leading(NamedTuple):
    """The leading singular vectors of a matrix on one side, the weakest first, and the squares of their values."""

    vectors: Floats  # (n, count), orthonormal columns; those that belong to values of zero are arbitrary
    squares: Floats  # (count,), rising

    @property
    def is_well_above_zero(self) -> bool:
        """Whether one pass has resolved all the values."""
        return bool(self.squares[0] > WELL_ABOVE_ZERO**2 * self.squares[-1])

    @property
    def rank(self) -> int:
        """How many of the values can be told from zero."""
        return int(np.count_nonzero(self.squares > NUMERICAL_ZERO**2 * self.squares[-1]))


def leading(A: Floats, count: int) -> Leading:
    """Return the leading right singular vectors of a matrix of any rank.

    Parameters
    ----------
    A : (m, n) float64
    count : int
        How many; 1 <= count <= min(m, n).

    Returns
    -------
    Leading
        Its values are accurate to about 1e-11 of the largest.
    """
    if A.shape[0] >= A.shape[1]:
        return _of_tall(A, count)
    vectors, squares = _of_tall(A.T, count)
    least = NUMERICAL_ZERO**2 * squares[-1] or 1.0  # directions below it come out short, and are replaced
    short = A.T @ (vectors / np.sqrt(np.maximum(squares, least)))
    return Leading(orthonormal(short[:, ::-1])[:, ::-1], squares)  # the strongest first: what is replaced comes last


def _of_tall(A: Floats, count: int) -> Leading:
    """Do what `leading` does where there are no fewer rows than columns."""
    gram = A.T @ A
    few = few_eigen(gram, count)
    squares, vectors = few or symmetric_eigen(gram)
    found = Leading(vectors[:, -count:], squares[-count:])
    if found.is_well_above_zero or squares[-1] <= 0.0:
        return found
    if few is not None:
        squares, vectors = symmetric_eigen(gram)
    values = np.sqrt(np.maximum(squares, 0.0))
    scale = np.maximum(values, _FLOOR * values[-1])
    scaled = A @ (vectors / scale)
    again, rotation = symmetric_eigen(scaled.T @ scaled)
    # A'A = R'R with this small square R: undo the scaling of the first pass.
    R = (rotation * np.sqrt(np.maximum(again, 0.0))).T @ (vectors * scale).T
    values, vectors = singular_values(R)
    return Leading(vectors[:, :count][:, ::-1], np.square(values[:count])[::-1])


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
    R, info = scipy.linalg.lapack.dpotrf((A.T @ A).T, lower=0, overwrite_a=1)
    return R if info == 0 else None


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
    gram = A.T @ A
    if np.abs(gram - np.eye(gram.shape[0])).max() < 0.1:
        R, info = scipy.linalg.lapack.dpotrf(gram.T, lower=0, overwrite_a=1)
        if info == 0:  # else many small errors together; Householder's QR, which is slower, never fails
            inverse: Floats = scipy.linalg.lapack.dtrtri(R, overwrite_c=1)[0]
            return A @ inverse
    Q, R = np.linalg.qr(A)
    return Q * np.where(np.diag(R) < 0.0, -1.0, 1.0)
