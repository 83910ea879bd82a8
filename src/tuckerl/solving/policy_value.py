"""The values of a policy: the solution of V = r + gamma P V, by SciPy's solvers.

Source: Sutton and Barto, *Reinforcement Learning*, 2018, section 4.1; Puterman, *Markov Decision Processes*, 2005,
section 6.1.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import bicgstab, splu

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.problems.parts import as_array, as_numbers
from tuckerl.solving.graphs import named, reachable_from
from tuckerl.solving.model import Model, check_range, known_table, model_of
from tuckerl.types import BoolArray, FloatArray, IntArray

_TOLERANCE = 1e-8  # of probabilities' sums
_FEW = 2  # entries a row, with which a factorisation stays sparse: of a policy whose steps are certain
_MOST_DENSE = 3_000  # states whose full matrix is factorised fast
_SMALL = 100  # states for which nothing is worth thinking about


def policy_value(env: Environment, policy: ArrayLike, gamma: float = 0.95) -> FloatArray:
    """Return the value of each state under a policy: its expected discounted return, exactly.

    A time limit is no end of the return and is left out.

    Parameters
    ----------
    env
        A :class:`~tuckerl.TabularMDP` or an environment whose transition table is known; see :func:`tuckerl.solve`.
    policy : (S,) int or (S, A) float
        The action in each state, or the probability of each action in each state.
    gamma : float
        From 0 to 1. With 1, the policy must end with probability 1 from wherever it can come to, or be paid nothing
        from some time on; states that it does not come to and does not end from have the value NaN.

    Returns
    -------
    (S,) float64

    Raises
    ------
    ParameterError, ParameterTypeError
        If `policy` has another shape, is no distribution, or takes an action that may not be taken.
    ProblemError
        If the transitions are not known (`NoTableError`), or gamma is 1 and the policy does not end: it says where.

    Examples
    --------
    >>> import tuckerl
    >>> maze = tuckerl.sutton_maze()
    >>> up = [0] * maze.n_states
    >>> tuckerl.policy_value(maze, up, gamma=0.9)[[17, 26]]  # below the goal, and two below
    array([ 0., -1.])
    """
    gamma = check_real("gamma", gamma, 0.0, 1.0)
    mdp = known_table(env)
    model = model_of(mdp)
    check_range(model, gamma)
    chain = chain_of(model, check_policy(policy, model))
    if gamma < 1.0:
        return solved(chain.transition, chain.reward, gamma)
    return _undiscounted(chain, mdp.arrays.start_state)


class Chain(NamedTuple):
    """The Markov chain that a policy makes of a model."""

    transition: csr_array  # (S, S) without the end
    reward: FloatArray  # (S,) expected
    pays: BoolArray  # (S,) whether something other than 0 may be paid
    ends: BoolArray  # (S,) whether the next step may end


def chain_of(model: Model, weights: csr_array) -> Chain:
    """Return the chain of a policy.

    Parameters
    ----------
    model : Model
    weights : (S, S * A) sparse
        The probability of each pair in each state.
    """
    transition = (weights @ model.transitions()).tocsr()
    ends = transition[:, [model.n_states]].toarray()[:, 0] > 0
    pays = weights @ model.pays.astype(np.float64) > 0
    return Chain(transition[:, : model.n_states].tocsr(), weights @ model.reward, pays, ends)


def weights_of(actions: IntArray, n_actions: int) -> csr_array:
    """Return a deterministic policy as the probability of each pair in each state, (S, S * A) sparse.

    Parameters
    ----------
    actions : (S,) int
        -1 where none is taken.
    n_actions : int
    """
    n, acts = actions.size, actions >= 0
    columns = np.arange(n)[acts] * n_actions + actions[acts]
    parts = np.ones(columns.size), columns, np.concatenate([[0], np.cumsum(acts)])
    return csr_array(parts, shape=(n, n * n_actions))


def policy_values(model: Model, policy: IntArray, gamma: float) -> FloatArray:
    """Return the values of a deterministic policy, (S,); 0 where it takes no action.

    Parameters
    ----------
    model : Model
    policy : (S,) int
        -1 where no action is taken. Without a discount, it ends.
    gamma : float
    """
    n, acts = model.n_states, policy >= 0
    pairs = np.flatnonzero(acts) * model.n_actions + policy[acts]
    first, counts = pairs, acts.astype(np.int64)
    if model.offsets.size:
        first = model.offsets[pairs]
        counts[acts] = model.offsets[pairs + 1] - first
    indptr = np.concatenate([[0], np.cumsum(counts), [counts.sum()]])  # the end is one more row, without entries
    taken = np.arange(indptr[-1]) + np.repeat(first - indptr[:-2][acts], counts[acts])
    probability = model.probability[taken] if model.offsets.size else np.ones(taken.size)
    parts = probability, model.next_state[taken].astype(np.int64), indptr
    right = np.zeros(n + 1)
    right[:-1][acts] = model.reward[pairs]
    return solved(csr_array(parts, shape=(n + 1, n + 1)), right, gamma)[:-1]


def solved(transition: csr_array, right: FloatArray, gamma: float) -> FloatArray:
    """Return x of ``x = right + gamma transition x``, (S,) or (S, K) as `right`.

    A matrix with few entries is factorised by SuperLU, a small one by LAPACK. For others BiCGSTAB is tried first, which
    is fast where states mix, and does not fill memory where they are many.
    """
    n, n_entries = transition.shape[0], transition.nnz
    system = eye_array(n, format="csr") - gamma * transition
    if n > _SMALL and n_entries > _FEW * n:
        found = [_iterated(system, column) for column in np.atleast_2d(right.T)]
        if all(column is not None for column in found):
            return np.reshape(np.stack(found, axis=-1), right.shape)  # type: ignore[arg-type]  # none is None
    if n <= _SMALL or (n <= _MOST_DENSE and n_entries > 2 * _FEW * n):
        dense: FloatArray = np.linalg.solve(system.toarray(), right)
        return dense
    system = system.tocsc()
    factors = splu(system)
    x: FloatArray = factors.solve(right)
    return x + factors.solve(right - system @ x)  # one step of refinement


def _iterated(system: Any, right: FloatArray) -> FloatArray | None:
    x, failed = bicgstab(system, right, rtol=1e-14, atol=0.0, maxiter=300 if right.size <= _MOST_DENSE else 5000)
    return None if failed else x


def _undiscounted(chain: Chain, starts: Any) -> FloatArray:
    """Return the values without a discount, NaN where there are none.

    Raises
    ------
    ProblemError
        If the policy comes to a state from which it does not end, and is paid for ever.
    """
    backwards = chain.transition.T.tocsr()
    rest = ~reachable_from(backwards, chain.pays)
    ending = reachable_from(backwards, chain.ends | rest)
    valueless = reachable_from(backwards, ~ending)
    begins = np.zeros(rest.size, dtype=np.bool_)
    begins[starts] = True
    visited = np.flatnonzero(reachable_from(chain.transition, begins) & ~ending)
    if visited.size:
        raise ProblemError(
            f"with gamma=1 the policy must end with probability 1: in {named(visited)} it goes on for ever and is "
            "paid, so the return is not finite: use gamma below 1, or another policy"
        )
    v = np.where(valueless, np.nan, 0.0)
    inner = np.flatnonzero(~valueless & ~rest)
    v[inner] = solved(chain.transition[inner][:, inner], chain.reward[inner], 1.0)
    return v


def check_policy(policy: ArrayLike, model: Model) -> csr_array:
    """Return a policy as the probability of each pair in each state, (S, S * A) sparse.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is none of this model.
    """
    n, n_actions = model.n_states, model.n_actions
    expected = f"policy must be {n} actions, one for each state, or probabilities of shape ({n}, {n_actions})"
    try:
        given = as_array("policy", policy)
    except ProblemError as error:
        raise ParameterError(f"{expected}: {error}") from error
    if given.shape == (n,):
        weights = weights_of(_check_actions(given, n_actions, expected), n_actions)
    elif given.shape == (n, n_actions):
        rows = _check_distributions(as_numbers("policy", given))
        offsets = np.concatenate([[0], np.cumsum(np.count_nonzero(rows, axis=1))])
        weights = csr_array((rows[rows > 0], np.flatnonzero(rows), offsets), shape=(n, n * n_actions))
    else:
        raise ParameterError(f"{expected}; got an array of shape {given.shape}")
    pairs = weights.indices[~model.allowed.reshape(-1)[weights.indices]] if model.allowed.size else weights.indices[:0]
    if pairs.size:
        state, action = divmod(int(pairs[0]), n_actions)
        raise ParameterError(
            f"policy must take actions that may be taken; the action mask forbids action {action} in state {state}"
        )
    return weights


def _check_actions(given: Any, n_actions: int, expected: str) -> IntArray:
    if given.dtype.kind not in "iu":
        raise ParameterTypeError(f"{expected}; got {given.size} numbers of dtype {given.dtype}")
    wrong = np.flatnonzero((given < 0) | (given >= n_actions))
    if wrong.size:
        raise ParameterError(
            f"policy must hold actions from 0 to {n_actions - 1}; got {given[wrong[0]]} in state {wrong[0]}"
        )
    return given.astype(np.int64)


def _check_distributions(rows: FloatArray) -> FloatArray:
    """Return probabilities, (S, A), that sum to 1."""
    with np.errstate(all="ignore"):
        sums = rows.sum(axis=1, keepdims=True)
        right = (rows >= 0).all(axis=1) & (np.abs(sums[:, 0] - 1) <= _TOLERANCE)
    if not right.all():
        state = int(np.flatnonzero(~right)[0])
        raise ParameterError(
            f"policy must be probabilities of at least 0 that sum to 1 in each state; those of state {state} are "
            f"{rows[state]}: divide them by their sum"
        )
    normalised: FloatArray = rows / sums
    return normalised
