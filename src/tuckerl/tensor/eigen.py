"""A symmetric matrix's leading eigenvectors, in half the time that LAPACK takes for all.

The matrix is made tridiagonal, the eigenvalues of that are found, and for those that are wanted inverse iteration [1]_
finds the vectors: two steps from a vector of ones, all vectors side by side, so that the processor takes several at
once. Vectors of eigenvalues that are close together come out less than orthogonal. They span what they should, as long
as they can be told apart, and are made orthonormal; where they cannot, another way has to be gone.

References
----------
.. [1] J. H. Wilkinson (1965). The algebraic eigenvalue problem, chapter 5. Oxford University Press.
"""

import math

from tuckerl._jit import routine
from tuckerl.tensor.lapack import (
    cholesky,
    divide_rows,
    gram,
    tridiagonal_eigenvalues,
    tridiagonalise,
    turn_back,
)
from tuckerl.types import FloatArray, IntArray

# How far from orthogonal vectors may be, so that they surely span what they should.
_APART = 0.1

# What stands for a pivot of zero, as a part of the matrix.
_TINY = 1e-16


@routine
def leading_eigenvectors(
    tools: IntArray, A: FloatArray, n: int, count: int, values: FloatArray, room: FloatArray
) -> bool:
    """Find all eigenvalues of a symmetric matrix, and the vectors of the largest; return whether they were found.

    Parameters
    ----------
    tools : (T,) int64
        As of `new_tools`.
    A : (N * N,) float64
        Its triangle on and above the diagonal is read; its last rows become the vectors, the weakest first.
    n, count : int
    values : (N,) float64
        Written: rising.
    room : (R,) float64
        At least 69 * n + 8 * count * n long.
    """
    T, room = room[: 3 * n], room[3 * n :]
    copied, room = room[: 2 * n], room[2 * n :]
    work, room = room[: 64 * n], room[64 * n :]
    tridiagonalise(tools, A, n, T, work)
    size = 0.0
    for place in range(2 * n - 1):
        copied[place] = T[place]
        size = max(size, abs(T[place]))
    if not (size > 0.0 and tridiagonal_eigenvalues(tools, copied, n)):
        return False
    total = 0.0
    for place in range(n):
        values[place] = copied[place]
        total += copied[place]
    if not abs(total) < math.inf:
        return False
    rows, parts = room[: count * n], room[count * n :]
    _iterate(T, values[n - count :], n, size, rows, parts)
    gram(tools, rows, True, count, n, parts)
    for i in range(count):
        for j in range(i, count):
            if not abs(parts[i * count + j] - (1.0 if i == j else 0.0)) < _APART:
                return False
    if not cholesky(tools, parts, count):
        return False
    divide_rows(tools, parts, rows, count, n)
    turn_back(tools, A, T, n, rows, count, work)
    for place in range(count * n):
        A[(n - count) * n + place] = rows[place]
    return True


@routine
def _iterate(T: FloatArray, values: FloatArray, n: int, size: float, rows: FloatArray, parts: FloatArray) -> None:
    """Do two steps of inverse iteration for each eigenvalue: solve ``(T - value) x = b`` by elimination with pivots.

    Parameters
    ----------
    T : (3 * N,) float64
        The tridiagonal matrix: its diagonal, and what is beside it.
    values : (C,) float64
    n : int
    size : float
        The largest magnitude in it.
    rows : (C * N,) float64
        Written: the vectors of length 1, as rows.
    parts : (6 * C * N,) float64
        Room.
    """
    count = values.size
    x = parts[5 * count * n : 6 * count * n]
    _eliminate(T, values, n, size, parts)
    for place in range(count * n):
        x[place] = 1.0
    _substitute_back(parts, count, n, x)
    _scale(x, count, n, rows)
    _substitute_forward(parts, count, n, x)
    _substitute_back(parts, count, n, x)
    _scale(x, count, n, rows)
    for i in range(n):
        for j in range(count):
            rows[j * n + i] = x[i * count + j]


@routine
def _eliminate(T: FloatArray, values: FloatArray, n: int, size: float, parts: FloatArray) -> None:
    """Factorise ``T - value`` for all values side by side.

    Parameters
    ----------
    T : (3 * N,) float64
        The tridiagonal matrix.
    values : (C,) float64
    n : int
    size : float
    parts : (6 * C * N,) float64
        Written: for each row of T, and in it for each value, one over the pivot, the two numbers on its right, the
        factor, and 1 where rows were exchanged. Then the matrices' last rows.
    """
    count, unit = values.size, 1.0 / size
    width = count * n
    here, right = parts[5 * width : 5 * width + count], parts[5 * width + count : 5 * width + 2 * count]
    for j in range(count):
        here[j] = (T[0] - values[j]) * unit
        right[j] = T[n] * unit if n > 1 else 0.0
    for i in range(n):
        below = T[n + i] * unit if i + 1 < n else 0.0
        diagonal = T[i + 1] if i + 1 < n else 0.0
        beside = T[n + i + 1] * unit if i + 2 < n else 0.0
        at = i * count
        inverse = parts[at:]
        first = parts[width + at :]
        second = parts[2 * width + at :]
        factor = parts[3 * width + at :]
        exchanged = parts[4 * width + at :]
        for j in range(count):
            a = here[j]
            b = right[j]
            c = (diagonal - values[j]) * unit
            swaps = abs(a) < abs(below)
            pivot = below if swaps else a
            pivot = _TINY if abs(pivot) < _TINY else pivot
            one = 1.0 / pivot
            f = (a if swaps else below) * one
            inverse[j] = one
            factor[j] = f
            first[j] = c if swaps else b
            second[j] = beside if swaps else 0.0
            exchanged[j] = 1.0 if swaps else 0.0
            here[j] = (b - f * c) if swaps else (c - f * b)
            right[j] = (-f * beside) if swaps else beside


@routine
def _substitute_back(parts: FloatArray, count: int, n: int, x: FloatArray) -> None:
    """Solve the upper triangular systems.

    Parameters
    ----------
    parts : (6 * C * N,) float64
        As `_eliminate` wrote them.
    count, n : int
    x : (N * C,) float64
        The right-hand sides, one in each column, which become the solutions.
    """
    width = count * n
    for i in range(n - 1, -1, -1):
        at = i * count
        inverse = parts[at:]
        first = parts[width + at :]
        second = parts[2 * width + at :]
        here = x[at:]
        next_one = x[at + count * min(1, n - 1 - i) :]
        after = x[at + count * min(2, n - 1 - i) :]
        of_next = 1.0 if i + 1 < n else 0.0
        of_after = 1.0 if i + 2 < n else 0.0
        for j in range(count):
            known = of_next * first[j] * next_one[j] + of_after * second[j] * after[j]
            here[j] = (here[j] - known) * inverse[j]


@routine
def _substitute_forward(parts: FloatArray, count: int, n: int, x: FloatArray) -> None:
    """Do to the right-hand sides what elimination did to the matrices.

    Parameters
    ----------
    parts : (6 * C * N,) float64
        As `_eliminate` wrote them.
    count, n : int
    x : (N * C,) float64
    """
    width = count * n
    for i in range(n - 1):
        at = i * count
        factor = parts[3 * width + at :]
        exchanged = parts[4 * width + at :]
        here = x[at:]
        below = x[at + count :]
        for j in range(count):
            a = here[j]
            b = below[j]
            swaps = exchanged[j] > 0.5
            here[j] = b if swaps else a
            below[j] = (a - factor[j] * b) if swaps else (b - factor[j] * a)


@routine
def _scale(x: FloatArray, count: int, n: int, norms: FloatArray) -> None:
    """Scale columns to length 1.

    Parameters
    ----------
    x : (N * C,) float64
    count, n : int
    norms : (M,) float64
        Room for `count` numbers.
    """
    for j in range(count):
        norms[j] = 0.0
    for i in range(n):
        for j in range(count):
            norms[j] += x[i * count + j] * x[i * count + j]
    for j in range(count):
        norms[j] = 1.0 / math.sqrt(norms[j])
    for i in range(n):
        for j in range(count):
            x[i * count + j] *= norms[j]
