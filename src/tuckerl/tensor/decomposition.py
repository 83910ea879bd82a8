"""The Tucker decomposition by higher-order orthogonal iteration (HOOI).

Among factors with orthonormal columns, the best rank-(r_0, ..., r_{N-1}) approximation of X maximises the norm of
the core ``G = X x_0 U_0' ... x_{N-1} U_{N-1}'``. Given all factors but the n-th, the best n-th one holds the r_n
leading left singular vectors of the unfolding of X projected on the others. HOOI goes through the modes in order,
again and again; it starts from the truncated higher-order SVD, whose squared error is at most the sum of the
squared singular values that were cut off [1]_ [2]_ (Tucker3 [3]_ by alternating least squares).

A *long* mode, longer than the product of all other sizes, is compressed first, exactly: with the thin SVD
``X_(n) = Q R``, ``R = diag(s) V'``, the small tensor folded from R has the same core, fit and other factors, and
the long factor is Q times the small one. In these coordinates its first HOSVD factor is the identity's first columns.

References
----------
.. [1] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). A multilinear singular value decomposition.
   SIAM J. Matrix Anal. Appl. 21(4), 1253-1278.
.. [2] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). On the best rank-1 and rank-(R1, R2, ..., RN)
   approximation of higher-order tensors. SIAM J. Matrix Anal. Appl. 21(4), 1324-1342.
.. [3] L. R. Tucker (1966). Some mathematical notes on three-mode factor analysis. Psychometrika 31, 279-311.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import NO_ARRAY, check_int, check_real, refuse_mask
from tuckerl.errors import ParameterTypeError, RankWarning, TensorError, warn
from tuckerl.interrupts import is_impatient
from tuckerl.tensor.modes import Floats, fold, multiply_mode, unfold
from tuckerl.tensor.ranks import Ranks, check_ranks, clip_ranks
from tuckerl.tensor.singular import (
    NUMERICAL_ZERO,
    WELL_ABOVE_ZERO,
    left_vectors,
    orthonormal,
    right_vectors,
)

# Singular values of a long mode are taken to be at least this part of the largest: below it all is rounding.
_NEGLIGIBLE = 1e-12

# Where the residual is a thousandth of the tensor, errors of 1e-8 in it change the fit by about 1e-13.
_SURE_FIT = 1.0 - 1e-3


@dataclass(frozen=True, eq=False)
class TuckerDecomposition:
    """A core and one factor a mode, ``X ~ core x_0 factors[0] x_1 factors[1] ...``.

    Attributes
    ----------
    core : (r_0, ..., r_{N-1}) float64
    factors : tuple of N arrays, (I_n, r_n) float64
        Orthonormal columns; the entry of largest magnitude of each (the first of equals) is positive.
    fit : float
        ``1 - norm(X - to_tensor()) / norm(X)``, 1 for a perfect one.
    iterations : int
        Sweeps over the modes that were done.

    Examples
    --------
    >>> import numpy as np
    >>> d = TuckerDecomposition(np.full((1, 1), 5.0), (np.array([[0.6], [0.8]]), np.array([[1.0]])), 1.0, 0)
    >>> d.ranks, d.to_tensor()
    ((1, 1), array([[3.],
           [4.]]))
    """

    core: Floats
    factors: tuple[Floats, ...]
    fit: float
    iterations: int

    @property
    def ranks(self) -> Ranks:
        """The shape of the core: the ranks that were used, at most those asked for."""
        return self.core.shape

    def to_tensor(self) -> Floats:
        """Multiply out the decomposition: the (I_0, ..., I_{N-1}) array that it stands for."""
        return _expand(self.core, self.factors)


def tucker(X: ArrayLike, ranks: Sequence[int], tol: float = 1e-4, max_iterations: int = 50) -> TuckerDecomposition:
    """Decompose a tensor by higher-order orthogonal iteration from the truncated higher-order SVD.

    Ranks above what is possible (see :mod:`tuckerl.tensor.ranks`) are lowered, and one warning says so. The result
    is a pure function of the arguments (and, to rounding, of the number of BLAS threads). A tensor of zeros has
    the first columns of the identity as factors, a core of zeros, fit 1 and no iterations.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) array_like, N >= 2
        Finite real numbers; not modified.
    ranks : sequence of N int
        Columns of each factor, at least 1.
    tol : float
        Stop after a sweep that changes the fit by less than this; 0 does all `max_iterations` sweeps.
    max_iterations : int
        The most sweeps to do; with 0 the result *is* the truncated higher-order SVD.

    Returns
    -------
    TuckerDecomposition

    Raises
    ------
    TensorError
        If `X` is not numeric and real, not finite, of order below 2, or has an empty axis.
    ParameterTypeError
        If `X` is no array at all, or a parameter is of the wrong type.
    ParameterError
        If `ranks` are not N positive numbers, or `tol` or `max_iterations` is negative.

    Warns
    -----
    RankWarning
        If ranks were lowered.

    References
    ----------
    De Lathauwer, De Moor, Vandewalle (2000), SIAM J. Matrix Anal. Appl. 21(4), 1324-1342; Kolda, Bader (2009),
    SIAM Review 51(3), figure 4.4.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.arange(24.0).reshape(2, 3, 4)
    >>> d = tucker(X, (1, 2, 2))
    >>> [factor.shape for factor in d.factors], round(d.fit, 3)
    ([(2, 1), (3, 2), (4, 2)], 0.884)
    """
    tensor = _check_tensor(X)
    asked = check_ranks(ranks, tensor.ndim)
    tol = check_real("tol", tol, low=0.0)
    max_iterations = check_int("max_iterations", max_iterations, low=0)
    result = decompose(tensor, asked, tol, max_iterations)
    if result.ranks != asked:
        warn(
            f"ranks {asked} were asked of a tensor of shape {tensor.shape} and {result.ranks} used: a rank is "
            "at most its mode's size, its mode's numerical rank and the product of the other ranks; ask for less",
            RankWarning,
        )
    return result


def decompose(X: Floats, ranks: Ranks, tol: float = 1e-4, max_iterations: int = 50) -> TuckerDecomposition:
    """Do what :func:`tucker` does, without checking its parameters and without a warning about ranks.

    For callers with thousands of tensors and one place to warn: `ranks` of the result tells which were used.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64, N >= 2, no axis empty
    ranks : tuple of N int, each at least 1
    tol, max_iterations : float, int
        As for :func:`tucker`.

    Returns
    -------
    TuckerDecomposition

    Raises
    ------
    TensorError
        If `X` is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> decompose(np.ones((3, 2, 2)), (3, 2, 2)).ranks
    (1, 1, 1)
    """
    largest = max(X.max(), -X.min())
    if not math.isfinite(largest):
        raise TensorError(
            "a tensor to decompose must be finite; got NaN or infinity in it: look for the run that "
            "diverged, or replace them, for example by numpy.nan_to_num"
        )
    if largest == 0.0:
        return _zero(X.shape, clip_ranks(ranks, X.shape))
    # Squares of numbers as large or small as these leave the range of floats; a power of two costs no digit.
    scale = 1.0 if 1e-100 < largest < 1e100 else math.ldexp(1.0, math.frexp(largest)[1] - 1)
    tensor = X if scale == 1.0 else X / scale
    long_mode = max(range(X.ndim), key=X.shape.__getitem__)
    if X.shape[long_mode] > X.size // X.shape[long_mode]:
        result = _decompose_long(tensor, long_mode, ranks, tol, max_iterations)
    else:
        result = _iterate(tensor, _truncated_svd(tensor, ranks).factors, tol, max_iterations)
    core, factors = _with_signs(result.core, result.factors)
    return TuckerDecomposition(core * scale, factors, result.fit, result.iterations)


class _Start(NamedTuple):
    """A truncated higher-order SVD, and whether each singular value that it keeps is well above zero."""

    factors: list[Floats]
    sure: bool


class _Result(NamedTuple):
    """What the sweeps return."""

    core: Floats
    factors: list[Floats]
    fit: float
    iterations: int


def _decompose_long(X: Floats, mode: int, ranks: Ranks, tol: float, max_iterations: int) -> _Result:
    """Compress the long mode, decompose the small tensor, and bring the long factor back."""
    tall = unfold(X, mode)
    # One pass leaves errors of 1e-8 in the weakest directions. They come in squared, so they show only where
    # a singular value that is kept, or the residual, is about as small; then the second pass is due.
    for count in (1, tall.shape[1]):
        values, vectors = right_vectors(tall, count)
        values = np.maximum(values, _NEGLIGIBLE * values[0])
        small = fold((vectors * values).T, mode, (*X.shape[:mode], values.size, *X.shape[mode + 1 :]))
        start = _truncated_svd(small, ranks, {mode: (np.eye(values.size), values)})
        result = _iterate(small, start.factors, tol, max_iterations)
        if start.sure and result.fit < _SURE_FIT:
            break
    result.factors[mode] = orthonormal(tall @ ((vectors / values) @ result.factors[mode]))
    return result


def _truncated_svd(X: Floats, ranks: Ranks, known: Mapping[int, tuple[Floats, Floats]] | None = None) -> _Start:
    """Return the truncated higher-order SVD, with as many columns as mean something.

    Of the modes in `known`, the left singular vectors and the singular values are given.
    """
    ranks = clip_ranks(ranks, X.shape)
    known = known or {}
    vectors, values = zip(
        *(known.get(mode) or left_vectors(unfold(X, mode), rank) for mode, rank in enumerate(ranks)),
        strict=True,
    )
    least = [s[:rank] / s[0] for s, rank in zip(values, ranks, strict=True)]
    ranks = clip_ranks(ranks, [int(np.count_nonzero(s > NUMERICAL_ZERO)) for s in least])
    factors = [U[:, :rank] for U, rank in zip(vectors, ranks, strict=True)]
    return _Start(factors, sure=all(s[-1] > WELL_ABOVE_ZERO for s in least))


def _iterate(X: Floats, factors: list[Floats], tol: float, max_iterations: int) -> _Result:
    """Sweep over the modes until the fit settles."""
    X = np.ascontiguousarray(X)
    core = X
    for mode, factor in enumerate(factors):
        core = multiply_mode(core, factor.T, mode)
    fit = _fit(X, core, factors)
    for iteration in range(1, max_iterations + 1):
        if is_impatient():  # Ctrl-C waits where a learner decomposes
            raise KeyboardInterrupt
        core, factors = _sweep(X, factors)
        before, fit = fit, _fit(X, core, factors)
        if abs(fit - before) < tol:
            return _Result(core, factors, fit, iteration)
    return _Result(core, factors, fit, max_iterations)


def _sweep(X: Floats, factors: Sequence[Floats]) -> tuple[Floats, list[Floats]]:
    """Improve each factor once, given the others, and return the core with them."""
    improved: list[Floats] = []
    core = X  # projected on the factors improved so far; after the last, this is the core
    for mode, factor in enumerate(factors):
        projected = core
        # Contracting the last axis and putting the result first makes each product one matrix product without
        # a transposed copy; in the end `mode` is the last axis, and the order of the others is immaterial.
        for later in range(len(factors) - 1, mode, -1):
            projected = factors[later].T @ projected.reshape(-1, factors[later].shape[0]).T
        unfolding = projected.reshape(-1, factor.shape[0]).T
        improved.append(left_vectors(unfolding, factor.shape[1])[0])
        core = multiply_mode(core, improved[mode].T, mode)
    return core, improved


def _fit(X: Floats, core: Floats, factors: Sequence[Floats]) -> float:
    """Return ``1 - norm(X - X_hat) / norm(X)`` for orthonormal factors and the core that goes with them."""
    whole = float(np.vdot(X, X))
    rest = 1.0 - float(np.vdot(core, core)) / whole
    if rest < 1e-6:  # too much of the difference is rounding
        residual = X - _expand(core, factors)
        rest = float(np.vdot(residual, residual)) / whole
    return 1.0 - math.sqrt(rest)


def _expand(core: Floats, factors: Sequence[Floats]) -> Floats:
    """Multiply the core by all factors, those of the shortest modes first to keep what lies between small."""
    tensor = core
    for mode in sorted(range(core.ndim), key=lambda n: factors[n].shape[0]):
        tensor = multiply_mode(tensor, factors[mode], mode)
    return tensor


def _with_signs(core: Floats, factors: Sequence[Floats]) -> tuple[Floats, tuple[Floats, ...]]:
    """Make each factor column's entry of largest magnitude positive, and the core agree."""
    signed = []
    for mode, factor in enumerate(factors):
        pivots = factor[np.abs(factor).argmax(axis=0), np.arange(factor.shape[1])]
        signs = np.where(pivots < 0.0, -1.0, 1.0)
        signed.append(factor * signs)
        core = core * signs.reshape(-1, *[1] * (core.ndim - mode - 1))
    return core, tuple(signed)


def _zero(shape: tuple[int, ...], ranks: Ranks) -> TuckerDecomposition:
    """Return the decomposition defined for a tensor of zeros."""
    factors = tuple(np.eye(size, rank) for size, rank in zip(shape, ranks, strict=True))
    return TuckerDecomposition(np.zeros(ranks), factors, fit=1.0, iterations=0)


def _check_tensor(X: ArrayLike) -> Floats:
    """Return `X` as a C-ordered float64 array, the same one if it is that already."""
    advice = "pass an array, or nested lists of equal length, of real numbers"
    refuse_mask("a tensor to decompose", X)
    try:
        array = np.asarray(X)
    except NO_ARRAY as error:
        raise ParameterTypeError(f"a tensor to decompose must be an array; got ragged lists: {advice}") from error
    if array.ndim == 0 or array.dtype.kind in "OSUMm":
        raise ParameterTypeError(
            f"a tensor to decompose must be an array of numbers; got {type(X).__name__}"
            f" of dtype {array.dtype}: {advice}"
        )
    if array.dtype.kind not in "iuf":
        raise TensorError(f"a tensor to decompose must hold real numbers; got dtype {array.dtype}: {advice}")
    if array.ndim < 2 or array.size == 0:
        raise TensorError(
            "a tensor to decompose must have at least two axes, none of them empty; "
            f"got shape {array.shape}: reshape it, or leave it out"
        )
    return np.ascontiguousarray(array, dtype=np.float64)
