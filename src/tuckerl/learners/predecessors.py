"""Which pairs lead to a state, by a model that holds one outcome of each pair: linked lists in arrays of fixed size.

A pair stands in one list at most, that of the state it leads to, and moves to another list at constant cost. Pairs are
numbered s A + a + 1, so that 0 is none. (Moore and Atkeson 1993 keep predecessors for the same end.)
"""

from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import ChangeLog, keep_row
from tuckerl.types import BoolArray, IntArray, StateArray


class Predecessors(NamedTuple):
    """For each state the list of the pairs that lead to it."""

    first: IntArray  # (S,) the first pair of the list
    following: IntArray  # (S, A) the pair that follows each pair in its list
    preceding: IntArray  # (S, A) the pair before it


@kernel
def move(lists: Predecessors, log: ChangeLog, state: int, action: int, left: int, entered: int) -> None:
    """Move a pair from one list to the beginning of another.

    Parameters
    ----------
    lists : Predecessors
    log : ChangeLog
        Where the rows that change are kept.
    state, action : int
        The pair.
    left, entered : int
        The states whose lists it leaves and enters, two different ones; -1 for none.
    """
    n_actions, pair = lists.following.shape[1], state * lists.following.shape[1] + action
    before, after = lists.preceding[state, action] - 1, lists.following[state, action] - 1
    second = lists.first[entered] - 1 if entered >= 0 else -1
    own: Any = np.int64(state)  # states are unsigned, and the tuple is of one type
    for row in (own, left, entered, before // n_actions, after // n_actions, second // n_actions):
        if row >= 0:  # one call of keep_row in a loop: six of them would compile for minutes
            keep_row(log, row)
    if before >= 0:
        lists.following[before // n_actions, before % n_actions] = after + 1
    elif left >= 0:
        lists.first[left] = after + 1
    if after >= 0:
        lists.preceding[after // n_actions, after % n_actions] = before + 1
    if second >= 0:
        lists.preceding[second // n_actions, second % n_actions] = pair + 1
    if entered >= 0:
        lists.first[entered] = pair + 1
    lists.following[state, action], lists.preceding[state, action] = second + 1, 0


def link_all(lists: Predecessors, next_state: StateArray, linked: BoolArray) -> None:
    """Make all lists anew, of the pairs that are `linked`, (S, A), to `next_state`, (S, A)."""
    pairs = np.flatnonzero(linked)
    targets = next_state.ravel()[pairs]
    order = np.argsort(targets, kind="stable")
    pairs, targets = pairs[order], targets[order]
    goes_on = targets[1:] == targets[:-1]  # whether a pair is in the list of the one before it
    for array in lists:
        array[...] = 0
    lists.following.ravel()[pairs[:-1][goes_on]] = pairs[1:][goes_on] + 1
    lists.preceding.ravel()[pairs[1:][goes_on]] = pairs[:-1][goes_on] + 1
    begins = np.concatenate([[True], ~goes_on])[: pairs.size]
    lists.first[targets[begins]] = pairs[begins] + 1


def check_lists(lists: Predecessors, next_state: StateArray, linked: BoolArray) -> None:
    """Refuse lists from a file that are not those of the pairs that are `linked`, (S, A), to `next_state`, (S, A).

    Raises
    ------
    SavedFileError
        If that is so: kernels follow them.
    """
    following, preceding, targets = lists.following.ravel(), lists.preceding.ravel(), next_state.ravel()
    found, pairs = np.zeros(linked.size, dtype=np.bool_), lists.first[lists.first > 0] - 1
    states, before = np.flatnonzero(lists.first), np.zeros(pairs.size, dtype=np.int64)
    while pairs.size:  # the first pairs of all lists, then the second ones, and so on
        is_sound = not found[pairs].any() and np.array_equal(targets[pairs], states)
        if not is_sound or not np.array_equal(preceding[pairs], before):
            break
        found[pairs] = True
        goes_on = following[pairs] > 0
        before, states, pairs = pairs[goes_on] + 1, states[goes_on], following[pairs[goes_on]] - 1
    left_over = following[~linked.ravel()].any() or preceding[~linked.ravel()].any()
    if pairs.size or left_over or not np.array_equal(found, linked.ravel()):
        raise SavedFileError("the predecessors of a model's states must be the pairs that lead to them, each once")
