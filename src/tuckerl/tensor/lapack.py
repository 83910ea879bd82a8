"""BLAS and LAPACK for kernels: SciPy's own, called by their addresses.

A kernel gets the addresses in an argument, the array `tools`, so that none is ever part of code that is kept on disk.
Fortran's routines take each argument by its address, letters and numbers, too: these stand in `tools`, whose bytes
begin with the least as on every machine that Numba knows, so that a letter or a number of 32 bits is found where one of
64 begins. Matrices are flat arrays, row after row; to Fortran each is its own transpose.
"""

import ctypes

import numpy as np
from scipy.linalg import cython_blas, cython_lapack

from tuckerl._jit import call_routine, routine
from tuckerl.types import FloatArray, IntArray

_ROUTINES = ("dgemm", "dsyrk", "dtrsm", "dpotrf", "dsyevd", "dsyev", "dsytrd", "dsterf", "dormtr")
DGEMM, DSYRK, DTRSM, DPOTRF, DSYEVD, DSYEV, DSYTRD, DSTERF, DORMTR = range(len(_ROUTINES))
_LETTERS = "NTLURV"
_N, _T, _L, _U, _R, _V = (8 * (len(_ROUTINES) + place) for place in range(len(_LETTERS)))  # in bytes from the begin
_CELLS = len(_ROUTINES) + len(_LETTERS)
_ONE, _ZERO = 8 * _CELLS, 8 * (_CELLS + 1)
NUMBERS = _CELLS + 2
"""From here on `tools` has room for numbers: eight, and then what the eigenproblems need."""
_A, _B, _C, _D, _E, _INFO, _IWORK = (8 * (NUMBERS + place) for place in range(7))


_name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", ctypes.pythonapi))
_pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
    ("PyCapsule_GetPointer", ctypes.pythonapi)
)


def _address(name: str) -> int:
    capsule = {**cython_lapack.__pyx_capi__, **cython_blas.__pyx_capi__}[name]
    address: int = _pointer_of(capsule, _name_of(capsule))
    return address


_HEAD = np.array(
    [*map(_address, _ROUTINES), *map(ord, _LETTERS), np.float64(1.0).view(np.int64), 0, *[0] * 6], dtype=np.int64
)


def new_tools(size: int) -> IntArray:
    """Return the tools for eigenproblems of up to `size` rows; each thread needs its own."""
    tools = np.empty(len(_HEAD) + 3 + 5 * size, dtype=np.int64)
    tools[: len(_HEAD)] = _HEAD
    return tools


@routine
def multiply(
    tools: IntArray,
    A: FloatArray,
    is_A_turned: bool,
    B: FloatArray,
    is_B_turned: bool,
    C: FloatArray,
    m: int,
    n: int,
    k: int,
) -> None:
    """Multiply two matrices: C = A B.

    Parameters
    ----------
    tools : (N,) int64
    A : (M * K,) float64
        The (m, k) matrix, or its transpose if it is turned.
    is_A_turned : bool
    B : (K * N,) float64
        The (k, n) matrix, or its transpose if it is turned.
    is_B_turned : bool
    C : (M * N,) float64
        Written.
    m, n, k : int
    """
    tools[NUMBERS] = m
    tools[NUMBERS + 1] = n
    tools[NUMBERS + 2] = k
    at, a, b, c = tools.ctypes.data, A.ctypes.data, B.ctypes.data, C.ctypes.data
    turned_a = at + (_T if is_A_turned else _N)
    turned_b = at + (_T if is_B_turned else _N)
    width_a = at + (_A if is_A_turned else _C)
    width_b = at + (_C if is_B_turned else _B)
    call_routine(
        tools[DGEMM],
        (turned_b, turned_a, at + _B, at + _A, at + _C, at + _ONE, b, width_b, a, width_a, at + _ZERO, c, at + _B),
    )


@routine
def gram(tools: IntArray, A: FloatArray, is_turned: bool, n: int, k: int, G: FloatArray) -> None:
    """Write one triangle of the Gram matrix A'A, (n, n), the one on and above the diagonal.

    Parameters
    ----------
    tools : (N,) int64
    A : (K * N,) float64
        The (k, n) matrix, or its transpose if it is turned.
    is_turned : bool
    n, k : int
    G : (N * N,) float64
        Written.
    """
    tools[NUMBERS] = n
    tools[NUMBERS + 1] = k
    at, a, g = tools.ctypes.data, A.ctypes.data, G.ctypes.data
    turned = at + (_T if is_turned else _N)
    width = at + (_B if is_turned else _A)
    call_routine(tools[DSYRK], (at + _L, turned, at + _A, at + _B, at + _ONE, a, width, at + _ZERO, g, at + _A))


@routine
def cholesky(tools: IntArray, G: FloatArray, n: int) -> bool:
    """Factorise a positive definite matrix, of which `gram` wrote a triangle, as R'R; return whether it is one.

    Parameters
    ----------
    tools : (N,) int64
    G : (N * N,) float64
        Its triangle on and above the diagonal becomes R.
    n : int
    """
    tools[NUMBERS] = n
    at = tools.ctypes.data
    call_routine(tools[DPOTRF], (at + _L, at + _A, G.ctypes.data, at + _A, at + _INFO))
    return bool(tools[_INFO // 8] == 0)


@routine
def divide_rows(tools: IntArray, R: FloatArray, rows: FloatArray, n: int, length: int) -> None:
    """Multiply a matrix from the left by the inverse of R'.

    Parameters
    ----------
    tools : (N,) int64
    R : (N * N,) float64
        Of `cholesky`.
    rows : (N * L,) float64
        The (n, length) matrix, which is changed.
    n, length : int
    """
    tools[NUMBERS] = length
    tools[NUMBERS + 1] = n
    at, r, b = tools.ctypes.data, R.ctypes.data, rows.ctypes.data
    call_routine(
        tools[DTRSM], (at + _R, at + _L, at + _T, at + _N, at + _A, at + _B, at + _ONE, r, at + _B, b, at + _A)
    )


@routine
def eigenvectors(tools: IntArray, way: int, A: FloatArray, n: int, values: FloatArray, work: FloatArray) -> bool:
    """Find all eigenvalues and eigenvectors of a symmetric matrix; return whether there was an answer.

    Parameters
    ----------
    tools : (N,) int64
    way : int
        `DSYEVD` or `DSYEV`.
    A : (N * N,) float64
        Its triangle on and above the diagonal is read; the eigenvectors, as rows, are written.
    n : int
    values : (N,) float64
        Written: rising.
    work : (2 * N * N + 6 * N + 1,) float64
        Room.
    """
    tools[NUMBERS] = n
    tools[NUMBERS + 1] = 1 + 6 * n + 2 * n * n
    tools[NUMBERS + 2] = 3 + 5 * n
    at, a, v, w = tools.ctypes.data, A.ctypes.data, values.ctypes.data, work.ctypes.data
    if way == DSYEVD:
        call_routine(
            tools[DSYEVD], (at + _V, at + _L, at + _A, a, at + _A, v, w, at + _B, at + _IWORK, at + _C, at + _INFO)
        )
    else:
        call_routine(tools[DSYEV], (at + _V, at + _L, at + _A, a, at + _A, v, w, at + _B, at + _INFO))
    if tools[_INFO // 8] != 0:
        return False
    squares = 0.0
    for place in range(n * n):
        squares += A[place] * A[place]
    total = 0.0
    for place in range(n):
        total += values[place]
    return abs(squares - n) < 1e-6 and abs(total) < np.inf


@routine
def tridiagonalise(tools: IntArray, A: FloatArray, n: int, T: FloatArray, work: FloatArray) -> None:
    """Turn a symmetric matrix into a tridiagonal one, Q'AQ.

    Parameters
    ----------
    tools : (N,) int64
    A : (N * N,) float64
        Its triangle on and above the diagonal is read; what Q is made of is written.
    n : int
    T : (3 * N,) float64
        Written: the diagonal; what is beside it; numbers that `turn_back` needs.
    work : (64 * N,) float64
        Room.
    """
    tools[NUMBERS] = n
    tools[NUMBERS + 1] = 64 * n
    at, a, t, w = tools.ctypes.data, A.ctypes.data, T.ctypes.data, work.ctypes.data
    call_routine(tools[DSYTRD], (at + _L, at + _A, a, at + _A, t, t + 8 * n, t + 16 * n, w, at + _B, at + _INFO))


@routine
def tridiagonal_eigenvalues(tools: IntArray, T: FloatArray, n: int) -> bool:
    """Replace a tridiagonal matrix's diagonal by its eigenvalues, rising; return whether they were found.

    Parameters
    ----------
    tools : (N,) int64
    T : (2 * N,) float64
        The diagonal, and what is beside it, which is lost.
    n : int
    """
    tools[NUMBERS] = n
    at, t = tools.ctypes.data, T.ctypes.data
    call_routine(tools[DSTERF], (at + _A, t, t + 8 * n, at + _INFO))
    return bool(tools[_INFO // 8] == 0)


@routine
def turn_back(
    tools: IntArray, A: FloatArray, T: FloatArray, n: int, rows: FloatArray, count: int, work: FloatArray
) -> None:
    """Turn vectors of the tridiagonal matrix to those of the matrix that it was made of: each becomes its Q multiple.

    Parameters
    ----------
    tools : (N,) int64
    A, T : (N * N,) float64, (3 * N,) float64
        As `tridiagonalise` left them.
    n : int
    rows : (C * N,) float64
        The vectors as rows, which are changed.
    count : int
    work : (64 * N,) float64
        Room.
    """
    tools[NUMBERS] = n
    tools[NUMBERS + 1] = count
    tools[NUMBERS + 2] = 64 * n
    at, a, t, z, w = tools.ctypes.data, A.ctypes.data, T.ctypes.data + 16 * n, rows.ctypes.data, work.ctypes.data
    call_routine(
        tools[DORMTR],
        (at + _L, at + _L, at + _N, at + _A, at + _B, a, at + _A, t, z, at + _A, w, at + _C, at + _INFO),
    )
