"""Where the sweeps begin: the truncated higher-order SVD, but for what nothing reads of it.

Its n-th factor holds the leading left singular vectors of the mode-n unfolding; its squared error is at most the sum of
the squared singular values that were cut off [1]_. A sweep replaces the first factor before anything reads it. All that
counts of it is the start's fit, for the sweeps end after the first one if that has gained less than `tol`; and on which
side of such a limit the fit lies can be told without the factor's last digits.

Let A be the first unfolding, transposed, and Y the same of the tensor projected on the start's other factors. The first
sweep has found the r leading right singular vectors U of Y; the start has those of A, Z. Its core's squared norm is
``norm(YZ)**2``, at most ``norm(YU)**2``. Where that does not tell, a step of subspace iteration may, from U to A'AU,
which comes closer to Z; else Z is approximated in a block Krylov space, of U, A'AU, A'A A'AU, ..., by Rayleigh and
Ritz: block by block, until it tells, or the space would be most of all there is and Z is found as such [2]_.

References
----------
.. [1] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). A multilinear singular value decomposition.
   SIAM J. Matrix Anal. Appl. 21(4), 1253-1278.
.. [2] Y. Saad (2011). Numerical methods for large eigenvalue problems, 2nd edition. SIAM, chapters 5 and 6.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from tuckerl.tensor.fit import fit_of, fit_of_energies
from tuckerl.tensor.modes import Floats, fibres, multiply_all, project_last
from tuckerl.tensor.ranks import Ranks, clip_ranks
from tuckerl.tensor.singular import WELL_ABOVE_ZERO, Leading, leading
from tuckerl.tensor.solvers import symmetric_eigen

# A Krylov space with more dimensions than this part of all saves nothing.
_MOST_OF_ALL = 0.7

# An eigenproblem of so few rows is solved sooner than avoided.
_FEW = 48

_ORTHOGONAL = 1e-8  # what columns that are orthogonal but for rounding have in common, at most

_SIDES = 3  # vectors of no preferred direction among those that a Krylov space begins with

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
        self._is_first_sure = self._squares[0] > WELL_ABOVE_ZERO**2 * self.energy
        if not self._is_first_sure:
            self.is_sure = False
            self.ranks = clip_ranks(self.ranks, (self._first.rank, *self.ranks[1:]))
            self._project()

    def _project(self) -> None:
        """Find what the first sweep begins with."""
        pairs = zip(self._found, self.ranks[1:], strict=True)
        self.others = [found.vectors[:, -rank:] for found, rank in pairs]
        self._Y = project_last(self._X, self.others)
        self.best_first, self._squares = leading(self._Y, self.ranks[0])

    @cached_property
    def _first(self) -> Leading:
        return leading(fibres(self._X, 0), self.ranks[0])

    @property
    def first(self) -> Floats:
        """The first factor, (I_0, r_0)."""
        return self._first.vectors[:, -self.ranks[0] :]

    def is_within(self, tol: float, fit: float) -> bool:
        """Return whether the start's fit differs by less than `tol` from `fit`, the first sweep's."""
        highest = fit_of_energies(float(self._squares.sum()), self.energy)
        if fit - highest >= tol:
            return False
        if fit > _NEARLY_ALL:
            factors = [self.first, *self.others]
            core = multiply_all(self._X, [factor.T for factor in factors])
            return abs(fit - fit_of(self._X, self.energy, core, factors)) < tol
        estimates = self._estimates(highest, tol) if self._is_first_sure else [(self._fit_by(self.first), 0.0)]
        for estimate, error in estimates:
            if error < abs(fit - tol - estimate):
                break
        return fit - estimate < tol

    def _estimates(self, highest: float, tol: float) -> Iterator[tuple[float, float]]:
        """Yield ever better estimates of the fit, and what they may be wrong by; the last one is exact."""
        A, Y, U = fibres(self._X, 0), self._Y, self.best_first
        n, r = U.shape
        if 2 * r > _MOST_OF_ALL * n and n <= _FEW:
            yield self._fit_by(self.first), 0.0
            return
        image = A @ U
        # Vectors that lean to all sides see what U and its images are blind to: rows that are zero in Y, for one.
        sides = np.cos(np.outer(np.arange(n), np.arange(1, max(_SIDES, r // 2) + 1)))
        unseen = A.T @ (A @ (sides - U @ (U.T @ sides)))
        unseen = np.linalg.qr(unseen - U @ (U.T @ unseen))[0]
        image_of_sides = A @ unseen
        replaceable = self._replaceable(image, image_of_sides) / (2.0 * (1.0 - highest) * self.energy)
        if replaceable < tol:
            step = A.T @ image / self._squares
            projected = Y @ step
            kept = float(np.linalg.solve(step.T @ step, projected.T @ projected).trace())
            estimate = fit_of_energies(kept, self.energy)
            yield estimate, 20.0 * abs(estimate - highest) + replaceable
        space, images, image, before = U, image, np.hstack([image, image_of_sides[:, -_SIDES:]]), highest
        while space.shape[1] + image.shape[1] <= _MOST_OF_ALL * n:
            block = A.T @ image
            block -= space @ (space.T @ block)
            lengths = np.sqrt(np.einsum("ij,ij->j", block, block))
            if lengths.min() == 0.0:
                break
            block /= lengths
            block = np.linalg.qr(block - space @ (space.T @ block))[0]  # what rounding left of the space, too
            if np.abs(space.T @ block).max() > _ORTHOGONAL:
                break  # the images of U bring nothing more
            image = A @ block
            space, images = np.hstack([space, block]), np.hstack([images, image])
            estimate = self._fit_by(space @ symmetric_eigen(images.T @ images)[1][:, -r:])
            yield estimate, 3.0 * abs(estimate - before)  # what is left is far less than what a block has brought
            before = estimate
        yield self._fit_by(self.first), 0.0

    def _replaceable(self, image: Floats, image_of_sides: Floats) -> float:
        """Return how much energy the best first factor can lose at most to directions that it does not see.

        The j-th strongest of these takes the place of the j-th weakest of its own only if that is weaker.
        """
        seen = symmetric_eigen(image_of_sides.T @ image_of_sides)[0][::-1]
        rest = max(0.0, self.energy - float(np.vdot(image, image) + seen.sum()))
        beyond = rest / np.arange(1, max(0, self._squares.size - seen.size) + 1)
        strongest = np.concatenate([3.0 * seen, beyond])[: self._squares.size]  # from below, hence the 3
        return float(self._squares[self._squares < strongest].sum())

    def _fit_by(self, first: Floats) -> float:
        """Return the fit of a first factor and the others of the start."""
        core = self._Y @ first
        return fit_of_energies(float(np.vdot(core, core)), self.energy)
