"""The queue of prioritized sweeping against a sorted list, and the lists of predecessors against a dict."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import empty_log
from tuckerl.learners.predecessors import Predecessors, check_lists, link_all, move
from tuckerl.learners.priority_queue import PriorityQueue, empty_queue, insert, take_first
from tuckerl.saved_arrays import SavedArrays

N_STATES, N_ACTIONS = 5, 3
PAIRS = st.integers(0, N_STATES * N_ACTIONS - 1)
ACTS = st.lists(st.none() | st.tuples(PAIRS, st.sampled_from([0.0, 0.5, 1.0, 1.5, 2.0, np.inf])), max_size=60)


@settings(deadline=None, max_examples=100)
@given(acts=ACTS)
def test_the_first_is_always_the_one_of_the_highest_priority(acts: list[tuple[int, float] | None]) -> None:
    queue, held = empty_queue(N_STATES, N_ACTIONS), dict[int, float]()
    for act in acts:
        if act is not None:
            insert(queue, *act)
            held[act[0]] = max(act[1], held.get(act[0], 0.0))
        elif held:
            first = min(held, key=lambda pair: (-held[pair], pair))
            assert take_first(queue) == first
            del held[first]
        entries = queue.to_arrays()
        assert dict(zip(entries["pair"].tolist(), entries["priority"].tolist(), strict=True)) == held
        assert np.count_nonzero(queue.place) == len(held)
        again = empty_queue(N_STATES, N_ACTIONS)
        insert(again, 1, 9.0)  # what was there is forgotten
        again.set_arrays(SavedArrays.of(entries))
        np.testing.assert_array_equal(again.place, queue.place)
    drained = [take_first(queue) for _ in range(queue.size[0])]
    assert drained == sorted(held, key=lambda pair: (-held[pair], pair))


@pytest.mark.parametrize(
    ("pairs", "priorities", "message"),
    [
        ([15], [1.0], "pair must be at least 0 and at most 14"),
        ([-1], [1.0], "pair must be at least 0"),
        ([1, 1], [1.0, 1.0], "the pairs of a queue must hold each number once"),
        ([1, 2], [1.0, 2.0], "priorities of a queue must be numbers that fall from each place"),
        ([2, 1], [1.0, 1.0], "priorities of a queue must be numbers that fall from each place"),
        ([1, 2, 3], [3.0, 1.0, np.nan], "priorities of a queue must be numbers that fall"),
        ([1], [-1.0], "priorities of a queue must be numbers that fall"),
        ([1, 2], [1.0], "priority must be float64 of the shape"),
        (list(range(16)), [1.0] * 16, "pair must be int64 of the shape"),
    ],
)
def test_a_file_that_holds_no_queue_is_refused(pairs: list[int], priorities: list[float], message: str) -> None:
    queue = empty_queue(N_STATES, N_ACTIONS)
    arrays = {"pair": np.array(pairs, dtype=np.int64), "priority": np.array(priorities)}
    with pytest.raises(SavedFileError, match=message):
        queue.set_arrays(SavedArrays.of(arrays))


@pytest.mark.compiled
@pytest.mark.parametrize("n", [10**2, 10**4])
def test_the_work_grows_with_the_logarithm(n: int) -> None:
    # Not the time but the depth: an entry that goes to the end or to the beginning passes log2(n) places.
    queue = PriorityQueue(*empty_queue(n, 1))
    for pair in range(n):
        insert(queue, pair, float(n - pair))
    before = queue.entry["pair"][:n].copy()
    insert(queue, n - 1, 2.0 * n)
    assert np.count_nonzero(queue.entry["pair"][:n] != before) <= np.log2(n) + 1
    before = queue.entry["pair"][: n - 1].copy()
    take_first(queue)
    assert np.count_nonzero(queue.entry["pair"][: n - 1] != before) <= np.log2(n) + 1


STATES = st.integers(0, N_STATES - 1)


def empty_lists() -> Predecessors:
    shape = (N_STATES, N_ACTIONS)
    return Predecessors(np.zeros(N_STATES, np.int64), np.zeros(shape, np.int64), np.zeros(shape, np.int64))


def members(lists: Predecessors, state: int) -> list[int]:
    found, pair = [], lists.first[state] - 1
    while pair >= 0:
        found.append(int(pair))
        pair = lists.following.ravel()[pair] - 1
    return found


@settings(deadline=None, max_examples=100)
@given(moves=st.lists(st.tuples(PAIRS, st.integers(-1, N_STATES - 1)), max_size=40))
def test_each_state_knows_its_predecessors(moves: list[tuple[int, int]]) -> None:
    lists, log, leads = empty_lists(), empty_log(N_STATES, N_ACTIONS, 0), dict[int, int]()
    for pair, target in moves:
        if leads.get(pair, -1) != target:
            move(lists, log, pair // N_ACTIONS, pair % N_ACTIONS, leads.get(pair, -1), target)
            leads[pair] = target
        for state in range(N_STATES):
            assert sorted(members(lists, state)) == sorted(p for p, led in leads.items() if led == state)
    next_state = np.zeros((N_STATES, N_ACTIONS), dtype=np.uint32)
    linked = np.zeros((N_STATES, N_ACTIONS), dtype=np.bool_)
    for pair, target in leads.items():
        if target >= 0:
            next_state.ravel()[pair], linked.ravel()[pair] = target, True
    check_lists(lists, next_state, linked)
    anew = empty_lists()
    link_all(anew, next_state, linked)
    check_lists(anew, next_state, linked)
    for state in range(N_STATES):
        assert sorted(members(anew, state)) == sorted(members(lists, state))


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("place", range(15))
def test_lists_of_a_file_that_lie_anywhere_are_refused(number: int, place: int) -> None:
    rng = np.random.default_rng(place)
    next_state, linked = rng.integers(N_STATES, size=(5, 3)).astype(np.uint32), rng.random((5, 3)) < 0.7
    lists = empty_lists()
    link_all(lists, next_state, linked)
    check_lists(lists, next_state, linked)
    array = lists[number].ravel()
    place %= array.size
    for wrong in set(range(16)) - {int(array[place])}:
        kept, array[place] = array[place], wrong
        with pytest.raises(SavedFileError, match="the predecessors of a model's states must be the pairs"):
            check_lists(lists, next_state, linked)
        array[place] = kept
