"""The encoders of the kinds of spaces; see :mod:`tuckerl.spaces.encoder` for the numbers that they give."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, Tuple
from numpy.typing import NDArray

from tuckerl.checks import array_of_kinds, check_int, shown
from tuckerl.errors import ObservationError, ParameterError, SpaceError
from tuckerl.spaces.bins import bin_middle, box_bounds
from tuckerl.spaces.encode_functions import (
    EncodeFunction,
    array_encoder,
    bin_encoder,
    dict_encoder,
    number_encoder,
    plane_encoder,
    tuple_encoder,
)
from tuckerl.types import BoolArray, FloatArray, IntArray

N = TypeVar("N", int, IntArray)
_MOST_NUMBERS = 2**63  # what int64 counts, from 0


class SpaceEncoder(ABC):
    """Numbers the members of one space; made by :func:`~tuckerl.spaces.encoder.space_encoder`.

    Attributes
    ----------
    space : gymnasium.Space
        Whose members are numbered.
    sizes : tuple of int
        How many values each digit has; the last digit changes fastest.
    n : int
        How many numbers there are, the product of `sizes`, exact however large.
    edges : tuple of float64 arrays
        The inner edges of each dimension of each Box, in the order of the digits; where whole numbers are told apart
        one by one, these are the numbers but for the lowest. See :func:`space_encoder_of_edges`.
    parts : tuple of SpaceEncoder
        Of the parts of a Tuple or Dict, in their order; () for other spaces.
    encode : callable
        ``encode(value)`` is the number of a member, an int from 0 to n - 1. It raises ``ObservationError`` where the
        value is outside the space. Boxes with bins are lenient: any numbers but NaN, of the right shape, have a bin.
    """

    space: gymnasium.Space[Any]
    sizes: tuple[int, ...]
    n: int
    edges: tuple[FloatArray, ...]
    parts: "tuple[SpaceEncoder, ...]" = ()
    encode: EncodeFunction

    def __init__(
        self, space: gymnasium.Space[Any], sizes: Iterable[int], edges: Iterable[FloatArray], what: str
    ) -> None:
        self.space = space
        self.sizes = tuple(map(int, sizes))
        self.n = math.prod(self.sizes)
        self.edges = tuple(edges)
        self._what = what

    @property
    def layout(self) -> tuple[int, int] | None:
        """(rows, columns) where the numbers are the cells of a grid, row by row: where there are two digits."""
        return (self.sizes[0], self.sizes[1]) if len(self.sizes) == 2 else None

    @abstractmethod
    def is_batch(self, values: Any) -> bool:
        """Return whether the first array in `values` has one axis more than that of a member."""

    def encode_many(self, values: Any) -> IntArray:
        """Return the numbers of a batch of members, (batch,) int64.

        Parameters
        ----------
        values
            As Stable-Baselines3 and Gymnasium batch them: arrays with a leading axis, in a mapping for a Dict and in a
            tuple for a Tuple.

        Raises
        ------
        ObservationError
            If a member is outside the space, or the parts' batches differ in length.
        SpaceError
            If there are more numbers than int64 has.
        """
        if self.n > _MOST_NUMBERS:
            raise SpaceError(f"{self._what} has {_written(self.n)} members, too many for int64: encode them one by one")
        return self._numbers(values)

    def decode(self, code: int) -> Any:
        """Return the member that has a number; of a bin, its middle.

        A bin without an end is met at its only edge, or just below it where that belongs to the next bin. Whole numbers
        of a Discrete are ints, arrays have the space's shape and type.

        Raises
        ------
        ParameterError, ParameterTypeError
            If `code` is not a whole number from 0 to n - 1.
        """
        number = check_int(f"code of {self._what}", code, 0)
        if number >= self.n:
            raise ParameterError(f"code of {self._what} must be below {_written(self.n)}; got {_written(number)}")
        return self._member(number)

    @abstractmethod
    def _numbers(self, values: Any) -> IntArray: ...

    @abstractmethod
    def _member(self, code: int) -> Any: ...

    @abstractmethod
    def _encoder(self) -> EncodeFunction: ...

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "encode"}  # a closure has no copy

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.encode = self._encoder()

    def __repr__(self) -> str:
        return f"SpaceEncoder({_shown(self.space)}, {_written(self.n)} numbers)"


class ArrayEncoder(SpaceEncoder):
    """Numbers the members of a space that are arrays or, where the shape is (), numbers."""

    _shape: tuple[int, ...]
    _kinds = "biu"  # of the dtypes that members may have
    _expected = "an array of whole numbers"

    @abstractmethod
    def _valid(self, rows: NDArray[Any]) -> BoolArray:
        """Return for each row of a (batch, digits) array whether it lies in the space."""

    @abstractmethod
    def _digits(self, rows: NDArray[Any]) -> IntArray:
        """Return the digits, (batch, digits), of rows that lie in the space."""

    def is_batch(self, values: Any) -> bool:  # noqa: D102  # as in SpaceEncoder
        try:
            return np.ndim(values) == len(self._shape) + 1
        except ValueError:  # lists of different lengths
            return False

    def _encode_with_care(self, value: Any) -> int:
        """Encode a value of an unusual type, a list perhaps, or say what is wrong with it."""
        array = self._array(value)
        if array is None or array.shape != self._shape or not self._valid(array.reshape(1, -1))[0]:
            raise self._refused(value)
        return _joined(map(int, self._digits(array.reshape(1, -1))[0]), self.sizes, 0)

    def _numbers(self, values: Any) -> IntArray:
        array = self._array(values)
        if array is None or array.ndim == 0 or array.shape[1:] != self._shape:
            shape = ", ".join(("batch", *map(str, self._shape)))
            raise ObservationError(
                f"a batch of {self._what} must be {self._expected} of shape ({shape}); got {_shown(values)}"
            )
        rows = array.reshape(len(array), len(self.sizes))
        valid = self._valid(rows)
        if not valid.all():
            raise self._refused(array[int(np.argmin(valid))])
        return _joined(self._digits(rows).T, self.sizes, np.zeros(len(array), np.int64))

    def _array(self, values: Any) -> NDArray[Any] | None:
        return array_of_kinds(self._what, values, self._kinds)

    def _refused(self, value: Any) -> ObservationError:
        expected = f"{self._expected} of shape {self._shape}" if self._shape else self._expected.rstrip(",")
        return ObservationError(f"{self._what} must be {expected}, as in {_shown(self.space)}; got {_shown(value)}")


class WholeNumberEncoder(ArrayEncoder):
    """Numbers members that are whole numbers, each from a lowest one up."""

    def __init__(
        self,
        space: gymnasium.Space[Any],
        lows: Iterable[Any],
        sizes: Iterable[Any],
        what: str,
        edges: Iterable[FloatArray] = (),
    ) -> None:
        super().__init__(space, sizes, edges, what)
        self._lows = list(map(int, lows))
        self._shape = space.shape or ()
        highs = [low + size - 1 for low, size in zip(self._lows, self.sizes, strict=True)]
        # Wide enough for differences; int64 cannot hold the upper half of a uint64.
        self._wide = np.uint64 if max(highs, default=0) > np.iinfo(np.int64).max else np.int64
        self._low_row, self._high_row = np.array(self._lows, self._wide), np.array(highs, self._wide)
        self._is_number = isinstance(space, Discrete)
        if self._is_number:
            self._expected = f"a whole number from {self._lows[0]} to {highs[0]}"
        if isinstance(space, MultiBinary):  # which contains any array of zeros and ones
            self._kinds = "biuf"
            self._expected = "an array of zeros and ones"
        self.encode = self._encoder()

    def _encoder(self) -> EncodeFunction:
        if self._is_number:
            return number_encoder(self._lows[0], self.sizes[0], self._encode_with_care)
        return array_encoder(self._lows, self.sizes, self._shape, self._encode_with_care)

    def _valid(self, rows: NDArray[Any]) -> BoolArray:
        valid: BoolArray = np.all((self._low_row <= rows) & (rows <= self._high_row), axis=1)
        return valid if rows.dtype.kind != "f" else valid & np.all(rows == np.floor(rows), axis=1)

    def _digits(self, rows: NDArray[Any]) -> IntArray:
        return (rows.astype(self._wide) - self._low_row).astype(np.int64)

    def _member(self, code: int) -> Any:
        values = [low + digit for low, digit in zip(self._lows, _split(code, self.sizes), strict=True)]
        return values[0] if self._is_number else np.array(values, self.space.dtype).reshape(self._shape)


class BinnedEncoder(ArrayEncoder):
    """Numbers the members of a Box by their bins."""

    _kinds = "biuf"
    _expected = "an array of numbers, none of them NaN,"

    def __init__(self, space: Box, edges: Sequence[FloatArray], what: str) -> None:
        super().__init__(space, [e.size + 1 for e in edges], edges, what)
        self._shape = space.shape
        self._lists = [e.tolist() for e in edges]
        self._bounds = list(zip(*box_bounds(space), strict=True))
        self.encode = self._encoder()

    def _encoder(self) -> EncodeFunction:
        if self._shape == (2,):
            return plane_encoder(self._lists[0], self._lists[1], self._encode_with_care)
        return bin_encoder(self._lists, self.sizes, self._shape, self._encode_with_care)

    def _valid(self, rows: NDArray[Any]) -> BoolArray:
        valid: BoolArray = ~np.isnan(rows).any(axis=1)
        return valid

    def _digits(self, rows: NDArray[Any]) -> IntArray:
        columns = rows.T.astype(np.float64)
        digits = [np.searchsorted(e, column, side="right") for e, column in zip(self.edges, columns, strict=True)]
        return np.array(digits, np.int64).reshape(columns.shape).T

    def _member(self, code: int) -> Any:
        dtype = np.dtype(self.space.dtype)
        places = zip(self._lists, _split(code, self.sizes), self._bounds, strict=True)
        return np.array([bin_middle(*place, dtype) for place in places], dtype).reshape(self._shape)


class ProductEncoder(SpaceEncoder):
    """Numbers the members of a Tuple or a Dict: the parts' numbers are the digits."""

    def __init__(self, space: "Tuple[Any] | Dict[Any]", parts: Mapping[Any, SpaceEncoder], what: str) -> None:
        if not parts:
            raise SpaceError(f"{what} must be a space with parts; got {space}")
        self._keys = list(parts) if isinstance(space, Dict) else None
        self.parts = tuple(parts.values())
        self._radices = [part.n for part in self.parts]
        sizes = (size for part in self.parts for size in part.sizes)
        super().__init__(space, sizes, (e for part in self.parts for e in part.edges), what)
        self.encode = self._encoder()

    def _encoder(self) -> EncodeFunction:
        encode = tuple_encoder([part.encode for part in self.parts], self._radices, self._encode_with_care)
        return encode if self._keys is None else dict_encoder(self._keys, encode, self._encode_with_care)

    def is_batch(self, values: Any) -> bool:  # noqa: D102  # as in SpaceEncoder
        parts = self._parts_of(values)
        return parts is not None and self.parts[0].is_batch(parts[0])

    def _encode_with_care(self, value: Any) -> int:
        """Encode an unusual kind of sequence or mapping, or say what is wrong with it."""
        if self._keys is None and (isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim > 0)):
            value = tuple(value)
        parts = self._parts_of(value)
        if parts is None:
            raise self._refused(value)
        return _joined((part.encode(one) for part, one in zip(self.parts, parts, strict=True)), self._radices, 0)

    def _numbers(self, values: Any) -> IntArray:
        parts = self._parts_of(values)
        if parts is None:
            raise self._refused(values)
        rows = [part._numbers(batch) for part, batch in zip(self.parts, parts, strict=True)]
        if len({row.size for row in rows}) > 1:
            raise ObservationError(
                f"a batch of {self._what} must have parts of one length; got {', '.join(str(r.size) for r in rows)}"
            )
        return _joined(rows[1:], self._radices[1:], rows[0])

    def _member(self, code: int) -> Any:
        digits = _split(code, self._radices)
        members = [part._member(digit) for part, digit in zip(self.parts, digits, strict=True)]
        return tuple(members) if self._keys is None else dict(zip(self._keys, members, strict=True))

    def _parts_of(self, value: Any) -> Sequence[Any] | None:
        if self._keys is None:
            return value if isinstance(value, tuple) and len(value) == len(self.parts) else None
        if not isinstance(value, Mapping) or len(value) != len(self._keys) or any(k not in value for k in self._keys):
            return None
        return [value[key] for key in self._keys]

    def _refused(self, value: Any) -> ObservationError:
        expected = f"a tuple of {len(self.parts)} parts"
        if self._keys is not None:
            expected = f"a mapping with the keys {', '.join(map(repr, self._keys))}"
        return ObservationError(f"{self._what} must be {expected}, as in {_shown(self.space)}; got {_shown(value)}")


def _joined(digits: Iterable[N], sizes: Sequence[int], first: N) -> N:
    """Return the number that digits make after the `first`, the last of them changing fastest."""
    code = first
    for digit, size in zip(digits, sizes, strict=True):
        code = code * size + digit
    return code


def _split(code: int, sizes: Sequence[int]) -> list[int]:
    """Return the digits of a number."""
    digits = []
    for size in reversed(sizes):
        code, digit = divmod(code, size)
        digits.append(digit)
    return digits[::-1]


def _shown(value: object) -> str:
    """Return a value as messages show it, with its type where that is in doubt."""
    text = shown(value)
    return f"{text} of type {type(value).__name__}" if isinstance(value, (bool, int, float, str)) else text


def _written(n: int) -> str:
    """Return a number in full, or its size where it is too long to read (Python refuses to write 4300 digits)."""
    return str(n) if abs(n) < 10**18 else f"about 10^{int(math.log10(abs(n)))}"
