"""The arrays of a file, which may come from a stranger: each is read when it is known what it must be, and is that.

Names have a structure, ``group/name``, so that what one part of a learner keeps never meets what another keeps.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import DTypeLike

from tuckerl.errors import SavedFileError

ANY_LENGTH = range(sys.maxsize)
"""An axis of unknown length."""

Axis = int | range
"""The length of an axis, or the lengths that it may have."""


class StoredArray(NamedTuple):
    """An array that has not been read yet."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    read: Callable[[], np.ndarray]


class SavedArrays(Mapping[str, np.ndarray]):
    """Arrays by name, each checked before it is read and when it has been read.

    Parameters
    ----------
    stored : dict of StoredArray by name
    """

    def __init__(self, stored: Mapping[str, StoredArray]) -> None:
        self._stored, self._group = dict(stored), ""
        self._taken: set[str] = set()

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray]) -> "SavedArrays":
        """Return arrays that are in memory in this form."""
        if isinstance(arrays, SavedArrays):
            return arrays
        return cls({name: StoredArray(a.dtype, a.shape, lambda a=a: a) for name, a in arrays.items()})  # type: ignore[misc]  # a is bound

    def group(self, name: str) -> Self:
        """Return the arrays ``name/...`` by what follows; what is taken there is taken here."""
        part = type(self)({})
        part._stored, part._taken, part._group = self._stored, self._taken, f"{self._group}{name}/"
        return part

    def __getitem__(self, name: str) -> np.ndarray:
        return self._find(name).read()

    def __iter__(self) -> Iterator[str]:
        return (name.removeprefix(self._group) for name in list(self._stored) if name.startswith(self._group))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        return f"{self._group}{name}" in self._stored

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of an array that is not read for it."""
        return self._find(name).shape

    def take(
        self,
        name: str,
        dtype: DTypeLike,
        shape: tuple[Axis, ...],
        low: float | None = None,
        high: float | None = None,
        *,
        finite: bool = False,
    ) -> Any:
        """Return an array that is what it must be; it is read only if its type and shape are right.

        Parameters
        ----------
        name : str
        dtype
        shape : tuple
            For each axis its length, or the lengths that it may have.
        low, high : float, optional
            The least and the largest entry that there may be.
        finite : bool
            Whether NaN and infinity are refused.

        Raises
        ------
        SavedFileError
            If it is missing, or has another type, shape or other entries.
        """
        stored, expected, where = self._find(name), np.dtype(dtype), f"{self._group}{name}"
        fits = len(stored.shape) == len(shape) and all(map(_has_length, stored.shape, shape))
        if stored.dtype.newbyteorder("=") != expected or not fits:
            lengths = tuple(axis if isinstance(axis, int) else "any" if axis == ANY_LENGTH else axis for axis in shape)
            raise SavedFileError(
                f"{where} must be {expected} of the shape {lengths}; it is {stored.dtype} of the shape {stored.shape}"
            )
        array = np.asarray(stored.read(), expected, order="C")  # kernels see its rows as bytes, too
        if array.size and not (
            (low is None or (array >= low).all())
            and (high is None or (array <= high).all())
            and (not finite or np.isfinite(array).all())
        ):
            ends = [f"at {word} {end}" for word, end in (("least", low), ("most", high)) if end is not None]
            raise SavedFileError(f"{where} must be {' and '.join(ends + ['finite'] * finite)} everywhere")
        return array

    def rename(self, names: Mapping[str, str]) -> None:
        """Give arrays the names that are read here instead of those that an older file has, new by old."""
        for old, new in names.items():
            if f"{self._group}{old}" in self._stored:
                self._stored[f"{self._group}{new}"] = self._stored.pop(f"{self._group}{old}")

    def replace(self, name: str, function: Callable[[np.ndarray], np.ndarray]) -> None:
        """Read a function of an array, entry by entry of its type, in the place of the array."""
        full = f"{self._group}{name}"
        stored = self._stored[full]
        self._stored[full] = stored._replace(read=lambda: function(stored.read()))

    def add(self, name: str, stored: StoredArray) -> None:
        """Put in an array that older files lack."""
        self._stored[f"{self._group}{name}"] = stored

    def leave_out(self, *names: str) -> None:
        """Say of arrays that older files have and nobody reads that they are known."""
        self._taken.update(f"{self._group}{name}" for name in names)

    def check_all_taken(self) -> None:
        """Refuse arrays that nobody has asked for.

        Raises
        ------
        SavedFileError
            If there are any.
        """
        unknown = sorted(set(self._stored) - self._taken)
        if unknown:
            raise SavedFileError(f"it holds arrays that no such learner has, {', '.join(unknown[:3])}")

    def _find(self, name: str) -> StoredArray:
        full = f"{self._group}{name}"
        if full not in self._stored:
            raise SavedFileError(f"it lacks the array {full}")
        self._taken.add(full)
        return self._stored[full]


def grouped(name: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays under the names ``name/...``, from which `SavedArrays.group` gives their own."""
    return {f"{name}/{own}": array for own, array in arrays.items()}


def _has_length(length: int, axis: Axis) -> bool:
    return length == axis if isinstance(axis, int) else length in axis


def check_distinct(name: str, numbers: np.ndarray) -> None:
    """Refuse numbers of which one is there twice.

    Raises
    ------
    SavedFileError
        If that is so.
    """
    if np.unique(numbers).size < numbers.size:
        raise SavedFileError(f"{name} must hold each number once")
