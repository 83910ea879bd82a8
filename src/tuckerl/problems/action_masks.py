"""Action masks as users and environments write them, read into arrays of True where an action may be taken."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tuckerl.checks import array_of_kinds, shown
from tuckerl.errors import ObservationError
from tuckerl.types import BoolArray

Batch = tuple[int, ...]
"""The axes before a mask's own: () of one observation, (batch,) of several."""


def as_mask(given: Any, size: int, batch: Batch = ()) -> BoolArray:
    """Return a mask of `size` actions, or one for each observation of a batch, as a new (*batch, size) array.

    Raises
    ------
    ObservationError
        If it has another shape or other entries than 0 and 1.
    """
    entries = array_of_kinds("an action mask", given, "biuf")
    if entries is None or entries.shape != (*batch, size):
        raise ObservationError(f"{_expected(str(size), batch)}; got {shown(given)}")
    mask: BoolArray = entries.astype(np.bool_)
    if entries.dtype.kind != "b" and (entries != mask).any():
        raise ObservationError(f"the entries of an action mask must be 0 or 1; got {shown(given)}")
    return mask


def masks_of_parts(given: Any, sizes: Sequence[int], batch: Batch = ()) -> list[BoolArray]:
    """Return the (*batch, size) mask of each part of an action from a tuple of masks, None where a part is free.

    Raises
    ------
    ObservationError
        If it is no such tuple.
    """
    if not isinstance(given, (tuple, list)) or len(given) != len(sizes):
        raise ObservationError(f"an action mask must be a tuple of {len(sizes)} masks; got {shown(given)}")
    return [
        np.ones((*batch, size), dtype=np.bool_) if part is None else as_mask(part, size, batch)
        for part, size in zip(given, sizes, strict=True)
    ]


def masks_in_row(given: Any, sizes: Sequence[int], batch: Batch = ()) -> list[BoolArray]:
    """Return the masks of each part from those of all parts, one after the other in one row (as sb3-contrib does).

    A row as long as there are joint actions is one mask of these, where both lengths differ.

    Raises
    ------
    ObservationError
        If it has another length or other entries.
    """
    entries, total, n_joint = array_of_kinds("an action mask", given, "biuf"), sum(sizes), math.prod(sizes)
    if entries is not None and entries.shape == (*batch, n_joint) and n_joint != total:
        return [as_mask(given, n_joint, batch)]
    if entries is None or entries.shape != (*batch, total):
        either = f"{total} entries, those of {len(sizes)} parts one after the other, or {n_joint}"
        raise ObservationError(f"{_expected(either, batch)}; got {shown(given)}")
    return np.split(as_mask(given, total, batch), np.cumsum(sizes)[:-1], axis=-1)


def joint_mask(parts: Sequence[BoolArray]) -> BoolArray:
    """Return which joint actions may be taken, in C order: those of which every part may."""
    mask = parts[0]
    for part in parts[1:]:
        mask = (mask[..., :, np.newaxis] & part[..., np.newaxis, :]).reshape(*mask.shape[:-1], -1)
    return mask


def freed(mask: BoolArray) -> BoolArray:
    """Return a mask in which a row that allows nothing allows everything."""
    return mask | ~mask.any(axis=-1, keepdims=True)


def _expected(size: str, batch: Batch) -> str:
    rows = f" for each of the {batch[0]} observations" if batch else ""
    return f"an action mask must be a row of {size} entries{rows}, 1 where an action may be taken and 0 where not"
