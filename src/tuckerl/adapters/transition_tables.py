"""Extracts the transition table that an environment carries: the finite MDP that it plays, exactly.

Gymnasium's toy-text environments keep a table ``P``, ``P[s][a]`` being a list of outcomes ``(probability, next state,
reward, terminated)``, and the distribution of first states, ``initial_state_distrib``. A step draws one number u and
takes the first outcome whose summed probability is above u. The kernels do the same, so outcomes stay in their order,
and the same u leads to the same outcome. Only a pair whose outcomes are all alike is reduced to one, which is certain
and needs no draw. (Where rounding leaves the last sum below 1, by 1e-8 at most, a u above it takes the first outcome in
Gymnasium and the last in the kernels.)
"""

import inspect
import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.envs.toy_text import CliffWalkingEnv, FrozenLakeEnv, TaxiEnv
from gymnasium.spaces import Discrete

from tuckerl.adapters.action_names import action_names_of
from tuckerl.checks import refuse_mask, shown
from tuckerl.errors import ProblemError, TuckerlError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.outcomes import normalised, sum_tolerance
from tuckerl.problems.parts import Layout, as_array
from tuckerl.types import BoolArray, FloatArray

TOY_TEXT = (CliffWalkingEnv, FrozenLakeEnv, TaxiEnv)
"""Gymnasium's environments whose own steps look everything up in their table."""

_MOST_LIKELY = 1.001  # a certain outcome may exceed 1 by rounding; how far sums may is told by their type
_OTHERWISE = "correct it, or learn with compiled=False, which steps the environment itself"


class _Outcome(NamedTuple):
    probability: float
    next_state: int
    reward: float
    terminated: bool


class _Table(NamedTuple):
    """What an environment says of its transitions, unread."""

    env: gymnasium.Env[Any, Any]
    pairs: Any  # [s][a]
    starts: Any  # [s]
    n_states: int
    n_actions: int


def extract_transition_table(env: gymnasium.Env[Any, Any]) -> TabularMDP | None:
    """Return the MDP that an environment plays by its table, or None where it has no table or more than that decides.

    Parameters
    ----------
    env : gymnasium.Env
        Without wrappers. It carries ``P``, by dictionaries or sequences, and ``initial_state_distrib``, an (S,) array;
        its spaces are ``Discrete(S)`` and ``Discrete(A)``, from 0. Where it has a method ``action_mask(state)``, the
        mask is taken over. `FrozenLake` and `CliffWalking` have their grid as layout.

    Returns
    -------
    TabularMDP or None
        Without a time limit: that is a wrapper's. None where something of the above is missing, where ``P`` has more
        states or actions than the spaces, where the mask cannot be asked for by state, where ``step`` or ``reset`` of
        one of Gymnasium's classes was overridden or that of this instance replaced, and for a taxi with a fickle
        passenger, who remembers more than the state.

    Raises
    ------
    ProblemError
        If ``P`` lacks a pair, holds something else than outcomes, or an outcome, distribution or mask is impossible;
        it names the pair (s, a).

    Examples
    --------
    >>> extract_transition_table(gymnasium.make("FrozenLake-v1").unwrapped)
    TabularMDP(16 states, 4 actions, 152 outcomes, max_episode_steps=None)
    """
    table = _table(env)
    if table is None or _hides_something(env):
        return None
    next_state, reward, terminated, probability = _arrays(table)
    return TabularMDP(
        next_state,
        reward,
        terminated,
        probability,
        start=_starts(table),
        action_mask=_action_mask(table),
        layout=_layout(env, table.n_states),
        action_names=action_names_of(env, (table.n_actions,)),
    )


def _table(env: gymnasium.Env[Any, Any]) -> _Table | None:
    """Return the table if there is one whose states are the observations and whose actions are the space's."""
    pairs, starts = getattr(env, "P", None), getattr(env, "initial_state_distrib", None)
    n_states, n_actions = _size(env, "observation_space"), _size(env, "action_space")
    if pairs is None or starts is None or n_states is None or n_actions is None:
        return None
    if _length(pairs) > n_states or any(_length(_entry(pairs, s)) > n_actions for s in range(n_states)):
        return None
    table = _Table(env, pairs, starts, n_states, n_actions)
    return None if _is_of_another_kind(table) else table


def _is_of_another_kind(table: _Table) -> bool:
    """Return whether what is called P says something, but nowhere by outcomes of four parts."""
    pairs = ((s, a) for s in range(table.n_states) for a in range(table.n_actions))
    entries = [entry for s, a in pairs if (entry := _entry(_entry(table.pairs, s), a)) is not None]
    listed = [entry for entry in entries if isinstance(entry, (list, tuple, np.ndarray))]
    has_outcomes = any(isinstance(one, (tuple, list)) and len(one) == 4 for entry in listed for one in entry)
    return bool(entries) and not has_outcomes


def _size(env: gymnasium.Env[Any, Any], name: str) -> int | None:
    space = getattr(env, name, None)
    return int(space.n) if isinstance(space, Discrete) and space.start == 0 else None


def _length(entries: Any) -> int:
    return len(entries) if isinstance(entries, (Mapping, list, tuple, np.ndarray)) else 0


def _entry(entries: Any, key: int) -> Any:
    """Return an entry, or None without one; a `defaultdict` must not grow by being asked."""
    if isinstance(entries, Mapping):
        return entries.get(key)
    return entries[key] if key < _length(entries) else None


def _hides_something(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether the environment may do something that its table does not tell."""
    own = getattr(env, "__dict__", {})
    if "step" in own or "reset" in own or getattr(env, "fickle_passenger", False):
        return True
    for kind in TOY_TEXT:
        if isinstance(env, kind) and (type(env).step is not kind.step or type(env).reset is not kind.reset):
            return True
    mask = getattr(env, "action_mask", None)
    return callable(mask) and not _takes_a_state(mask)


def _takes_a_state(function: Any) -> bool:
    try:
        inspect.signature(function).bind(0)
    except (TypeError, ValueError):
        return False
    return True


def _arrays(table: _Table) -> tuple[Any, FloatArray, BoolArray, FloatArray]:
    """Return next states, rewards, ends and probabilities, (S, A, K); pairs with fewer outcomes are filled up."""
    pairs = [_outcomes(table, s, a) for s in range(table.n_states) for a in range(table.n_actions)]
    counts = np.array([len(outcomes) for outcomes in pairs])
    shape = (len(pairs), int(counts.max()))
    filled = np.arange(shape[1]) < counts[:, np.newaxis]
    columns = zip(*(outcome for outcomes in pairs for outcome in outcomes), strict=True)
    arrays: list[Any] = [np.zeros(shape, dtype) for dtype in (np.float64, np.int64, np.float64, np.bool_)]
    for array, values in zip(arrays, columns, strict=True):
        array[filled] = values
    whole = (table.n_states, table.n_actions, -1)
    probability, next_state, reward, terminated = (array.reshape(whole) for array in arrays)
    return next_state, reward, terminated, probability


def _outcomes(table: _Table, state: int, action: int) -> list[_Outcome]:
    """Return the possible outcomes of a pair in their order; one, of probability 1, where they are all alike."""
    listed = _entry(_entry(table.pairs, state), action)
    if not isinstance(listed, (list, tuple, np.ndarray)) or len(listed) == 0:
        got = "nothing" if listed is None else repr(listed)
        raise _malformed(table, state, action, f"must be a list; got {got}")
    outcomes = [_outcome(table, state, action, outcome) for outcome in listed]
    total = math.fsum(outcome.probability for outcome in outcomes)
    dtypes = {outcome[0].dtype for outcome in listed if isinstance(outcome[0], np.floating)}
    roughest = min(dtypes, key=lambda dtype: dtype.itemsize, default=np.dtype(np.float64))
    if abs(total - 1) > sum_tolerance(roughest, len(outcomes)):
        raise _malformed(table, state, action, f"must have probabilities that sum to 1; theirs sum to {total!r}")
    if roughest.itemsize < 8:
        outcomes = [outcome._replace(probability=outcome.probability / total) for outcome in outcomes]
    possible = [outcome for outcome in outcomes if outcome.probability > 0]
    if len({outcome[1:] for outcome in possible}) == 1:
        return [possible[0]._replace(probability=1.0)]
    return possible


def _outcome(table: _Table, state: int, action: int, outcome: Any) -> _Outcome:
    if not isinstance(outcome, (tuple, list)) or len(outcome) != 4:
        expected = "must be tuples (probability, next state, reward, terminated)"
        raise _malformed(table, state, action, f"{expected}; got {shown(outcome)}")
    probability, next_state, reward, terminated = outcome
    if not isinstance(probability, Real) or not 0 <= float(probability) <= _MOST_LIKELY:
        raise _malformed(table, state, action, f"must have probabilities from 0 to 1; got {shown(probability)}")
    states = range(table.n_states)
    if probability == 0:  # what never happens may be anything
        return _Outcome(0.0, 0, 0.0, False)
    if isinstance(next_state, bool) or not isinstance(next_state, Integral) or int(next_state) not in states:
        expected = f"must lead to states from 0 to {table.n_states - 1}"
        raise _malformed(table, state, action, f"{expected}; got {shown(next_state)}")
    if not isinstance(reward, Real) or not math.isfinite(reward):
        raise _malformed(table, state, action, f"must pay finite rewards; got {shown(reward)}")
    if not isinstance(terminated, (bool, np.bool_, Integral)) or terminated not in (0, 1):
        raise _malformed(
            table, state, action, f"must say by True or False whether they terminate; got {shown(terminated)}"
        )
    return _Outcome(float(probability), int(next_state), float(reward), bool(terminated))


def _malformed(table: _Table, state: int, action: int, what: str) -> ProblemError:
    return ProblemError(f"the outcomes of (s, a) = ({state}, {action}) in P of {table.env} {what}: {_OTHERWISE}")


def _starts(table: _Table) -> FloatArray:
    """Return the probability of each state to be the first."""
    expected = f"initial_state_distrib of {table.env} must be {table.n_states} probabilities, one for each state"
    try:
        starts = as_array("initial_state_distrib", table.starts)
        if starts.shape == (table.n_states,):
            return normalised("initial_state_distrib", starts, "they")
    except TuckerlError as error:
        raise ProblemError(f"{expected}: {error}; {_OTHERWISE}") from error
    raise ProblemError(f"{expected}; got an array of shape {starts.shape}: {_OTHERWISE}")


def _action_mask(table: _Table) -> BoolArray | None:
    """Return where actions may be taken, as the environment says state by state; None where it has no masks."""
    ask = getattr(table.env, "action_mask", None)
    if not callable(ask):
        return None
    masks = np.empty((table.n_states, table.n_actions), dtype=np.bool_)
    for state in range(table.n_states):
        given = ask(state)
        refuse_mask("action_mask", given)
        mask = np.asarray(given)
        if mask.shape != (table.n_actions,) or mask.dtype.kind not in "biu" or not np.isin(mask, (0, 1)).all():
            raise ProblemError(
                f"action_mask({state}) of {table.env} must be {table.n_actions} numbers, 1 for an action that may be "
                f"taken and 0 for another; got {shown(mask)}: {_OTHERWISE}"
            )
        masks[state] = mask
    return masks


def _layout(env: gymnasium.Env[Any, Any], n_states: int) -> Layout | None:
    """Return the grid whose cells are the states, if they are."""
    shape: tuple[int, ...] = ()
    if isinstance(env, FrozenLakeEnv):
        shape = np.shape(env.desc)
    elif isinstance(env, CliffWalkingEnv):
        shape = env.shape
    return (shape[0], shape[1]) if len(shape) == 2 and shape[0] * shape[1] == n_states else None
