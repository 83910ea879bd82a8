"""The Tucker decomposition, asked for and given: long modes, numbers of any size, factors that are made when read.

A *long* mode, longer than the product of all other sizes, is compressed first, exactly: with ``X_(n) = QR``, Q having
orthonormal columns, the small tensor folded from R has the same core, fit and other factors (:mod:`tuckerl.tensor.hooi`
finds them), and the long factor is Q times the small one. It is as large as all the rest, and often nobody reads it; so
it is multiplied out when somebody does.
"""

import math
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from tuckerl.checks import NO_ARRAY, check_int, check_real, refuse_mask
from tuckerl.errors import ParameterTypeError, RankWarning, TensorError, warn
from tuckerl.tensor.energy import ranks_by_energy
from tuckerl.tensor.hooi import Iterated, iterate
from tuckerl.tensor.modes import Floats, multiply_all
from tuckerl.tensor.one_thread import ONE_THREAD
from tuckerl.tensor.ranks import Ranks, check_ranks, clip_ranks
from tuckerl.tensor.tall import orthonormal, triangle
from tuckerl.types import AskedRanks

# Where less is left of the tensor, the errors of its squares would show in the fit.
_SURE_FIT = 1.0 - 1e-4

# Sums of squares in this range are neither huge nor made of numbers whose squares are lost.
_LEAST_ENERGY, _MOST_ENERGY = 1e-200, 1e200


class TuckerDecomposition:
    """A core and one factor a mode, ``X ~ core x_0 factors[0] x_1 factors[1] ...``.

    Parameters
    ----------
    core : (r_0, ..., r_{N-1}) float64
    factors : sequence of N arrays, (I_n, r_n) float64
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

    def __init__(self, core: Floats, factors: Sequence[Floats], fit: float, iterations: int) -> None:
        self._core, self._factors, self._fit, self._iterations = core, factors, fit, iterations

    @property
    def core(self) -> Floats:
        """The (r_0, ..., r_{N-1}) core."""
        return self._core

    @property
    def factors(self) -> Sequence[Floats]:
        """The N factors, (I_n, r_n) each."""
        return self._factors

    @property
    def fit(self) -> float:
        """``1 - norm(X - to_tensor()) / norm(X)``."""
        return self._fit

    @property
    def iterations(self) -> int:
        """Sweeps over the modes that were done."""
        return self._iterations

    @property
    def ranks(self) -> Ranks:
        """The shape of the core: the ranks that were used, at most those asked for."""
        return self._core.shape

    def __reduce__(self) -> tuple[Any, ...]:
        """Say what copies are made of: nothing that is still to be made."""
        return TuckerDecomposition, (self.core, tuple(self.factors), self.fit, self.iterations)

    def __repr__(self) -> str:
        """Return the ranks and the numbers."""
        return f"TuckerDecomposition(ranks={self.ranks}, fit={self.fit!r}, iterations={self.iterations})"

    def to_tensor(self) -> Floats:
        """Multiply out the decomposition: the (I_0, ..., I_{N-1}) array that it stands for."""
        return multiply_all(self.core, self.factors)


class _Factors(Sequence[Floats]):
    """Factors with their signs settled, each made when it is first read."""

    def __init__(self, makers: Sequence[Callable[[], Floats] | None]) -> None:
        self._makers = {mode: maker for mode, maker in enumerate(makers) if maker is not None}
        self._n = len(makers)
        alone = [mode for mode in range(self._n) if mode not in self._makers]  # of size 1: nothing to make
        self._made: dict[int, Floats] = {mode: np.ones((1, 1)) for mode in alone}
        self.signs: dict[int, Floats] = {mode: np.ones(1) for mode in alone}

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, mode: Any) -> Any:
        if isinstance(mode, slice):
            return tuple(self[place] for place in range(*mode.indices(len(self))))
        mode = range(len(self))[mode]
        if mode not in self._made:
            factor = self._makers[mode]()[:, ::-1]  # the strongest first
            pivots = factor[np.abs(factor).argmax(axis=0), np.arange(factor.shape[1])]
            self.signs[mode] = np.where(pivots < 0.0, -1.0, 1.0)
            self._made[mode] = factor * self.signs[mode]
            del self._makers[mode]  # what it was made of may be large
        return self._made[mode]


class _Found(TuckerDecomposition):
    """A decomposition whose factors, and the core that agrees with their signs, are made when they are read."""

    _factors: _Factors

    @property
    def core(self) -> Floats:
        """The (r_0, ..., r_{N-1}) core."""
        return self._signed_core

    @cached_property
    def _signed_core(self) -> Floats:
        core = np.flip(self._core)
        for mode, _ in enumerate(self._factors):  # which settles the signs
            core = core * self._factors.signs[mode].reshape(-1, *[1] * (core.ndim - mode - 1))
        return core


def tucker(X: ArrayLike, ranks: AskedRanks, tol: float = 1e-4, max_iterations: int = 50) -> TuckerDecomposition:
    """Decompose a tensor by higher-order orthogonal iteration from the truncated higher-order SVD.

    Ranks above what is possible (see :mod:`tuckerl.tensor.ranks`) are lowered, and one warning says so. The result
    is a pure function of the arguments. A tensor of zeros has the first columns of the identity as factors, a core of
    zeros, fit 1 and no iterations.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) array_like, N >= 2
        Finite real numbers; not modified.
    ranks : sequence of N int, float or "auto"
        Columns of each factor, at least 1; or the share of the energy, in (0, 1], that they are to explain, "auto" for
        0.95: in each mode the least rank whose singular values carry that share of ``norm(X)**2`` (see
        :mod:`tuckerl.tensor.energy`). So does scikit-learn read the ``n_components`` of its PCA; a float in TensorLy is
        something else, the share of the tensor's numbers that the result has.
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
        If `ranks` are not N positive numbers and no share in (0, 1], or `tol` or `max_iterations` is negative.

    Warns
    -----
    RankWarning
        If ranks were lowered.

    References
    ----------
    De Lathauwer, De Moor, Vandewalle (2000), SIAM J. Matrix Anal. Appl. 21(4), 1324-1342; Kolda, Bader (2009),
    SIAM Review 51(3), figure 4.4; L. R. Tucker (1966), Psychometrika 31, 279-311 (Tucker3).

    Examples
    --------
    >>> import numpy as np
    >>> X = np.arange(24.0).reshape(2, 3, 4)
    >>> d = tucker(X, (1, 2, 2))
    >>> [factor.shape for factor in d.factors], round(d.fit, 3)
    ([(2, 1), (3, 2), (4, 2)], 0.884)
    >>> tucker(X, 0.99).ranks
    (2, 2, 1)
    """
    tensor = _check_tensor(X)
    expected = f"{tensor.ndim} whole numbers, one for each mode of the tensor"
    asked = check_ranks(ranks, expected, [f"ranks[{mode}]" for mode in range(tensor.ndim)])
    tol = check_real("tol", tol, low=0.0)
    max_iterations = check_int("max_iterations", max_iterations, low=0)
    with ONE_THREAD:  # for the bits, and as more of them wait for each other longer than they work
        result = decompose(tensor, asked, tol, max_iterations)
        # Made now: the array is the caller's, who may go on to change it.
        made = TuckerDecomposition(result.core, tuple(result.factors), result.fit, result.iterations)
    if isinstance(asked, tuple) and result.ranks != asked:
        warn(
            f"ranks {asked} were asked of a tensor of shape {tensor.shape} and {result.ranks} used: a rank is "
            "at most its mode's size, its mode's numerical rank and the product of the other ranks; ask for less",
            RankWarning,
        )
    return made


def decompose(X: Floats, ranks: Ranks | float, tol: float = 1e-4, max_iterations: int = 50) -> TuckerDecomposition:
    """Do what :func:`tucker` does, without checking its parameters and without a warning about ranks.

    For callers with thousands of tensors and one place to warn: `ranks` of the result tells which were used. Its
    factors are made when they are first read, from `X`, which must not change until then.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64, N >= 2, no axis empty
    ranks : tuple of N int, each at least 1, or float
        The float is a share of the energy, in (0, 1].
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
    energy = float(np.vdot(X, X))
    if _LEAST_ENERGY < energy < _MOST_ENERGY:
        return _decompose(X, ranks, tol, max_iterations)
    largest = max(X.max(), -X.min())
    if not math.isfinite(largest):
        raise TensorError(
            "a tensor to decompose must be finite; got NaN or infinity in it: look for the run that "
            "diverged, or replace them, for example by numpy.nan_to_num"
        )
    if largest == 0.0:
        ranks = clip_ranks(ranks if isinstance(ranks, tuple) else [1] * X.ndim, X.shape)
        factors = tuple(np.eye(size, rank) for size, rank in zip(X.shape, ranks, strict=True))
        return TuckerDecomposition(np.zeros(ranks), factors, fit=1.0, iterations=0)
    # Squares of such numbers leave the range of floats; a power of two costs no digit.
    scale = math.ldexp(1.0, math.frexp(largest)[1] - 1)
    return _decompose(X / scale, ranks, tol, max_iterations, scale)


def _decompose(
    X: Floats, ranks: Ranks | float, tol: float, max_iterations: int, scale: float = 1.0
) -> TuckerDecomposition:
    """Decompose a tensor whose squares are in the range of floats, and multiply the core by `scale`."""
    ranks = clip_ranks(ranks if isinstance(ranks, tuple) else ranks_by_energy(X, ranks), X.shape)
    # There is nothing to find in a mode of size 1.
    modes = [mode for mode, size in enumerate(X.shape) if size > 1] or [0]
    kept = np.ascontiguousarray(X).reshape([X.shape[mode] for mode in modes])
    asked = tuple(ranks[mode] for mode in modes)
    longest = max(range(kept.ndim), key=kept.shape.__getitem__)
    makers: list[Callable[[], Floats] | None] = [None] * X.ndim
    if kept.shape[longest] ** 2 > kept.size:
        result, long_factor = _decompose_long(kept, longest, asked, tol, max_iterations)
    else:
        result, long_factor = iterate(kept, asked, tol, max_iterations), None
    used = [1] * X.ndim
    for place, mode in enumerate(modes):
        used[mode] = result.core.shape[place]
        makers[mode] = partial(result.factors.__getitem__, place)
    if long_factor is not None:
        makers[modes[longest]] = long_factor
    return _Found(result.core.reshape(used) * scale, _Factors(makers), result.fit, result.iterations)


def _decompose_long(
    X: Floats, mode: int, ranks: Ranks, tol: float, max_iterations: int
) -> tuple[Iterated, Callable[[], Floats]]:
    """Compress the long mode and decompose the small tensor; return that, and what makes the long factor.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64, C-ordered
    mode : int
        The one that is longer than the product of the others.
    ranks, tol, max_iterations : tuple of N int, float, int
        As for `decompose`.
    """
    swapped = X.swapaxes(0, mode)
    tall = swapped.reshape(len(swapped), -1)

    def decompose_small(R: Floats) -> Iterated:
        small = R.reshape(len(R), *swapped.shape[1:]).swapaxes(0, mode)
        return iterate(np.ascontiguousarray(small), ranks, tol, max_iterations)

    R = triangle(tall)
    if R is not None:
        result = decompose_small(R)
        if result.is_sure and result.fit < _SURE_FIT:
            small_factor = result.factors[mode]
            return result, lambda: orthonormal(tall @ scipy.linalg.solve_triangular(R, small_factor))
    Q, R = np.linalg.qr(tall)
    result = decompose_small(R)
    return result, lambda: Q @ result.factors[mode]


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
