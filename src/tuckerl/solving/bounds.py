"""How far values are from the optimal ones, at most: proven, not estimated.

With a discount, from the least and the largest change m <= T v - v <= M of one application of the optimality operator
T follows (MacQueen 1966; Puterman, *Markov Decision Processes*, 2005, section 6.6.2)

    T v + gamma / (1 - gamma) m  <=  v*  <=  T v + gamma / (1 - gamma) M,

where the end counts as a state that does not change: with ends, m is at most and M at least 0.

Without a discount no such bound holds for every function v. What can be proven is proven afterwards: see `certified`.
"""

import math

import numpy as np

from tuckerl.solving.model import Model
from tuckerl.solving.sweeps import improve
from tuckerl.types import FloatArray


class Stopping:
    """When the sweeps of a method have come close enough.

    Parameters
    ----------
    model : Model
    gamma : float
    tol : float
        How far values may be from the optimal ones. Without a discount, by how much T may still change them.
    """

    def __init__(self, model: Model, gamma: float, tol: float) -> None:
        self.model, self.gamma, self.tol = model, gamma, tol
        self._has_ends = model.has_ends

    @property
    def may_shift(self) -> bool:
        """Whether values may lack one common number: nothing ends, and there is a discount."""
        return self.gamma < 1.0 and not self._has_ends

    def is_enough(self, low: float, high: float, v: FloatArray) -> bool:
        """Return whether changes from `low` to `high` are small enough, or as small as rounding lets them become."""
        rounding = self.model.rounding(v)
        if self.gamma == 1.0:
            return high <= max(self.tol, rounding)
        least = 2.0 * rounding / (1.0 - self.gamma)
        return self.bound(low, high, v) <= max(self.tol, 2.0 * least)

    def centre(self, low: float, high: float) -> float:
        """Return what moves T v into the middle of its bounds; the discount is below 1."""
        return self.gamma / (1.0 - self.gamma) * 0.5 * sum(self._span(low, high))

    def common(self, low: float, high: float) -> float:
        """Return what all values lack alike, 0 where they do not: nothing ends, and T moves all by nearly the same."""
        is_alike = high - low <= 0.5 * max(-low, high)
        return self.centre(low, high) if self.may_shift and is_alike else 0.0

    def bound(self, low: float, high: float, v: FloatArray) -> float:
        """Return how far T u is from v*, at most, where u is T v in the middle of its bounds; discount below 1."""
        least, most = self._span(low, high)
        radius = self.gamma / (1.0 - self.gamma) * 0.5 * (most - least)
        return self.gamma * radius + 2.0 * self.model.rounding(v) / (1.0 - self.gamma)

    def _span(self, low: float, high: float) -> tuple[float, float]:
        return (min(low, 0.0), max(high, 0.0)) if self._has_ends else (low, high)


def lowest_values(model: Model, gamma: float) -> FloatArray:
    """Return values below the optimal ones that T only raises, (S + 1,): what the least of the best rewards comes to.

    From there a value rises as soon as a way to something better is known, in place; from above, all would have to sink
    step by step.
    """
    shape = model.n_states, model.n_actions
    reward = model.reward.reshape(shape)
    best = reward.max(axis=1) if not model.allowed.size else np.where(model.allowed, reward, -np.inf).max(axis=1)
    lowest = float(best.min())
    v = np.full(model.n_states + 1, (min(lowest, 0.0) if model.has_ends else lowest) / (1.0 - gamma))
    v[-1] = 0.0
    return v


def certified(model: Model, v: FloatArray, residual: float, steps: FloatArray) -> float:
    """Return how far T v is from the optimal values, at most, where v is the value of a policy that ends; no discount.

    If T u <= u for some u, no policy that ends is worth more than u (its values after n steps are at most T^n u). Tried
    is u = v + c times the policy's expected steps to the end, with c above what T and rounding change in v.

    Parameters
    ----------
    model : Model
        Of an :class:`~tuckerl.solving.undiscounted.EndingModel`.
    v : (S + 1,) float64
        0 for the end and where there is no value.
    residual : float
        By how much the policy's equation moves v at most.
    steps : (S + 1,) float64
        How many steps the policy needs to the end; 0 for the end and where there is no value.

    Returns
    -------
    float
        Infinite where u proves nothing, as in cycles that cost nothing. 0 where whole numbers prove it exactly.
    """
    better, greedy = np.zeros_like(v), np.full(model.n_states, -1, dtype=np.int64)
    _, high, _ = improve(model, v, 1.0, 0.0, greedy, better)
    if high <= 0.0 and residual == 0.0 and _is_exact(model, v):
        return 0.0
    c = 2.0 * (max(high, residual) + model.rounding(v))
    upper = v + c * steps
    _, left, _ = improve(model, upper, 1.0, 0.0, greedy, better)
    return 1.5 * c * float(steps.max()) if left <= -model.rounding(upper) else math.inf


def _is_exact(model: Model, v: FloatArray) -> bool:
    """Return whether no sum was rounded: whole numbers, and one outcome for each pair."""
    if model.offsets.size or model.largest_reward + np.abs(v).max() > 2**52:
        return False
    return bool((v == np.rint(v)).all() and (model.reward == np.rint(model.reward)).all())
