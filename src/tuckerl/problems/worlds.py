"""One agent's copy of a problem: what its kernel reads, and what only Python knows of it."""

from typing import Any, NamedTuple

import numpy as np

from tuckerl.types import BoolArray

_NOTHING: BoolArray = np.zeros((0, 0), dtype=np.bool_)


class World:
    """A problem in which nothing happens outside of kernels.

    Attributes
    ----------
    arrays : NamedTuple
        What kernels read.
    action_masks : tuple of (S, A) bool
        For each table that is learned in this world: True where an action may be taken, or (0, 0) where all may.
    """

    def __init__(self, arrays: NamedTuple, action_masks: tuple[BoolArray, ...] = (_NOTHING,)) -> None:
        self.arrays: Any = arrays
        self.action_masks = action_masks

    def seed(self, sequence: np.random.SeedSequence) -> None:
        """Say where what is random outside of kernels takes its seeds from."""

    def set_deadline(self, seconds: float) -> None:
        """Say after how long the next kernel is to return, at the end of an episode; compiled worlds need no limit."""

    def raise_pending(self) -> None:
        """Raise what a kernel could not, and forget it: the next episode begins anew."""

    def close(self) -> None:
        """Let go of what the world holds; nothing is played in it any more."""

    def saved(self) -> dict[str, Any]:
        """Return as JSON what must be known to go on between two episodes."""
        return {}

    def restore(self, header: dict[str, Any]) -> None:
        """Go on from what `saved` returned."""
