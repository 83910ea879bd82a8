"""gamma = 1: where an episode ends, where nothing is paid any more, and where the return would grow for ever.

Without a discount the return of an endless episode need not exist. The problem that is solved then is the stochastic
shortest path problem (Bertsekas and Tsitsiklis, "An analysis of stochastic shortest path problems", 1991): the best
among the policies that end with probability 1. States from which nothing is ever paid, whatever is done, count as ends.

A policy that ends is improved until none is better. If the better one no longer ends, then it gains on the average
where it stays for ever: the return has no bound, which is an error.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from tuckerl.errors import ProblemError
from tuckerl.solving.graphs import named, reachable_from
from tuckerl.solving.model import Model, sealed
from tuckerl.solving.sweeps import forbid, spread, write_action_values
from tuckerl.types import BoolArray, FloatArray, IntArray

_ADVICE = "use gamma below 1, or let these states end by terminated=True"


class EndingModel(NamedTuple):
    """A model in which every state that has a value can end, and how."""

    model: Model  # its end stands for states of rest, too; pairs after which the end is not certain may not be taken
    policy: IntArray  # (S,) ends with probability 1; -1 where there is no value
    has_value: BoolArray  # (S,)


def states_of_rest(model: Model, usable: BoolArray) -> BoolArray:
    """Return the states from which usable pairs never pay anything, (S + 1,), the end among them."""
    paid = np.append((model.pays.reshape(usable.shape) & usable).any(axis=1), False)
    spread(model, usable, paid, np.zeros(model.n_states, dtype=np.int64))
    return ~paid


def ending_model(model: Model, starts: IntArray) -> EndingModel:
    """Return a model without the states that never end, which no start may lead to.

    Parameters
    ----------
    model : Model
    starts : (K,) int
        In which episodes may begin.

    Raises
    ------
    ProblemError
        If a start leads to states from which no policy ends: it says which.
    """
    usable = model.allowed_pairs.copy()
    rest = states_of_rest(model, usable)
    next_state = np.where(rest[model.next_state], np.uint32(model.n_states), model.next_state)
    ended = sealed(**model._asdict() | {"next_state": next_state})
    while True:
        reached, policy = rest.copy(), np.full(model.n_states, -1, dtype=np.int64)
        spread(ended, usable, reached, policy)
        stuck = ~reached
        before = int(usable.sum())
        forbid(ended, usable, stuck)
        if int(usable.sum()) == before:
            break
    is_first = rest[:-1] & (policy < 0)
    policy[is_first] = usable[is_first].argmax(axis=1)
    if stuck.any():
        _refuse_stuck(model, stuck[:-1], starts)
    is_whole = not model.allowed.size and not stuck.any()
    return EndingModel(ended if is_whole else sealed(**ended._asdict() | {"allowed": usable}), policy, reached[:-1])


def greedy_that_ends(model: Model, v: FloatArray) -> IntArray:
    """Return a policy that ends and is greedy, up to as little as possible, (S,); -1 where there is no value.

    Among equally good actions some may lead in circles; those are found that do not.

    Parameters
    ----------
    model : Model
        Of an `EndingModel`.
    v : (S + 1,) float64
    """
    q, best = np.empty((model.n_states, model.n_actions)), np.empty(model.n_states)
    write_action_values(model, v, 1.0, q, best, np.empty(model.n_states, dtype=np.int64))
    pairs, slack = model.allowed_pairs, model.rounding(v)
    while True:
        reached, policy = np.zeros(model.n_states + 1, dtype=np.bool_), np.full(model.n_states, -1, dtype=np.int64)
        reached[-1] = True
        spread(model, pairs & (q >= best[:, np.newaxis] - slack), reached, policy)
        if (reached[:-1] == pairs.any(axis=1)).all():
            return policy
        slack *= 4.0


def gain_slack(model: Model, v: FloatArray) -> float:
    """Return up to what a gain may be the rounding of many steps."""
    return 1000.0 * model.rounding(v)


def refuse_endless_gain(model: Model, policy: IntArray, v: FloatArray, better: FloatArray) -> None:
    """Refuse a policy that stays somewhere for ever and gains by it.

    Parameters
    ----------
    model : Model
        Of an `EndingModel`.
    policy : (S,) int
    v, better : (S + 1,) float
        Any function of the states, and what the policy makes of it in one step: nowhere less, but for rounding.

    Raises
    ------
    ProblemError
        If so: as the function is bounded, the mean gain of the states that are visited for ever is the mean reward.
    """
    n = model.n_states
    taken = np.zeros((n, model.n_actions), dtype=np.bool_)
    acts = np.flatnonzero(policy >= 0)
    taken[acts, policy[acts]] = True
    reached = np.zeros(n + 1, dtype=np.bool_)
    reached[n] = True
    spread(model, taken, reached, np.zeros(n, dtype=np.int64))
    endless = np.flatnonzero(~reached[:-1] & (policy >= 0))
    if not endless.size:
        return
    graph = model.transitions()[endless * model.n_actions + policy[endless]][:, endless]
    n_classes, kind = connected_components(graph, connection="strong")
    sources, targets = graph.nonzero()
    is_left = np.zeros(n_classes, dtype=np.bool_)
    is_left[kind[sources][kind[sources] != kind[targets]]] = True
    gaining = ~is_left[kind] & ((better - v)[endless] > gain_slack(model, v))
    if gaining.any():
        states = endless[kind == kind[gaining.argmax()]]
        raise ProblemError(
            f"with gamma=1 the return has no bound: a policy can stay in {named(states)} for ever, and gain: {_ADVICE}"
        )


def _refuse_stuck(model: Model, stuck: BoolArray, starts: IntArray) -> None:
    """Refuse states that never end if a start leads to them; others, such as walls of a maze, have no value."""
    visited = np.flatnonzero(stuck & reachable(model, starts))
    if visited.size:
        raise ProblemError(
            f"with gamma=1 every state that can be visited must be able to end: from {named(visited)} no policy ends "
            f"with probability 1, so the return is not finite: {_ADVICE}"
        )


def reachable(model: Model, starts: IntArray) -> BoolArray:
    """Return the states that a start leads to, (S,)."""
    n, usable = model.n_states, model.allowed_pairs.reshape(-1)
    first = np.zeros(n, dtype=np.bool_)
    first[starts] = True
    pairs = model.transitions()[usable][:, :n]
    counts = np.concatenate([[0], np.cumsum(usable)])[:: model.n_actions]
    return reachable_from(csr_array((pairs.data, pairs.indices, pairs.indptr[counts]), shape=(n, n)), first)
