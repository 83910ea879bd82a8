"""Where the dimensions of a Box are cut, so that what lies in it can be numbered.

The inner edges e_1 < ... < e_k of a dimension make k + 1 bins, and the bin of x is the number of edges that are not
above it, as :func:`numpy.digitize` has it: bin 0 is x < e_1, bin i is e_i <= x < e_(i+1), bin k is e_k <= x. What lies
beyond the outermost edges therefore falls into the end bins, whether or not the Box reaches that far.
"""

import math
from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from tuckerl.checks import NO_ARRAY, check_int, refuse_mask, shown
from tuckerl.errors import ParameterError, ParameterTypeError, SpaceError
from tuckerl.types import FloatArray

Bins = int | Sequence[Any] | NDArray[Any] | Mapping[Any, Any]
"""How a space's Boxes are cut: see :func:`tuckerl.spaces.encoder.space_encoder`."""

EXACT_VALUES = 256
"""A Box of whole numbers needs no bins where no dimension has more values than this: those of one byte."""

_UNBOUNDED = 1e30  # CartPole's speeds are "bounded" by float32's largest number, 3.4e38
_WHOLE_FLOATS = 2.0**53  # below, every whole number is a float64, and so is the next
MOST_BINS = 1_000_000


def box_edges(box: Box, bins: Bins | None, what: str) -> tuple[FloatArray, ...]:
    """Return the read-only inner edges of each dimension, in C order.

    Raises
    ------
    SpaceError
        If there are no bins and the Box needs some, or a number of bins is given for a dimension without bounds.
    ParameterError, ParameterTypeError
        If `bins` does not fit the Box.
    """
    if bins is None:
        exact = value_edges(box)
        if exact is None:
            raise _needs_bins(box, what)
        return exact
    lows, highs = box_bounds(box)
    entries = bin_entries(bins, len(lows), what)
    unbounded = [
        i
        for i, (entry, low, high) in enumerate(zip(entries, lows, highs, strict=True))
        if isinstance(entry, Integral) and entry != 1 and math.isinf(high - low)
    ]
    if unbounded:
        raise SpaceError(
            f"{what} {box} has no bounds to space bins between in dimension{'s' * (len(unbounded) > 1)} "
            f"{', '.join(map(str, unbounded))}: give edges there, or take those of tuckerl.quantile_edges(env, bins)"
        )
    made: dict[tuple[int, float, float], FloatArray] = {}  # an image has few kinds of dimension and many of each
    edges = []
    for i, (entry, low, high) in enumerate(zip(entries, lows, highs, strict=True)):
        name = f"bins of dimension {i} of {what}"
        if isinstance(entry, Integral):
            count = check_int(name, entry, 1, MOST_BINS)
            if (count, low, high) not in made:
                made[count, low, high] = _even_edges(name, count, low, high)
            edges.append(made[count, low, high])
        else:
            edges.append(_given_edges(name, entry))
    return tuple(edges)


def value_edges(box: Box) -> tuple[FloatArray, ...] | None:
    """Return the edges that part every whole number of the Box; None where these are too many, or not whole."""
    lows, highs = box_bounds(box)
    if lows and box.dtype.kind not in "iub":
        return None
    made: dict[tuple[float, float], FloatArray] = {}
    for low, high in set(zip(lows, highs, strict=True)):
        if high - low >= EXACT_VALUES or max(-low, high) >= _WHOLE_FLOATS:
            return None
        made[low, high] = _read_only(np.arange(low + 1, high + 1, dtype=np.float64))
    return tuple(made[bounds] for bounds in zip(lows, highs, strict=True))


def box_bounds(box: Box) -> tuple[list[float], list[float]]:
    """Return the bounds of each dimension in C order, infinite where they are so large that they bound nothing."""
    low, high = box.low.astype(np.float64), box.high.astype(np.float64)
    low = np.where(box.bounded_below & (np.abs(low) <= _UNBOUNDED), low, -np.inf)
    high = np.where(box.bounded_above & (np.abs(high) <= _UNBOUNDED), high, np.inf)
    return low.ravel().tolist(), high.ravel().tolist()


def bin_middle(edges: Sequence[float], place: int, bounds: tuple[float, float], dtype: np.dtype[Any]) -> float:
    """Return a number of `dtype` in bin `place` and within `bounds`, where there is one: the middle if that is so.

    A bin without an end has its only edge as its middle; the first bin has the largest number below its edge, as the
    edge itself lies in the second. In the only bin of a dimension without bounds it is 0.
    """
    lower = edges[place - 1] if place > 0 else -math.inf
    upper = edges[place] if place < len(edges) else math.inf
    left, right = max(lower, bounds[0]), min(upper, bounds[1])
    finite = [end for end in (left, right) if math.isfinite(end)]
    middle = sum(finite) / len(finite) if finite else 0.0
    if dtype.kind in "iub":
        value = float(math.floor(middle))
        value = value if value >= lower else float(math.ceil(lower))
        value = value if value < upper else float(math.ceil(upper) - 1)
    else:
        with np.errstate(over="ignore"):
            rounded = dtype.type(middle)
            if float(rounded) < lower:
                rounded = np.nextafter(rounded, dtype.type(np.inf))
            if float(rounded) >= upper:
                rounded = np.nextafter(rounded, dtype.type(-np.inf))
        value = float(rounded)
    return min(max(value, bounds[0]), bounds[1])


def bin_entries(bins: Any, dimensions: int, what: str) -> list[Any]:
    """Return the entry of `bins` for each dimension."""
    if isinstance(bins, Integral) and not isinstance(bins, bool):
        return [bins] * dimensions
    expected = (
        f"bins of {what} must be a whole number, or a sequence with one entry for each of {dimensions} dimensions"
    )
    refuse_mask(f"bins of {what}", bins)
    listed = isinstance(bins, Sequence) or (isinstance(bins, np.ndarray) and bins.ndim > 0)
    if not listed or isinstance(bins, (str, bytes)):
        raise ParameterTypeError(f"{expected}; got {shown(bins)}")
    if len(bins) != dimensions:
        raise ParameterError(f"{expected}; got {len(bins)}: {shown(bins)}")
    return list(bins)


def _even_edges(name: str, count: int, low: float, high: float) -> FloatArray:
    edges = np.linspace(low, high, count + 1)[1:-1] if count > 1 else np.empty(0)
    if count > 1 and not (low < edges[0] and np.all(np.diff(edges) > 0)):
        raise ParameterError(f"{name} must be 1, as there is no room for {count} between {low:g} and {high:g}")
    return _read_only(edges)


def _given_edges(name: str, entry: Any) -> FloatArray:
    expected = f"{name} must be how many there are, or a 1-D array of finite, increasing inner edges"
    refuse_mask(name, entry)
    try:
        edges = np.asarray(entry)
    except NO_ARRAY:
        raise ParameterTypeError(f"{expected}; got {shown(entry)}") from None
    if edges.size and edges.dtype.kind not in "iuf":
        raise ParameterTypeError(f"{expected}; got {shown(entry)}")
    edges = edges.astype(np.float64)
    if edges.ndim != 1 or not np.isfinite(edges).all() or not np.all(np.diff(edges) > 0):
        raise ParameterError(f"{expected}; got {shown(entry)}")
    return _read_only(edges)


def _read_only(edges: FloatArray) -> FloatArray:
    edges.flags.writeable = False
    return edges


def _needs_bins(box: Box, what: str) -> SpaceError:
    if what.startswith("action"):
        return SpaceError(
            f"{what} must be one of finitely many; got {box}: choose among some of them, "
            "for example with gymnasium.wrappers.DiscretizeAction"
        )
    return SpaceError(
        f"{what} {box} cannot be numbered value by value: give bins, how many or with which edges for each dimension, "
        "or take the edges of tuckerl.quantile_edges(env, bins)"
    )
