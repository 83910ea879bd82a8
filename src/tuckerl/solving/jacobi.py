"""Steps of value iteration apart from the values (Jacobi), which say how close these are; see `bounds`."""

from typing import NamedTuple

import numpy as np

from tuckerl.solving.bounds import Stopping
from tuckerl.solving.sweeps import follow_apart, improve
from tuckerl.solving.undiscounted import refuse_endless_gain
from tuckerl.types import FloatArray

_PAYS = 0.9  # of the differences may be left


class Applied(NamedTuple):
    """Values after some applications of the optimality operator."""

    v: FloatArray  # (S + 1,)
    n_steps: int
    is_enough: bool  # whether v was close enough before the last of them, which was left out then


def apply_and_look(v: FloatArray, stopping: Stopping, n_follow: int = 0) -> Applied:
    """Apply the operator once, and say whether that was necessary; again, as long as it pays.

    Where nothing ends, values soon lack no more than one common number, if the states mix: steps that
    shrink the differences of what is lacking are repeated, and a common number is added at once.

    Parameters
    ----------
    v : (S + 1,) float64
        May be changed.
    stopping : Stopping
    n_follow : int
        Where steps are repeated: how often the policy that each finds is followed before the next.
    """
    model, gamma, n_steps, span = stopping.model, stopping.gamma, 0, np.inf
    better, policy = np.empty_like(v), np.full(model.n_states, -1, dtype=np.int64)
    while True:
        low, high, _ = improve(model, v, gamma, 0.0, policy, better)
        n_steps += 1
        if stopping.is_enough(low, high, v):
            return Applied(v, n_steps, is_enough=True)
        if gamma == 1.0:
            refuse_endless_gain(model, policy, v, better)
        v, better = better, v
        v[:-1] += stopping.common(low, high)
        if not stopping.may_shift or high - low > _PAYS * span:
            return Applied(v, n_steps, is_enough=False)
        span = high - low
        follow_apart(model, policy, v, better, gamma, n_follow // 2)
