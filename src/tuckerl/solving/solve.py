"""``solve``: the optimal values of a known problem, by one of four methods, with a proven bound on their error."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_name, check_real
from tuckerl.registers import load
from tuckerl.solving.bounds import Stopping, certified, lowest_values
from tuckerl.solving.model import Model, check_range, known_table, model_of
from tuckerl.solving.policy_value import chain_of, solved, weights_of
from tuckerl.solving.sweeps import improve, write_action_values
from tuckerl.solving.undiscounted import ending_model, greedy_that_ends
from tuckerl.types import BoolArray, FloatArray, IntArray

Method = Callable[[FloatArray, Stopping], tuple[FloatArray, int]]

METHODS = {
    "value-iteration": "tuckerl.solving.value_iteration:value_iteration",
    "policy-iteration": "tuckerl.solving.policy_iteration:policy_iteration",
    "modified-policy-iteration": "tuckerl.solving.modified_policy_iteration:modified_policy_iteration",
    "linear-programming": "tuckerl.solving.linear_programming:linear_programming",
}
"""The methods by name: each is a function of values to begin with and of when to stop, which knows the model."""


class Solution(NamedTuple):
    """The optimal values of a problem with S states and A actions.

    `v` is the largest of each row of `q`, and `policy` the first action that has it. Without a discount, `policy` is
    one that ends, and states that never end and that no start leads to have NaN.
    """

    q: FloatArray  # (S, A); minus infinity where an action may not be taken
    v: FloatArray  # (S,)
    policy: IntArray  # (S,)
    iterations: int  # sweeps, policies, or steps of the simplex method, as the method counts them
    bound: float  # v, and q where it is finite, are no farther from the optimal values

    def __repr__(self) -> str:
        """Say how good it is; the arrays would fill the screen."""
        return f"Solution({len(self.v)} states, iterations={self.iterations}, bound={self.bound:.2g})"


def solve(env: Environment, gamma: float = 0.95, method: str = "value-iteration", tol: float = 1e-8) -> Solution:
    """Return the optimal values of a problem whose transitions are known, and an optimal policy.

    A time limit is no end of the return, as for learners: the discounted problem without it is solved. An outcome that
    terminates is followed by nothing. The values are those of

        q(s, a) = r(s, a) + gamma * sum over s' of p(s' | s, a) max over a' of q(s', a').

    Parameters
    ----------
    env
        A :class:`~tuckerl.TabularMDP`, a :class:`~tuckerl.Maze`, or an environment whose transition table is known, as
        learners take it: by id, as an instance, or as a callable. Of a PettingZoo environment, the joint problem.
    gamma : float
        The discount, from 0 to 1. With 1, the best among the policies that end with probability 1 is looked for;
        states from which nothing is paid any more count as ends.
    method : str
        ``"value-iteration"``, ``"policy-iteration"``, ``"modified-policy-iteration"`` or ``"linear-programming"``.
    tol : float
        How far the values may be from the optimal ones. Where large values and a discount near 1 do not let floats
        tell, `bound` is larger.

    Returns
    -------
    Solution
        ``q`` (S, A), ``v`` (S,), ``policy`` (S,), ``iterations``, and ``bound``: how far ``v`` is from the optimal
        values at most, rounding included. With a discount it is Puterman's (2005, section 6.6.2). Without one it is
        proven afterwards, and infinite where that fails, as it does with cycles that cost nothing.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If `gamma`, `method` or `tol` is impossible.
    ProblemError
        If the transitions are not known (`NoTableError`) or do not fit into memory (`TableSizeError`); or gamma is 1,
        and states that can be visited never end, or the return has no bound: it says which states.
    SolverError
        If a linear programme fails.

    Examples
    --------
    >>> import tuckerl
    >>> solution = solve("FrozenLake-v1", gamma=0.99)
    >>> float(solution.v[0].round(3)), solution.policy[:4].tolist(), solution.bound <= 1e-8
    (0.542, [0, 3, 3, 3], True)
    """
    gamma = check_real("gamma", gamma, 0.0, 1.0)
    tol = check_real("tol", tol, 0.0, low_open=True)
    find: Method = load(METHODS[check_name("method", method, METHODS)])
    mdp = known_table(env)
    model = model_of(mdp)
    check_range(model, gamma)
    if gamma == 1.0:
        return _without_discount(model, mdp.arrays.start_state.astype(np.int64), find, tol)
    stopping = Stopping(model, gamma, tol)
    found, iterations = find(lowest_values(model, gamma), stopping)
    v, policy = np.empty_like(found), np.full(model.n_states, -1, dtype=np.int64)
    low, high, _ = improve(model, found, gamma, 0.0, policy, v)
    v[:-1] += stopping.centre(low, high)
    q, best = np.empty((model.n_states, model.n_actions)), np.empty(model.n_states)
    write_action_values(model, v, gamma, q, best, policy)
    return Solution(q, best, policy, iterations, stopping.bound(low, high, found))


def _without_discount(model: Model, starts: IntArray, find: Method, tol: float) -> Solution:
    """Return the best values of policies that end: what a method finds, then proven; again closer where that fails."""
    ending = ending_model(model, starts)
    inner, v, iterations, left = ending.model, np.zeros(model.n_states + 1), 0, tol
    v[:-1], _, _ = _evaluated(inner, ending.policy)
    while True:
        v, done = find(v, Stopping(inner, 1.0, left))
        iterations += done
        policy = greedy_that_ends(inner, v)
        values, steps, residual = np.zeros_like(v), np.zeros_like(v), 0.0
        values[:-1], steps[:-1], residual = _evaluated(inner, policy)
        bound = certified(inner, values, residual, steps)
        if bound <= tol or left <= inner.rounding(v):
            break
        v, left = np.maximum(v, values), left / 1000.0
    return _with_gaps(model, inner, ending.has_value, values, policy, iterations, bound)


def _evaluated(model: Model, policy: IntArray) -> tuple[FloatArray, FloatArray, float]:
    """Return a policy's values, its expected steps to the end, and by how much its equation moves the values."""
    chain = chain_of(model, weights_of(policy, model.n_actions))
    right = np.stack([chain.reward, (policy >= 0).astype(np.float64)], axis=1)
    values, steps = solved(chain.transition, right, 1.0).T
    residual = np.abs(chain.reward + chain.transition @ values - values).max()
    return values, steps, float(residual)


def _with_gaps(
    model: Model,
    inner: Model,
    has_value: BoolArray,
    v: FloatArray,
    policy: IntArray,
    iterations: int,
    bound: float,
) -> Solution:
    """Return the solution with NaN where there is no value, and minus infinity where an action may not be taken."""
    q, best = np.empty((model.n_states, model.n_actions)), np.empty(model.n_states)
    write_action_values(inner, v, 1.0, q, best, np.empty(model.n_states, dtype=np.int64))
    best = np.where(has_value, best, np.nan)
    q[model.allowed_pairs & ~inner.allowed_pairs] = np.nan
    first = model.allowed_pairs.argmax(axis=1)
    return Solution(q, best, np.where(policy >= 0, policy, first), iterations, bound)
