"""Linear programming: the optimal values are the smallest that no pair exceeds (d'Epenoux 1963).

    minimise  sum over s of v(s)   subject to   v(s) >= r(s, a) + gamma * sum over s' of p(s' | s, a) v(s')

Source: Puterman, *Markov Decision Processes*, 2005, section 6.9. The programme is solved by SciPy's HiGHS; what it
finds is a policy, whose values are then computed by policy iteration, as HiGHS works with a tolerance.
"""

from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, eye_array, kron

from tuckerl.errors import SolverError
from tuckerl.memory import Part, check_memory
from tuckerl.solving.bounds import Stopping
from tuckerl.solving.policy_iteration import policy_iteration
from tuckerl.types import FloatArray

_BYTES = 1000  # that HiGHS and SciPy take for each entry of the constraints: 820 and 880 were measured
_INFEASIBLE = 2  # a status of linprog
_INSTEAD = "use method='value-iteration', which needs no programme"


def linear_programming(v: FloatArray, stopping: Stopping) -> tuple[FloatArray, int]:
    """Return the optimal values, (S + 1,), and the number of HiGHS' iterations.

    Parameters
    ----------
    v : (S + 1,) float64
        Where there is no value, it stays; the others are not read, but changed.
    stopping : Stopping

    Raises
    ------
    TableSizeError
        If the programme would not fit into memory.
    SolverError
        If HiGHS fails.
    ProblemError
        If there is no discount, and the return has no bound.
    """
    model, gamma = stopping.model, stopping.gamma
    n, pairs = model.n_states, model.allowed_pairs
    entries = model.next_state.size + pairs.size
    check_memory("the linear programme", [Part("constraints", _BYTES * entries, _INSTEAD)])
    rows = np.flatnonzero(pairs)
    own = kron(eye_array(n), np.ones((model.n_actions, 1)), format="csr")
    constraints: csr_array = (gamma * model.transitions()[:, :n] - own)[rows]
    size = max(model.largest_reward, 1e-300)  # HiGHS' tolerances are absolute
    costs = np.where(pairs.any(axis=1), 1.0, 0.0)
    solver: Any = linprog  # its annotations know no sparse arrays
    result = solver(costs, constraints, -model.reward[rows] / size, bounds=(None, None), method="highs")
    if result.status == _INFEASIBLE and gamma == 1.0:
        policy_iteration(v, stopping)  # which says for which states the return has no bound
    if result.status != 0:
        raise SolverError(f"the linear programme of {n} states was not solved ({result.message}): {_INSTEAD}")
    v[:-1] = np.where(pairs.any(axis=1), result.x * size, v[:-1])
    v, _ = policy_iteration(v, stopping)
    return v, int(result.nit)
