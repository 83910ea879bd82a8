"""The fit of a decomposition, ``1 - norm(X - X_hat) / norm(X)``."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from tuckerl.tensor.modes import Floats, multiply_all

# Where less than this part of the energy is left, the difference of two energies would be mostly rounding.
_SMALL_REST = 1e-6


def fit_of_energies(core: float, whole: float) -> float:
    """Return the fit where the core has orthonormal factors: ``norm(X - X_hat)**2 = norm(X)**2 - norm(core)**2``."""
    return 1.0 - math.sqrt(max(0.0, 1.0 - core / whole))


def fit_of(X: Floats, energy: float, core: Floats, factors: Callable[[], Sequence[Floats]]) -> float:
    """Return the fit of a core and its orthonormal factors.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) float64
    energy : float
        ``norm(X)**2``.
    core : (r_0, ..., r_{N-1}) float64
        X multiplied by the transposed factors.
    factors : callable
        Returns N arrays (I_n, r_n).
    """
    of_core = float(np.vdot(core, core))
    if of_core < (1.0 - _SMALL_REST) * energy:
        return fit_of_energies(of_core, energy)
    residual = X - multiply_all(core, factors())
    return 1.0 - math.sqrt(float(np.vdot(residual, residual)) / energy)
