"""Dense tensors and their Tucker decomposition; nothing here knows about learning.

A tensor ``X`` of shape (I_0, ..., I_{N-1}) is written as a small *core* ``G`` of shape (r_0, ..., r_{N-1})
multiplied in each mode by a *factor* ``U_n`` of shape (I_n, r_n) with orthonormal columns [1]_ [2]_ [3]_::

    X  ~  G x_0 U_0 x_1 U_1 ... x_{N-1} U_{N-1}

A *mode* is an axis, counted from 0. The mode-n *unfolding* lays the tensor out as a matrix with mode n along its
rows, and the *mode product* ``X x_n A`` multiplies that matrix by ``A``: with these two, the decomposition is
linear algebra. :func:`tucker` finds the factors: the leading left singular vectors of each unfolding to start
with (the truncated higher-order SVD), then sweeps over the modes that improve one factor at a time given the
others (higher-order orthogonal iteration), so that the fit never falls.

References
----------
.. [1] T. G. Kolda, B. W. Bader (2009). Tensor decompositions and applications. SIAM Review 51(3), 455-500.
.. [2] L. R. Tucker (1966). Some mathematical notes on three-mode factor analysis. Psychometrika 31, 279-311.
.. [3] L. De Lathauwer, B. De Moor, J. Vandewalle (2000). On the best rank-1 and rank-(R1, R2, ..., RN)
   approximation of higher-order tensors. SIAM J. Matrix Anal. Appl. 21(4), 1324-1342.

Examples
--------
>>> import numpy as np
>>> from tuckerl.tensor import tucker
>>> X = np.multiply.outer(np.outer([3.0, 4.0], [0.6, 0.8]), [1.0, 0.0, 0.0])
>>> d = tucker(X, (1, 1, 1))
>>> d.core.shape, round(d.fit, 9), np.allclose(d.to_tensor(), X)
((1, 1, 1), 1.0, True)
"""

from tuckerl.tensor.decomposition import TuckerDecomposition, decompose, tucker
from tuckerl.tensor.modes import fold, mode_product, unfold

__all__ = ["TuckerDecomposition", "decompose", "fold", "mode_product", "tucker", "unfold"]
