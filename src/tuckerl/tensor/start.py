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

from functools import cached_property

import numpy as np

from tuckerl.tensor.fit import fit_of, fit_of_energies
from tuckerl.tensor.modes import Floats, fibres, multiply_all, project_last
from tuckerl.tensor.ranks import Ranks, clip_ranks
from tuckerl.tensor.singular import WELL_ABOVE_ZERO, Leading, leading

# Above this fit, errors of energies show in it.
_NEARLY_ALL = 1.0 - 1e-3


class Start:
    """The truncated higher-order SVD of a tensor.

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
    others : list of N - 1 arrays (I_n, r_n)
        The factors of all modes but the first.
    best_first : (I_0, r_0) float64
        The best first factor, given the others: not the start's own, but the first sweep's.
    is_sure : bool
        Whether each singular value that is kept is so large that squares resolve it.
    """

    def __init__(self, X: Floats, ranks: Ranks) -> None:
        self._X, self.energy = X, float(np.vdot(X, X))
        self.ranks = ranks
        self._found = [leading(fibres(X, mode), rank) for mode, rank in enumerate(ranks) if mode]
        self.is_sure = all(found.is_well_above_zero for found in self._found)
        if not self.is_sure:
            self.ranks = clip_ranks(ranks, (ranks[0], *(found.rank for found in self._found)))
        self._project()
        # A projection has at most the singular values of the whole: where they are large, so are the first mode's own.
        if self._squares[0] <= WELL_ABOVE_ZERO**2 * self.energy:
            self.is_sure = False
            self.ranks = clip_ranks(self.ranks, (self._first.rank, *self.ranks[1:]))
            self._project()

    def _project(self) -> None:
        """Find what the first sweep begins with."""
        pairs = zip(self._found, self.ranks[1:], strict=True)
        self.others = [found.vectors[:, -rank:] for found, rank in pairs]
        self.best_first, self._squares = leading(project_last(self._X, self.others), self.ranks[0])

    @cached_property
    def _first(self) -> Leading:
        return leading(fibres(self._X, 0), self.ranks[0])

    @property
    def first(self) -> Floats:
        """The first factor, (I_0, r_0)."""
        return self._first.vectors[:, -self.ranks[0] :]

    @cached_property
    def core(self) -> Floats:
        """The core that goes with its factors, (r_0, ..., r_{N-1})."""
        return multiply_all(self._X, [factor.T for factor in (self.first, *self.others)])

    @property
    def fit(self) -> float:
        """The fit of its factors."""
        return fit_of(self._X, self.energy, self.core, [self.first, *self.others])

    def is_within(self, tol: float, fit: float) -> bool:
        """Return whether the start's fit differs by less than `tol` from `fit`, the first sweep's."""
        highest = fit_of_energies(float(self._squares.sum()), self.energy)  # of any first factor with these others
        if fit < _NEARLY_ALL and fit - highest >= tol:
            return False
        return abs(fit - self.fit) < tol
