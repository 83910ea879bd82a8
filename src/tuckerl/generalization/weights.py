"""How a decomposition of the tables becomes one learning-rate weight for each action (the paper's omega).

A weighting takes the decomposition of the window's tables and returns (A,) weights. To add one, write a file
with a function and list that in `WEIGHTINGS`: ``Weighting("tuckerl.generalization.file:function", ...)``.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import shown, to_array
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.generalization.answers import real_array
from tuckerl.interrupts import may_raise_interrupts
from tuckerl.memory import Part, check_memory
from tuckerl.registers import load
from tuckerl.tensor import TuckerDecomposition
from tuckerl.types import FloatArray

WeightFunction = Callable[[TuckerDecomposition], ArrayLike]
"""What a user may pass as `weights`: decomposition in, (A,) non-negative numbers out."""


class Weighting(NamedTuple):
    """A weighting: from (decomposition or None, A, a generator) to (A,) weights."""

    function: Callable[[TuckerDecomposition | None, int, np.random.Generator], FloatArray] | str  # or its home
    needs_decomposition: bool
    description: str  # what an action's learning rate is multiplied by
    draws: bool = True  # whether it uses the generator, which takes longer to make than weights do

    def weigh(self, decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
        """Return the weights, (A,)."""
        function = load(self.function) if isinstance(self.function, str) else self.function
        weights: FloatArray = function(decomposition, n_actions, rng)
        return weights


def action_weights(action_factor: ArrayLike) -> FloatArray:
    r"""Return the paper's omega: each row's norm over the norm of the whole action factor.

    .. math:: \omega(a) = \lVert A_p(a, :) \rVert / \lVert A_p \rVert_F

    Parameters
    ----------
    action_factor : (A, R) float
        The action sub-space A_p, ``decomposition.factors[1]``.

    Returns
    -------
    (A,) float64
        Non-negative; their squares sum to 1.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is not a matrix of finite numbers, or all zero.

    References
    ----------
    The paper's Figure 5, line 19.

    Examples
    --------
    >>> action_weights([[3.0], [4.0]])
    array([0.6, 0.8])
    """
    expected = "an (A, R) matrix of finite numbers, not all zero"
    given = to_array("action_factor", action_factor, expected)
    if given.dtype.kind not in "biuf":
        raise ParameterTypeError(f"action_factor must be {expected}; got dtype {given.dtype}")
    check_memory("action_weights", [Part(f"its shape {given.shape}", 8 * given.size, "give a smaller factor")])
    factor = given.astype(np.float64)
    if factor.ndim != 2 or not np.isfinite(factor).all() or not factor.any():
        raise ParameterError(f"action_factor must be {expected}; got shape {factor.shape}")
    # By a power of two, which changes no bit of the result: squares of the largest numbers are out of range.
    return _omega(np.ldexp(factor, -np.frexp(np.abs(factor).max())[1]))


def _omega(factor: FloatArray) -> FloatArray:
    norms: FloatArray = row_norms(factor)
    return norms / math.sqrt(float(norms @ norms))


def row_norms(factor: FloatArray) -> FloatArray:
    """Return the norms of a matrix's rows, whose squares are in the range of floats: (n, r) becomes (n,)."""
    norms: FloatArray = np.sqrt(np.einsum("ij,ij->i", factor, factor))
    return norms


def _decomposed(decomposition: TuckerDecomposition | None) -> TuckerDecomposition:
    if decomposition is None:
        raise ParameterError("this weighting needs a decomposition; got None")
    return decomposition


def _paper(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    weights = _omega(_decomposed(decomposition).factors[1])
    # What is zero up to rounding is an action without a single value in any table: it must read as zero everywhere.
    return np.where(weights < 1e-12, 0.0, weights)


def _relative(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    """Divide by the largest weight, so that the best action keeps the full learning rate."""
    weights = _paper(decomposition, n_actions, rng)
    relative: FloatArray = weights / weights.max()
    return relative


def _constant(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    """Control for a smaller learning rate: the paper's root mean square for every action."""
    return np.full(n_actions, 1.0 / math.sqrt(n_actions))


def _permuted(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    """Control for which action gets which: the paper's values, dealt to random actions."""
    return rng.permutation(_paper(decomposition, n_actions, rng))


def _none(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    return np.ones(n_actions)


WEIGHTINGS = {
    "paper": Weighting(_paper, True, "the norm of its row in the action factor, over the whole factor's", draws=False),
    "relative": Weighting(_relative, True, "that norm over the largest of them", draws=False),
    "constant": Weighting(
        _constant, False, "1/√|A|, whatever the action: the control for a smaller learning rate", draws=False
    ),
    "permuted": Weighting(
        _permuted, True, "the paper's weights, dealt to random actions: the control for which action gets which"
    ),
    "none": Weighting(_none, False, "1", draws=False),
}


def custom_weighting(function: WeightFunction) -> Weighting:
    """Return a user's function as a weighting whose result is checked."""

    @may_raise_interrupts
    def weigh(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
        answer = function(_decomposed(decomposition))
        weights = real_array("what the weights function returns", answer)
        if weights is None or weights.shape != (n_actions,) or not np.isfinite(weights).all() or (weights < 0).any():
            raise ParameterError(
                f"the weights function must return {n_actions} finite numbers of at least 0, one for each action; "
                f"got {shown(answer)}"
            )
        return weights

    return Weighting(weigh, True, "a function of the user's own", draws=False)
