"""One agent's copy of a problem: what its kernel reads, and what only Python knows of it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tuckerl.errors import SavedFileError
from tuckerl.types import BoolArray

_NOTHING: BoolArray = np.zeros((0, 0), dtype=np.bool_)


class World:
    """One agent's copy of a problem that is played in kernels alone; subclasses add what Python does around them.

    Attributes
    ----------
    arrays : NamedTuple
        What kernels read.
    action_masks : tuple of (S, A) bool
        For each table that is learned in this world: True where an action may be taken, or (0, 0) where all may.
    before_episode : callable
        What a world that Python steps calls when an episode begins: going back to there is the learner's part.
    has_users_functions : bool
        Whether kernels call compiled functions of a user's own, which need not return.
    """

    before_episode: Callable[[], None] = staticmethod(lambda: None)
    has_users_functions = False

    def __init__(self, arrays: NamedTuple, action_masks: tuple[BoolArray, ...] = (_NOTHING,)) -> None:
        self.arrays: Any = arrays
        self.action_masks = action_masks

    @property
    def n_own_actions(self) -> tuple[int, ...]:
        """How many of the actions each table's agent has; no mask allows those beyond."""
        return tuple(mask.shape[1] for mask in self.action_masks)

    def seed(self, sequence: np.random.SeedSequence) -> None:
        """Seed the environment, where kernels do not draw all that is random."""

    def set_deadline(self, seconds: float) -> None:
        """Make the next kernel return at the first end of an episode after so many seconds, if it calls Python."""

    def keep(self) -> None:
        """Remember this point between two episodes, for `undo`."""

    def undo(self) -> None:
        """Go back to where `keep` was called, also where a call of a kernel was given up that still runs."""

    def raise_pending(self) -> None:
        """Raise the error that made the latest kernel return, if any, and forget it: a new episode can begin."""

    def close(self) -> None:
        """Close the environment, if there is one: nothing is played in this world any more."""

    def saved(self) -> dict[str, Any]:
        """Return as JSON what must be known to go on between two episodes."""
        return {}

    def follow(self, original: "World") -> None:
        """Go on as a world does of which this one is a copy."""
        self.restore(original.saved())

    def restore(self, header: dict[str, Any]) -> None:
        """Go on from what `saved` returned.

        Raises
        ------
        SavedFileError
            If it is none of such a world's.
        """
        if header:
            raise SavedFileError("it holds an environment's seeds, and this problem has none")
