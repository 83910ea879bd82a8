"""The greedy policy of a table, and where an action's name points."""

from collections.abc import Sequence

import numpy as np

from tuckerl.types import BoolArray, FloatArray, IntArray

NO_PREFERENCE = -1

_VERTICAL = {"up": -1, "north": -1, "down": 1, "south": 1}
_HORIZONTAL = {"left": -1, "west": -1, "right": 1, "east": 1}
_ARROWS = {"↑": (-1, 0), "↓": (1, 0), "←": (0, -1), "→": (0, 1)}
_FILLERS = {"move", "go", "step", "push", "accelerate", "walk", "to", "the"}


def direction(name: str) -> tuple[int, int] | None:
    """Return the (rows down, columns to the right) that an action's name means, or None if it means no direction.

    Examples
    --------
    >>> direction("up"), direction("move_south-east"), direction("stay"), direction("left, up")
    ((-1, 0), (1, 1), None, None)
    """
    text = name.strip().lower()
    if text in _ARROWS:
        return _ARROWS[text]
    words = [word for word in text.replace("_", " ").replace("-", " ").split() if word not in _FILLERS]
    if len(words) == 1 and words[0] not in _VERTICAL:  # "northeast", "upleft"
        halves = [half for half in _VERTICAL if words[0].startswith(half)]
        words = [halves[0], words[0].removeprefix(halves[0])] if halves else words
    vertical = [_VERTICAL[word] for word in words if word in _VERTICAL]
    horizontal = [_HORIZONTAL[word] for word in words if word in _HORIZONTAL]
    known = len(vertical) + len(horizontal) == len(words) > 0
    if not known or len(vertical) > 1 or len(horizontal) > 1:
        return None
    return sum(vertical), sum(horizontal)


def greedy(q: FloatArray, action_mask: BoolArray | np.bool_ = np.True_) -> IntArray:
    """Return the greedy action of each row of a (..., S, A) table, the lowest of equals.

    A row whose values are all equal, or not all finite, has NO_PREFERENCE. Where there is one action only, a row
    prefers it as soon as it is not zero. Actions that the mask rules out in a row count as if they were not there.
    """
    allowed = np.broadcast_to(action_mask, q.shape)
    finite = (np.isfinite(q) | ~allowed).all(axis=-1, keepdims=True)
    high = np.where(allowed, np.where(finite, q, 0.0), -np.inf)
    best, only_one = high.max(axis=-1), allowed.sum(axis=-1) == 1
    prefers = np.where(only_one, best != 0, best > np.where(allowed, high, np.inf).min(axis=-1))
    return np.where(prefers & np.isfinite(best), high.argmax(axis=-1), NO_PREFERENCE)


def values(q: FloatArray, action_mask: BoolArray | np.bool_ = np.True_) -> FloatArray:
    """Return the largest value of each row of a (..., S, A) table, NaN where the row prefers nothing."""
    return np.where(greedy(q, action_mask) == NO_PREFERENCE, np.nan, np.where(action_mask, q, -np.inf).max(axis=-1))


def shares_first_place(q: FloatArray, action_mask: BoolArray | np.bool_ = np.True_) -> BoolArray:
    """Return in which rows several actions, but not all, are equally best: (..., S)."""
    values_of_allowed = np.where(action_mask, q, -np.inf)
    several = np.count_nonzero(values_of_allowed == values_of_allowed.max(axis=-1, keepdims=True), axis=-1) > 1
    tied: BoolArray = np.logical_and(several, greedy(q, action_mask) != NO_PREFERENCE)
    return tied


def arrows(q: FloatArray, action_names: Sequence[str], action_mask: BoolArray | np.bool_ = np.True_) -> IntArray:
    """Return the (rows down, columns to the right) that the greedy policy of an (S, A) table leads, (S, 2).

    It is (0, 0) where there is no preference, or the action has no direction.
    """
    action = greedy(q, action_mask)
    ways = np.array([direction(name) or (0, 0) for name in action_names], dtype=np.int64)
    return np.where(action[:, np.newaxis] == NO_PREFERENCE, 0, ways[action])
