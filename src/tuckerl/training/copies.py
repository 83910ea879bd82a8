"""Copies of a learner, in this process or for another one, that go on as it would, to the last bit."""

import copy
import tempfile
from abc import abstractmethod
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np

from tuckerl.errors import LearnerError
from tuckerl.saved_arrays import SavedArrays
from tuckerl.training.live_parameters import LiveParameters
from tuckerl.training.parameters import given_parameters


class Copyable(LiveParameters):
    """The part of every learner that copies it: by `copy` in memory, by `pickle` as the bytes of its file."""

    _prediction_rng: np.random.Generator

    @abstractmethod
    def save(self, path: str | PathLike[str]) -> None:
        """Write everything that is needed to go on into one file; see the learner."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return a learner that shares with this one only what does not change, such as a compiled problem.

        Raises
        ------
        ProblemError
            If an environment cannot be copied.
        LearnerInUseError
            If another thread uses the learner, or it is in the middle of an episode.
        """
        with self._owner.at_rest("copy.deepcopy()"):
            state = self._state
            kind: Any = type(self)
            made: Self = kind(self.problem.for_copy(state.worlds, memo), **given_parameters(self))
            arrays = SavedArrays.of({name: array.copy() for name, array in state.to_arrays().items()})
            made._state.restore(made._state.read(arrays, state.diverged_at))
            made._prediction_rng = copy.deepcopy(self._prediction_rng)
            for world, original in zip(made._state.worlds, state.worlds, strict=True):
                world.follow(original)
        return made

    def __copy__(self) -> Self:
        """Return what deepcopy does: two learners that shared their tables would be one with two owners."""
        return copy.deepcopy(self)

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        """Say how pickle makes the learner again: from the bytes that `save` writes.

        Raises
        ------
        LearnerError
            If they would need code that no file holds.
        """
        self._check_that_a_file_holds_all()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "learner"
            self.save(path)
            return _of_bytes, (type(self), path.read_bytes())

    def _check_that_a_file_holds_all(self) -> None:
        problem, step = self.problem, self.tensor_step
        is_made_by_id = problem.id is not None and not problem.is_compiled
        if not (problem.is_data or is_made_by_id):
            what, word = "an environment or a simulator", "env"
        elif step is not None and any(map(callable, vars(step).values())):
            what, word = "a tensor step with functions", "tensor_step"
        else:
            return
        kind = type(self).__name__
        raise LearnerError(
            f"a {kind} that has {what} of the user's own cannot be pickled, as no bytes hold code: use save(path), and "
            f"{kind}.load(path, {word}=...) where it is wanted"
        )


def _of_bytes(kind: Any, content: bytes) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "learner"
        path.write_bytes(content)
        return kind.load(path)
