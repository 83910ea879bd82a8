"""Modified policy iteration: a policy is evaluated by a few sweeps only before it is made greedy again.

Source: Puterman and Shin, "Modified policy iteration algorithms for discounted Markov decision problems", 1978;
Puterman, *Markov Decision Processes*, 2005, section 6.5. The sweeps are in place, forwards and backwards in turn.
"""

import numpy as np

from tuckerl.solving.bounds import Stopping
from tuckerl.solving.jacobi import apply_and_look
from tuckerl.solving.sweeps import follow, sweep
from tuckerl.types import FloatArray

_SWEEPS = 20  # of a policy: many, as each costs a pair a state where finding the policy costs all pairs
_SWEEPS_APART = 6  # where nothing ends, and the differences of values are soon right


def modified_policy_iteration(v: FloatArray, stopping: Stopping) -> tuple[FloatArray, int]:
    """Return values close enough to the optimal ones, (S + 1,), and how many policies were followed.

    Parameters
    ----------
    v : (S + 1,) float64
        Where to begin; changed. Without a discount, values of a policy that ends.
    stopping : Stopping
    """
    model, gamma = stopping.model, stopping.gamma
    policy = np.full(model.n_states, -1, dtype=np.int64)
    n_policies, between = 0, 0 if stopping.may_shift else 1
    while True:
        for _ in range(between):
            sweep(model, v, gamma, policy, n_policies, 1)
            follow(model, policy, v, gamma, _SWEEPS)
            n_policies += 1
        v, n_steps, is_enough = apply_and_look(v, stopping, _SWEEPS_APART)
        n_policies += n_steps
        if is_enough:
            return v, n_policies
        between += 1 + between // 4
