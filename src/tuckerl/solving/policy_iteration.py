"""Policy iteration: a policy is evaluated exactly and made greedy by its values, until it stays (Howard 1960).

Source: Puterman, *Markov Decision Processes*, 2005, section 6.4; Sutton and Barto, *Reinforcement Learning*, 2018,
section 4.3.
"""

import numpy as np

from tuckerl.solving.bounds import Stopping
from tuckerl.solving.policy_value import policy_values
from tuckerl.solving.sweeps import improve, sweep
from tuckerl.solving.undiscounted import gain_slack, greedy_that_ends, refuse_endless_gain
from tuckerl.types import FloatArray

_FIRST_SWEEPS = 4  # of value iteration, for the first policy: they cost less than evaluating a bad one


def policy_iteration(v: FloatArray, stopping: Stopping) -> tuple[FloatArray, int]:
    """Return the values of a policy that is its own greedy policy, (S + 1,), and how many policies were evaluated.

    Parameters
    ----------
    v : (S + 1,) float64
        The first policy is what a few sweeps of value iteration make of them; changed. Without a discount, the
        first policy is greedy by them and ends.
    stopping : Stopping
    """
    model, gamma, better = stopping.model, stopping.gamma, np.empty_like(v)
    policy = np.full(model.n_states, -1, dtype=np.int64)
    if gamma == 1.0:
        policy = greedy_that_ends(model, v)
    else:
        sweep(model, v, gamma, policy, 0, _FIRST_SWEEPS)
    n_policies, before = 0, np.full_like(v, -np.inf)
    while True:
        v[:-1] = policy_values(model, policy, gamma)
        n_policies += 1
        slack = gain_slack(model, v) if gamma == 1.0 else 2.0 * model.rounding(v)
        _, _, changed = improve(model, v, gamma, slack, policy, better)
        # Each policy is better than the last where it took another action; if not, that was rounding.
        if not changed or float((v - before)[:-1].max()) <= slack:
            return v, n_policies
        before[:] = v
        if gamma == 1.0:
            refuse_endless_gain(model, policy, v, better)
