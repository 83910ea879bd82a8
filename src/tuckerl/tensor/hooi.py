"""Higher-order orthogonal iteration: sweeps over the modes that improve one factor at a time.

Among factors with orthonormal columns, the best rank-(r_0, ..., r_{N-1}) approximation of X maximises the norm of the
core ``G = X x_0 U_0' ... x_{N-1} U_{N-1}'``. Given all factors but the n-th, the best n-th one holds the r_n leading
left singular vectors of the unfolding of X projected on the others. A sweep goes through the modes in order; sweeps
begin at the truncated higher-order SVD (:mod:`tuckerl.tensor.start`) and end when the fit settles [1]_.

References
----------
.. [1] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). On the best rank-1 and rank-(R1, R2, ..., RN)
   approximation of higher-order tensors. SIAM J. Matrix Anal. Appl. 21(4), 1324-1342.
"""

from typing import NamedTuple

from tuckerl.interrupts import is_impatient
from tuckerl.tensor.modes import Floats
from tuckerl.tensor.ranks import Ranks
from tuckerl.tensor.start import Start


class Iterated(NamedTuple):
    """What the sweeps return."""

    core: Floats
    factors: list[Floats]
    fit: float
    iterations: int
    is_sure: bool  # whether squares resolve all that the start keeps


def iterate(X: Floats, ranks: Ranks, tol: float, max_iterations: int) -> Iterated:
    """Find the core and the factors of a tensor.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64, C-ordered
        Not zero; no mode longer than the product of the others.
    ranks : tuple of N int
        Lowered to what `X` has.
    tol, max_iterations : float, int
        As for :func:`tuckerl.tensor.tucker`.
    """
    start = Start(X, ranks)
    if max_iterations == 0:
        return Iterated(start.core, start.hosvd, start.fit, 0, start.is_sure)
    (fit, is_over), iteration = start.first_sweep(tol), 1
    while not is_over and iteration < max_iterations:
        if is_impatient():  # Ctrl-C waits where a learner decomposes
            raise KeyboardInterrupt
        before, fit = fit, start.later_sweep()
        is_over, iteration = abs(fit - before) < tol, iteration + 1
    return Iterated(start.improved_core, start.improved, fit, iteration, start.is_sure)
