"""Value iteration: each state's value becomes the largest of its pairs', over and over (Bellman 1957).

    v(s) <- max over a of  r(s, a) + gamma * sum over s' of p(s' | s, a) v(s')

Sweeps are in place (Gauss-Seidel), forwards and backwards in turn. From time to time one is done apart from v, which
says how far v is from optimal (Puterman, *Markov Decision Processes*, 2005, sections 6.3.3 and 6.6).
"""

import numpy as np

from tuckerl.solving.bounds import Stopping
from tuckerl.solving.jacobi import apply_and_look
from tuckerl.solving.sweeps import sweep
from tuckerl.types import FloatArray

_AT_ONCE = 30_000_000  # outcomes between two looks at Ctrl-C


def value_iteration(v: FloatArray, stopping: Stopping) -> tuple[FloatArray, int]:
    """Return values close enough to the optimal ones, (S + 1,), and the number of sweeps.

    Parameters
    ----------
    v : (S + 1,) float64
        Where to begin; changed. Without a discount, values of a policy that ends.
    stopping : Stopping
    """
    model, gamma = stopping.model, stopping.gamma
    policy = np.full(model.n_states, -1, dtype=np.int64)
    most = max(1, _AT_ONCE // model.next_state.size)
    n_sweeps, between = 0, 0 if stopping.may_shift else 1
    while True:
        left = between
        while left > 0:
            done, change = sweep(model, v, gamma, policy, n_sweeps, min(left, most))
            n_sweeps, left = n_sweeps + done, left - done if change > 0.0 else 0
        v, n_steps, is_enough = apply_and_look(v, stopping)
        n_sweeps += n_steps
        if is_enough:
            return v, n_sweeps
        between += 1 + between // 4
