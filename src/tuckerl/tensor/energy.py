"""Ranks by explained energy: as many columns as carry a share of what a tensor's squares add up to.

The squares of the singular values of each unfolding add up to ``norm(X)**2``. Where the leading ones carry a share p
of it in each of N modes, the truncated higher-order SVD has an error of at most ``sqrt(N (1 - p)) norm(X)``, and the
sweeps that follow make it no larger [1]_. That a share such as 95 % says how many components to keep is the customary
rule of principal component analysis [2]_.

References
----------
.. [1] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). A multilinear singular value decomposition.
   SIAM J. Matrix Anal. Appl. 21(4), 1253-1278.
.. [2] I. T. Jolliffe (2002). Principal component analysis, 2nd edition, section 6.1.1. Springer.
"""

import numpy as np

from tuckerl.tensor.modes import Floats, unfold
from tuckerl.tensor.ranks import Ranks

# A share that is met exactly, as by squares of 95 and 5, is met whatever rounding says.
_ROUNDING = 1e-12


def ranks_by_energy(X: Floats, share: float) -> Ranks:
    """Return, for each mode, the least rank whose singular values carry a share of the tensor's energy.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64
        Not zero; its squares are in the range of floats.
    share : float
        In (0, 1]; 1 asks for each value that can be told from zero, so the sizes are returned, to be lowered to those.

    Returns
    -------
    tuple of N int
        Which a decomposition may have to lower: one may be above the product of the others.

    Examples
    --------
    >>> import numpy as np
    >>> ranks_by_energy(np.diag([3.0, 2.0, 1.0]), 13 / 14)  # squares of 9, 4 and 1
    (2, 2)
    """
    return X.shape if share == 1.0 else tuple(_rank(unfold(X, mode), share) for mode in range(X.ndim))


def _rank(unfolded: Floats, share: float) -> int:
    """Return how many of a matrix's largest singular values carry the share of all squares."""
    rows = unfolded if len(unfolded) <= unfolded.shape[1] else unfolded.T
    squares = np.maximum(np.linalg.eigvalsh(rows @ rows.T)[::-1], 0.0)
    carried = squares.cumsum()
    return 1 + int(np.searchsorted(carried, (1.0 - _ROUNDING) * share * carried[-1]))
