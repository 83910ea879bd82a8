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
from tuckerl.tensor.fit import fit_of, fit_of_energies
from tuckerl.tensor.lanczos import lanczos
from tuckerl.tensor.lapack import new_tools
from tuckerl.tensor.modes import Floats
from tuckerl.tensor.ranks import Ranks, clip_ranks
from tuckerl.tensor.singular import FAILED, NUMERICAL_ZERO, SURE, WELL_ABOVE_ZERO, room_for
from tuckerl.tensor.sweeps import find_factors
from tuckerl.tensor.tail import energy_beyond

# Above this fit, errors of energies show in it.
_NEARLY_ALL = 1.0 - 1e-3


# Up to so many rows, finding what the first mode has beyond its rank takes next to no time.
_LARGE = 200


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
    factors : (F,) float64
        One after the other, as :mod:`tuckerl.tensor.sweeps` has them.
    is_sure : bool
        Whether each singular value that is kept is so large that squares resolve it.
    """

    def __init__(self, X: Floats, ranks: Ranks) -> None:
        self._X, self.energy = X, float(np.vdot(X, X))
        n, side, flat = X.ndim, max(X.shape), X.reshape(-1)
        # Kernels know one kind of array: one that may be written to.
        self._tensor = new_tools(side), flat if flat.flags.writeable else flat.copy(), np.array(X.shape)
        lengths = [size * rank for size, rank in zip(X.shape, ranks, strict=True)]
        self._begins = [sum(lengths[:mode]) for mode in range(n + 1)]
        self.factors, self._squares = np.empty(self._begins[n] + lengths[0]), np.empty((n + 1, max(ranks)))
        self._rooms = self._squares, np.empty((4, X.size)), np.empty(room_for(side))
        self._projected = np.empty(X.shape[0] * math.prod(ranks[1:]))
        self._asked = ranks
        self._use(ranks)
        self.is_sure = self._begin(1, n + 1)
        if not self.is_sure:
            self._lower([ranks[0], *(self._rank(mode, ranks[mode]) for mode in range(1, n))])
        # A projection has at most the singular values of the whole: where they are large, so are the first mode's own.
        if self._squares[n, 0] <= WELL_ABOVE_ZERO**2 * self.energy:
            self.is_sure = False
            self._lower([self._rank(0, len(self._own)), *self.ranks[1:]])

    def _use(self, ranks: Ranks) -> None:
        """Let the factors have these ranks: of more vectors that were found, the last ones are the strongest."""
        n, self.ranks = len(ranks), ranks
        fewer = [(self._asked[mode] - ranks[mode]) * self._X.shape[mode] for mode in range(1, n)]
        places = [0, *map(sum, zip(self._begins[1:n], fewer, strict=True)), self._begins[n]]
        self._layout = np.array(ranks), np.array(places)

    def _lower(self, limits: list[int]) -> None:
        ranks = clip_ranks(self.ranks, limits)
        if ranks != self.ranks:
            self._use(ranks)
            self._begin(len(ranks), len(ranks) + 1)

    def _begin(self, first: int, beyond: int) -> bool:
        """Find own factors and return whether all their values were resolved in one pass."""
        return self._find(first, beyond, False, self.factors, self._projected) == SURE

    def _find(self, first: int, beyond: int, is_sweep: bool, factors: Floats, out: Floats) -> int:
        numbers = (*self._tensor, *self._layout, first, beyond, is_sweep)
        status = find_factors(*numbers, factors, *self._rooms, out)
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

    def improve(self, factors: Floats, first: int) -> Floats:
        """Improve factors from mode `first` on, each given the others, in place; return the core that they have then.

        Parameters
        ----------
        factors : (F,) float64
            As `factors`.
        first : int
        """
        core = np.empty(math.prod(self.ranks))
        self._find(first, len(self.ranks), True, factors, core)
        return core.reshape(self.ranks[::-1]).T

    def columns(self, factors: Floats) -> list[Floats]:
        """Return the factors that stand in a flat array, (I_n, r_n) each, the weakest column first."""
        shapes = zip(self._layout[1].tolist(), self.ranks, self._X.shape, strict=False)
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
        self._begin(0, 1)
        return self.factors[self._begins[-1] :][: count * size].reshape(count, size)

    @property
    def hosvd(self) -> list[Floats]:
        """The factors of the truncated higher-order SVD, (I_n, r_n) each."""
        return [self._own[-self.ranks[0] :].T, *self.columns(self.factors)[1:]]

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

    @property
    def _lowest_fit(self) -> float:
        """What the fit is at least: of the projection, its first factor loses no more than of all."""
        n = self._X.shape[0]
        if n > _LARGE:
            return -math.inf
        tools, flat, _ = self._tensor
        lost = energy_beyond(tools, flat, n, self.ranks[0], self._rooms[-1])
        projected = self._projected[: math.prod(self.ranks[1:]) * n]
        return fit_of_energies(float(np.vdot(projected, projected)) - lost, self.energy)

    def is_within(self, tol: float, fit: float) -> bool:
        """Return whether the start's fit differs by less than `tol` from `fit`, the first sweep's."""
        if fit < _NEARLY_ALL:
            highest = fit_of_energies(float(self._squares[-1, : self.ranks[0]].sum()), self.energy)  # of any factor
            if fit - highest >= tol:
                return False
            if fit - self._lowest_fit < tol * (1.0 - 1e-6) and highest < fit + tol * (1.0 - 1e-6):
                return True
        return abs(fit - self.fit) < tol
