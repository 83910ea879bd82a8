"""A queue of pairs (s, a) by priority: a binary heap in arrays of fixed size that knows where each pair stands in it.

To insert a pair, to raise its priority and to take the first one cost O(log n) with n pairs in the queue. Of two pairs
of one priority the one of the smaller number goes first, so that the order does not depend on how they came in.
(Williams 1964, "Algorithm 232: Heapsort".)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.errors import SavedFileError
from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.types import IntArray

ENTRY = np.dtype([("priority", np.float64), ("pair", np.int64)], align=True)


class PriorityQueue(NamedTuple):
    """The queue of one agent over S states and A actions; a pair's number is s A + a."""

    entry: NDArray[np.void]  # (S A,) of ENTRY: the heap, of which the first `size` are in use
    place: IntArray  # (S A,) where each pair stands in the heap, from 1; 0 where it does not
    size: IntArray  # (1,)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return copies of what is in the queue, in the heap's order."""
        entries = self.entry[: self.size[0]]
        return {"pair": entries["pair"].copy(), "priority": entries["priority"].copy()}

    def set_arrays(self, arrays: SavedArrays) -> None:
        """Go on from what `to_arrays` returned.

        Raises
        ------
        SavedFileError
            If it is no queue: kernels use pairs as indices.
        """
        pairs = arrays.take("pair", np.int64, (range(self.place.size + 1),), 0, self.place.size - 1)
        priority = arrays.take("priority", np.float64, (pairs.size,))
        check_distinct("the pairs of a queue", pairs)
        above = (np.arange(1, pairs.size) - 1) // 2
        ties = (priority[above] == priority[1:]) & (pairs[above] < pairs[1:])
        if not ((priority[above] > priority[1:]) | ties).all() or not (priority >= 0.0).all():
            raise SavedFileError(
                "the priorities of a queue must be numbers that fall from each place to those below it"
            )
        self.clear()
        n = self.size[0] = pairs.size
        self.entry["pair"][:n], self.entry["priority"][:n], self.place[pairs] = pairs, priority, np.arange(1, n + 1)

    def clear(self) -> None:
        """Take all pairs out."""
        self.place[self.entry["pair"][: self.size[0]]], self.size[0] = 0, 0


def empty_queue(n_states: int, n_actions: int) -> PriorityQueue:
    """Return a queue that has room for all pairs."""
    n = n_states * n_actions
    return PriorityQueue(np.zeros(n, dtype=ENTRY), np.zeros(n, dtype=np.int64), np.zeros(1, dtype=np.int64))


@kernel
def insert(queue: PriorityQueue, pair: int, priority: float) -> None:
    """Put a pair into the queue, or raise its priority; a lower one than it has is not taken."""
    here = queue.place[pair] - 1
    if here < 0:
        here = queue.size[0]
        queue.size[0] += 1
    elif priority <= queue.entry[here]["priority"]:
        return
    while here > 0:
        parent = (here - 1) >> 1
        above = queue.entry[parent]
        if not _goes_first(priority, pair, above["priority"], above["pair"]):
            break
        _put(queue, here, above["priority"], above["pair"])
        here = parent
    _put(queue, here, priority, pair)


@kernel
def take_first(queue: PriorityQueue) -> int:
    """Take the pair of the highest priority out of a queue that is not empty, and return it."""
    first = queue.entry[0]["pair"]
    queue.place[first] = 0
    queue.size[0] -= 1
    n = queue.size[0]
    if n == 0:
        return first
    last = queue.entry[n]
    priority, pair, here, child = last["priority"], last["pair"], 0, 1
    while child < n:
        if child + 1 < n:
            left, right = queue.entry[child], queue.entry[child + 1]
            child += _goes_first(right["priority"], right["pair"], left["priority"], left["pair"])
        below = queue.entry[child]
        if not _goes_first(below["priority"], below["pair"], priority, pair):
            break
        _put(queue, here, below["priority"], below["pair"])
        here, child = child, 2 * child + 1
    _put(queue, here, priority, pair)
    return first


@kernel
def _goes_first(priority: float, pair: int, other_priority: float, other_pair: int) -> bool:
    return priority > other_priority or (priority == other_priority and pair < other_pair)


@kernel
def _put(queue: PriorityQueue, here: int, priority: float, pair: int) -> None:
    """Write an entry into a place of the heap, and the place beside the pair."""
    entry = queue.entry[here]
    entry["priority"], entry["pair"] = priority, pair
    queue.place[pair] = here + 1
