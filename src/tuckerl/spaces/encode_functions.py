"""Functions that number one member of a space, fast, because one runs at every environment step.

Each is a closure over plain numbers and lists. It handles the usual types of members, and passes all else to
`with_care`, which is slow, or says what is wrong. NumPy's scalars compare ten times slower than
Python's numbers, so arrays become lists first; a float32 becomes the float64 of the same value on the way. The lengths
of what is zipped are known to be equal, and asking ``zip`` to be strict would take longer than encoding a digit.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from operator import index, itemgetter
from typing import Any

EncodeFunction = Callable[[Any], int]


def number_encoder(low: int, size: int, with_care: EncodeFunction) -> EncodeFunction:
    """Return the encoder of whole numbers from `low` up: ints, bools, NumPy's ints and arrays of one such."""

    def encode(value: Any) -> int:
        try:
            digit = index(value) - low
            if 0 <= digit < size:
                return digit
        except TypeError:
            pass
        return with_care(value)

    return encode


def array_encoder(
    lows: Sequence[int], sizes: Sequence[int], shape: tuple[int, ...], with_care: EncodeFunction
) -> EncodeFunction:
    """Return the encoder of arrays of whole numbers, or of bools."""
    flat = len(shape) == 1

    def encode(value: Any) -> int:
        code = 0
        try:
            if value.shape == shape and value.dtype.kind in "biu":
                numbers = value.tolist() if flat else value.ravel().tolist()
                for number, low, size in zip(numbers, lows, sizes):  # noqa: B905  # see above
                    digit = number - low
                    if not 0 <= digit < size:
                        break
                    code = code * size + digit
                else:
                    return code
        except (AttributeError, TypeError):
            pass
        return with_care(value)

    return encode


def plane_encoder(rows: list[float], columns: list[float], with_care: EncodeFunction) -> EncodeFunction:
    """Return the encoder of arrays of shape (2,) by the edges of the two dimensions."""
    n_columns = len(columns) + 1

    def encode(value: Any) -> int:
        try:
            if value.shape == (2,) and value.dtype.kind in "biuf":
                x, y = value.tolist()
                if x == x and y == y:  # not NaN, which would be found above all edges
                    return bisect_right(rows, x) * n_columns + bisect_right(columns, y)
        except (AttributeError, TypeError):
            pass
        return with_care(value)

    return encode


def bin_encoder(
    edges: Sequence[list[float]], sizes: Sequence[int], shape: tuple[int, ...], with_care: EncodeFunction
) -> EncodeFunction:
    """Return the encoder of arrays by the edges of each dimension."""
    flat = len(shape) == 1

    def encode(value: Any) -> int:
        code = 0
        try:
            if value.shape == shape and value.dtype.kind in "biuf":
                numbers = value.tolist() if flat else value.ravel().tolist()
                for number, places, size in zip(numbers, edges, sizes):  # noqa: B905  # see above
                    if number != number:  # NaN
                        break
                    code = code * size + bisect_right(places, number)
                else:
                    return code
        except (AttributeError, TypeError):
            pass
        return with_care(value)

    return encode


def tuple_encoder(
    encoders: Sequence[EncodeFunction], sizes: Sequence[int], with_care: EncodeFunction
) -> EncodeFunction:
    """Return the encoder of tuples by the encoders and the sizes of their parts."""
    length = len(encoders)

    def encode(value: Any) -> int:
        if type(value) is not tuple or len(value) != length:
            return with_care(value)
        code = 0
        for encode_part, part, size in zip(encoders, value, sizes):  # noqa: B905  # see above
            code = code * size + encode_part(part)
        return code

    return encode


def dict_encoder(keys: Sequence[Any], encode_parts: EncodeFunction, with_care: EncodeFunction) -> EncodeFunction:
    """Return the encoder of dicts by that of the tuple of their parts."""
    length = len(keys)
    pick = itemgetter(*keys)

    def encode(value: Any) -> int:
        if type(value) is not dict or len(value) != length:
            return with_care(value)
        try:
            parts = pick(value)
        except KeyError:
            return with_care(value)
        return encode_parts(parts if length > 1 else (parts,))

    return encode
