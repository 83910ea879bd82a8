"""Leading singular vectors and values of the matrices that a Tucker decomposition meets.

The right singular vectors of A are the eigenvectors of its Gram matrix A'A, and its left ones those of AA': one matrix
product and an eigenproblem of the shorter side, many times faster than an SVD of A. The price is that squaring
halves the digits: singular values below 1e-8 of the largest are noise. So where a wanted one lies below 1e-5 of the
largest (there the error is still about 1e-11 of the largest), the matrix is projected on the directions in which it is
small, and the Gram matrix of that, which no large value drowns, resolves the rest. Fewer vectors than rows are made
orthonormal by Cholesky QR [1]_.

References
----------
.. [1] Y. Yamamoto, Y. Nakatsukasa, Y. Yanagisawa, T. Fukaya (2015). Roundoff error analysis of the CholeskyQR2
   algorithm. Electronic Transactions on Numerical Analysis 44, 306-326.
"""

import math

from tuckerl._jit import routine
from tuckerl.tensor.eigen import leading_eigenvectors
from tuckerl.tensor.lapack import DSYEV, DSYEVD, cholesky, divide_rows, eigenvectors, gram, multiply
from tuckerl.types import FloatArray, IntArray

#: Singular values above this part of the largest can be told from zero: the numerical rank counts them.
NUMERICAL_ZERO = 1e-10

#: Singular values above this part of the largest come out of one pass with an error of about 1e-11 of it.
WELL_ABOVE_ZERO = 1e-5

# Directions in which a matrix is smaller than this part of its largest value are looked at again in a second pass.
_SMALL = 1e-4

SURE, UNSURE, FAILED = range(3)
"""What `leading` returns: one pass has resolved all values, it has not, or nothing has found any vectors."""


def room_for(size: int) -> int:
    """Return how many numbers the eigenproblems of up to `size` rows take."""
    return 9 * size * size + 70 * size


@routine
def leading(
    tools: IntArray,
    A: FloatArray,
    has_rows: bool,
    length: int,
    n_fibres: int,
    count: int,
    vectors: FloatArray,
    squares: FloatArray,
    room: FloatArray,
    spare: FloatArray,
) -> int:
    """Find the leading left singular vectors of a matrix whose columns are fibres, for any rank.

    Parameters
    ----------
    tools : (N,) int64
        As of `new_tools`.
    A : (L * F,) float64
        The fibres: each a row, or, if it is not `has_rows`, each a column.
    has_rows : bool
    length, n_fibres : int
    count : int
        How many; 1 <= count <= min(length, n_fibres).
    vectors : (C * L,) float64
        Written: the vectors as rows, the weakest first, orthonormal; those that belong to values of zero are arbitrary.
    squares : (C,) float64
        Written: the squares of their singular values, rising. The values are accurate to about 1e-11 of the largest.
    room : (R,) float64
        As long as `room_for` tells.
    spare : (L * F,) float64
        Room, too.
    """
    n = min(length, n_fibres)
    is_turned = has_rows == (n < length)
    status = _eigen_of_gram(tools, A, is_turned, n, max(length, n_fibres), count, room, spare)
    if status == FAILED:
        return FAILED
    rows, values = room[(n - count) * n : n * n], room[n * n + n - count : n * n + n]
    copy(values, squares)
    if n == length:
        copy(rows, vectors)
        return status
    least = NUMERICAL_ZERO * NUMERICAL_ZERO * values[count - 1]  # directions below it come out short
    for place in range(count):
        one = rows[place * n : (place + 1) * n]
        scale = 1.0 / math.sqrt(max(values[place], least)) if least > 0.0 else 0.0
        for i in range(n):
            one[i] *= scale
    _reverse(rows, count, n)  # the strongest first: what rounding has put into the weaker ones is taken out of them
    multiply(tools, rows, False, A, not has_rows, vectors, count, length, n)
    orthonormalise(tools, vectors, count, length, room)
    _reverse(vectors, count, length)
    return status


@routine
def _reverse(rows: FloatArray, n: int, length: int) -> None:
    """Reverse the order of a matrix's rows.

    Parameters
    ----------
    rows : (N * L,) float64
        The (n, length) matrix, which is changed.
    n, length : int
    """
    for row in range(n // 2):
        for place in range(length):
            one = row * length + place
            other = (n - 1 - row) * length + place
            kept = rows[one]
            rows[one] = rows[other]
            rows[other] = kept


@routine
def _eigen_of_gram(
    tools: IntArray,
    A: FloatArray,
    is_turned: bool,
    n: int,
    n_rows: int,
    count: int,
    room: FloatArray,
    spare: FloatArray,
) -> int:
    """Write the eigenvectors of A'A as rows to the begin of `room`, and then its eigenvalues, rising.

    Parameters
    ----------
    tools : (N,) int64
    A : (R * N,) float64
        The (n_rows, n) matrix, or its transpose if it is turned.
    is_turned : bool
    n, n_rows : int
    count : int
        How many of the values are to be resolved.
    room : (M,) float64
    spare : (R * N,) float64
    """
    values, beyond = room[n * n : n * n + n], room[n * n + n :]
    gram(tools, A, is_turned, n, n_rows, room)
    if leading_eigenvectors(tools, room, n, count, values, beyond) and _are_well_above_zero(values, count):
        return SURE
    if not _find_all(tools, A, is_turned, n, n_rows, room, values, beyond):
        return FAILED
    if _are_well_above_zero(values, count) or values[n - 1] <= 0.0:
        return SURE
    largest = values[n - 1]
    n_weak = 0
    while values[n_weak] <= _SMALL * _SMALL * largest:
        n_weak += 1
    weak, again = room[: n_weak * n], room[n * n + n :]
    multiply(tools, A, is_turned, weak, True, spare, n_rows, n_weak, n)
    size = n_weak * n_weak
    if not _find_all(tools, spare, False, n_weak, n_rows, again, again[size:], again[size + n_weak :]):
        return FAILED
    multiply(tools, again, False, weak, False, spare, n_weak, n, n_weak)
    copy(spare[: n_weak * n], weak)
    copy(again[size : size + n_weak], values)
    return UNSURE


@routine
def _are_well_above_zero(values: FloatArray, count: int) -> bool:
    """Return whether one pass has resolved the largest values.

    Parameters
    ----------
    values : (N,) float64
        Rising.
    count : int
    """
    least = WELL_ABOVE_ZERO * WELL_ABOVE_ZERO * values[values.size - 1]
    return bool(values[values.size - count] > max(least, 0.0))


@routine
def _find_all(
    tools: IntArray,
    A: FloatArray,
    is_turned: bool,
    n: int,
    n_rows: int,
    vectors: FloatArray,
    values: FloatArray,
    work: FloatArray,
) -> bool:
    """Find all eigenvectors of A'A, as rows, and its eigenvalues; return whether there was an answer.

    LAPACK's fastest routine, divide and conquer, has failed on the Gram matrix of a real window, whose eigenvalues
    stood in two tight clusters. Where it does, QR steps follow, which had no trouble.

    Parameters
    ----------
    tools : (N,) int64
    A : (R * N,) float64
        As for `_eigen_of_gram`, and so are the next ones.
    is_turned : bool
    n, n_rows : int
    vectors, values, work : (N * N,) float64, (N,) float64, (W,) float64
    """
    for way in (DSYEVD, DSYEV):
        gram(tools, A, is_turned, n, n_rows, vectors)
        if eigenvectors(tools, way, vectors, n, values, work):
            return True
    return False


@routine
def orthonormalise(tools: IntArray, rows: FloatArray, n: int, length: int, room: FloatArray) -> None:
    """Make nearly orthonormal rows orthonormal to rounding, by Cholesky QR, keeping what they span.

    Parameters
    ----------
    tools : (N,) int64
    rows : (R * L,) float64
        The (n, length) matrix, which is changed, n <= length. Rows that have nothing of their own, for want of rank,
        are replaced by some that are orthonormal to those before them.
    n, length : int
    room : (M,) float64
        At least n * n long.
    """
    gram(tools, rows, True, n, length, room)
    error = 0.0
    for i in range(n):
        for j in range(i, n):
            error = max(error, abs(room[i * n + j] - (1.0 if i == j else 0.0)))
    if error < 0.1 and cholesky(tools, room, n):
        divide_rows(tools, room, rows, n, length)
    else:
        _orthonormalise_one_by_one(rows, n, length)


@routine
def _orthonormalise_one_by_one(rows: FloatArray, n: int, length: int) -> None:
    """Do what `orthonormalise` does, by Gram and Schmidt's way, for rows of any kind.

    Parameters
    ----------
    rows : (R * L,) float64
    n, length : int
    """
    n_tried = 0
    for i in range(n):
        row = rows[i * length : (i + 1) * length]
        left = 0.0
        while left < 0.5:  # of a row of length 1, so that what is left is orthogonal to rounding
            norm = math.sqrt(_dot(row, row))
            if norm < NUMERICAL_ZERO:  # nothing but rounding
                for place in range(length):
                    row[place] = 0.0
                row[n_tried] = norm = 1.0
                n_tried += 1
            for place in range(length):
                row[place] /= norm
            for j in range(i):
                other = rows[j * length : (j + 1) * length]
                part = _dot(row, other)
                for place in range(length):
                    row[place] -= part * other[place]
            left = math.sqrt(_dot(row, row))
        for place in range(length):
            row[place] /= left


@routine
def copy(source: FloatArray, target: FloatArray) -> None:
    """Copy numbers to the begin of an array.

    Parameters
    ----------
    source, target : (L,) float64, (M,) float64
    """
    for place in range(source.size):
        target[place] = source[place]


@routine
def _dot(a: FloatArray, b: FloatArray) -> float:
    """Return an inner product.

    Parameters
    ----------
    a, b : (L,) float64, (L,) float64
    """
    total = 0.0
    for place in range(a.size):
        total += a[place] * b[place]
    return total
