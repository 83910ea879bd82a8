"""Where the sweeps begin: the truncated higher-order SVD, but for what nothing reads of it.

Its n-th factor holds the leading left singular vectors of the mode-n unfolding; its squared error is at most the sum of
the squared singular values that were cut off [1]_. A sweep replaces the first factor before anything reads it. All that
counts of it is the start's fit, for the sweeps end after the first one if that has gained less than `tol`; and where
the first sweep's best factor with the start's others is too far off, no factor of the start's own can be near enough.

References
----------
.. [1] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). A multilinear singular value decomposition.
   SIAM J. Matrix Anal. Appl. 21(4), 1253-1278.
"""

import math
from functools import cached_property

import numpy as np

from tuckerl.errors import DecompositionError
from tuckerl.tensor.fit import fit_of
from tuckerl.tensor.lanczos import lanczos
from tuckerl.tensor.lapack import new_tools
from tuckerl.tensor.modes import Floats
from tuckerl.tensor.ranks import Ranks, clip_ranks
from tuckerl.tensor.singular import FAILED, NUMERICAL_ZERO, SURE, WELL_ABOVE_ZERO, room_for
from tuckerl.tensor.work import (
    BEST_FIRST,
    COMPARE,
    ENDED,
    FIRST_SWEEP,
    FIT,
    OWN_FIRST,
    START,
    SWEEP,
    TOL,
    UNDECIDED,
    work,
)


class Start:
    """The truncated higher-order SVD of a tensor, but for the first mode the best factor, given the others.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64, C-ordered
        Not zero; no mode longer than the product of the others.
    ranks : tuple of N int
        Lowered to what `X` has.

    Attributes
    ----------
    energy : float
        ``norm(X)**2``.
    ranks : tuple of N int
        Those that are used.
    is_sure : bool
        Whether each singular value that is kept is so large that squares resolve it.
    """

    def __init__(self, X: Floats, ranks: Ranks) -> None:
        self._X, self.energy = X, float(np.vdot(X, X))
        n, shape, flat = X.ndim, X.shape, X.reshape(-1)
        side = max(shape)
        # Kernels know one kind of array: one that may be written to.
        self._tensor = new_tools(side), flat if flat.flags.writeable else flat.copy(), np.array(shape)
        begins = [0]
        for size, rank in zip(shape, ranks, strict=True):
            begins.append(begins[-1] + size * rank)
        self._begins, n_numbers = begins, begins[n] + begins[1]
        # Factors stand one after the other, as `find_factors` has them.
        self._factors, self._improved = np.empty(n_numbers), np.empty(n_numbers)
        self._numbers, self._squares = np.array([self.energy, 0.0, 0.0]), np.empty((n + 1, max(ranks)))
        self._rooms = self._squares, np.empty((4, flat.size)), np.empty(room_for(side))
        self._projected, self._core = np.empty(shape[0] * math.prod(ranks[1:])), np.empty(math.prod(ranks))
        self._asked = ranks
        self._use(ranks)
        self.is_sure = self._find(START) == SURE
        if not self.is_sure:
            self._lower([ranks[0], *(self._rank(mode, ranks[mode]) for mode in range(1, n))])
        # A projection has at most the singular values of the whole: where they are large, so are the first mode's own.
        if self._squares[n, 0] <= WELL_ABOVE_ZERO**2 * self.energy:
            self.is_sure = False
            self._lower([self._rank(0, len(self._own)), *self.ranks[1:]])

    def _use(self, ranks: Ranks) -> None:
        """Let the factors have these ranks: of more vectors that were found, the last ones are the strongest."""
        asked, shape, begins = self._asked, self._X.shape, self._begins
        others = range(1, len(ranks))
        places = [0, *(begins[mode] + (asked[mode] - ranks[mode]) * shape[mode] for mode in others), begins[-1]]
        self.ranks, self._places = ranks, places
        self._layout = np.array(ranks), np.array(places)

    def _lower(self, limits: list[int]) -> None:
        ranks = clip_ranks(self.ranks, limits)
        if ranks != self.ranks:
            self._use(ranks)
            self._find(BEST_FIRST)

    def _find(self, what: int) -> int:
        """Let kernels work, and return what they say."""
        factors = self._factors, self._improved
        status = work(
            what, *self._tensor, *self._layout, self._numbers, *factors, *self._rooms, self._projected, self._core
        )
        if status == FAILED:
            raise DecompositionError(
                f"LAPACK gave no eigenvectors of a Gram matrix of a finite tensor of shape {self._X.shape}, in two "
                "ways: decompose another window, or use another build of SciPy"
            )
        return status

    def _rank(self, mode: int, count: int) -> int:
        """Return how many of the largest singular values of a mode can be told from zero."""
        squares = self._squares[mode, :count]
        return int(np.count_nonzero(squares > NUMERICAL_ZERO**2 * squares[-1]))

    def first_sweep(self, tol: float) -> tuple[float, bool]:
        """Improve the start's factors, each given the others; return the fit, and whether that gains less than `tol`.

        The start has the first sweep's first factor already.
        """
        self._numbers[TOL] = tol
        status = self._find(FIRST_SWEEP)
        fit = self._improved_fit()
        return fit, status == ENDED if status != UNDECIDED else abs(fit - self.fit) < tol

    def later_sweep(self) -> float:
        """Improve all factors once more and return the fit."""
        self._find(SWEEP)
        return self._improved_fit()

    def is_within(self, tol: float, fit: float) -> bool:
        """Return whether the start's fit differs by less than `tol` from `fit`, the first sweep's."""
        self._numbers[TOL], self._numbers[FIT] = tol, fit
        status = self._find(COMPARE)
        return status == ENDED if status != UNDECIDED else abs(fit - self.fit) < tol

    def _improved_fit(self) -> float:
        return fit_of(self._X, self.energy, self.improved_core, lambda: self.improved)

    @property
    def improved_core(self) -> Floats:
        """The core that sweeps have found, (r_0, ..., r_{N-1})."""
        return self._core[: math.prod(self.ranks)].reshape(self.ranks[::-1]).T

    @property
    def improved(self) -> list[Floats]:
        """The factors that sweeps have found, (I_n, r_n) each, the weakest column first."""
        return self._columns(self._improved)

    def _columns(self, factors: Floats) -> list[Floats]:
        shapes = zip(self._places, self.ranks, self._X.shape, strict=False)
        return [factors[place : place + rank * size].reshape(rank, size).T for place, rank, size in shapes]

    @cached_property
    def _own(self) -> Floats:
        """The first mode's leading singular vectors as rows, the weakest first: (r_0, I_0)."""
        count, size = self.ranks[0], self._X.shape[0]
        few = lanczos(self._X.reshape(size, -1), count)
        if few is not None:
            self._squares[0, :count], vectors = few
            if self._squares[0, 0] > WELL_ABOVE_ZERO**2 * self._squares[0, count - 1]:
                return vectors
        self._find(OWN_FIRST)
        return self._factors[self._begins[-1] :][: count * size].reshape(count, size)

    @property
    def hosvd(self) -> list[Floats]:
        """The factors of the truncated higher-order SVD, (I_n, r_n) each."""
        return [self._own[-self.ranks[0] :].T, *self._columns(self._factors)[1:]]

    @property
    def core(self) -> Floats:
        """The core that goes with those, (r_0, ..., r_{N-1})."""
        size = self._X.shape[0]
        rows = self._projected[: math.prod(self.ranks[1:]) * size].reshape(-1, size)
        return (self._own[-self.ranks[0] :] @ rows.T).reshape(self.ranks)

    @property
    def fit(self) -> float:
        """The fit of the truncated higher-order SVD."""
        return fit_of(self._X, self.energy, self.core, lambda: self.hosvd)
