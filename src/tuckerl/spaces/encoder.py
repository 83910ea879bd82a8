"""Numbers for the members of Gymnasium's spaces, so that tables can be indexed by observations and actions.

A member is read as a row of digits, d_1 to d_m, where digit i has one of n_i values; the parts of a Tuple or a Dict
and the entries of an array follow one another in the space's own order. Its number is that of
:func:`numpy.ravel_multi_index` in C order, ((d_1 n_2 + d_2) n_3 + d_3) ..., so that the last digit changes fastest:

* Discrete: one digit, the value less the space's start;
* MultiDiscrete, MultiBinary: one digit for each entry, in C order;
* Box: one digit for each dimension, in C order: its bin (see :mod:`tuckerl.spaces.bins`), or, in a Box of whole
  numbers, the value less the lowest;
* Tuple, Dict: the digits of the parts, in the order in which the space holds them (a Dict usually sorts its keys).
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from numbers import Integral
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple

from tuckerl.checks import check_text, shown
from tuckerl.errors import ParameterError, ParameterTypeError, SpaceError
from tuckerl.spaces.bins import Bins, bin_entries, box_bounds, box_edges, value_edges
from tuckerl.spaces.encoder_kinds import BinnedEncoder, ProductEncoder, SpaceEncoder, WholeNumberEncoder
from tuckerl.types import FloatArray

__all__ = ["SpaceEncoder", "digit_names", "space_encoder", "space_encoder_of_edges"]


def space_encoder(space: gymnasium.Space[Any], bins: Bins | None = None, *, what: str = "observation") -> SpaceEncoder:
    """Return numbers for the members of a space.

    Parameters
    ----------
    space : gymnasium.Space
        Discrete, MultiDiscrete, MultiBinary, Box, or a Tuple or Dict of these, nested as deep as one likes.
    bins
        How Boxes are cut. Of one Box: how many evenly spaced bins each dimension gets between its bounds; or a sequence
        with one entry for each dimension in C order, either such a number or a 1-D array of increasing inner edges (k
        edges make k + 1 bins, as in :func:`numpy.digitize`). One bin ignores a dimension and needs no bounds; it is
        also what an array of no edges says. Of a Dict: a number for all Boxes in it, or a mapping from keys to the bins
        of those parts; of a Tuple: a number, or a sequence with the bins of each part, None where there is no Box.
        A Box of whole numbers, at most 256 in each dimension, may go without: it is numbered value by value.
    what : str
        What to call the space in errors.

    Raises
    ------
    SpaceError
        If the space is of another kind, has no parts, or has a Box that needs bins or edges.
    ParameterError, ParameterTypeError
        If `bins` does not fit the space.

    Examples
    --------
    >>> from gymnasium.spaces import Box, Discrete, Tuple
    >>> blackjack = space_encoder(Tuple([Discrete(32), Discrete(11), Discrete(2)]))
    >>> blackjack.n, blackjack.encode((14, 10, 1)), blackjack.decode(329)
    (704, 329, (14, 10, 1))
    >>> plane = space_encoder(Box(-1, 1, (2,)), bins=[4, [0.0]])
    >>> plane.sizes, plane.decode(7)
    ((4, 2), array([0.75, 0.5 ], dtype=float32))
    """
    what = check_text("what", what)
    if isinstance(space, (Tuple, Dict)):
        bins_of = _bins_of_parts(space, bins, what)
        parts = {key: space_encoder(part, bins_of[key], what=f"{what}[{key!r}]") for key, part in _parts(space).items()}
        return ProductEncoder(space, parts, what)
    if isinstance(space, Box):
        edges = box_edges(space, bins, what)
        exact = value_edges(space)
        if exact is not None and all(map(np.array_equal, edges, exact)):
            return WholeNumberEncoder(space, box_bounds(space)[0], [e.size + 1 for e in edges], what, edges)
        return BinnedEncoder(space, edges, what)
    if bins is not None:
        raise ParameterError(f"{what} {space} has no Box to cut into bins, so bins must be None; got {shown(bins)}")
    if isinstance(space, Discrete):
        return WholeNumberEncoder(space, [space.start], [space.n], what)
    if isinstance(space, MultiDiscrete):
        return WholeNumberEncoder(space, space.start.ravel(), space.nvec.ravel(), what)
    if isinstance(space, MultiBinary):
        n_bits = math.prod(space.shape)
        return WholeNumberEncoder(space, [0] * n_bits, [2] * n_bits, what)
    raise SpaceError(
        f"{what} must be a Discrete, MultiDiscrete, MultiBinary or Box of Gymnasium, or a Tuple or Dict of these; "
        f"got {shown(space)}"
    )


MOST_BITS = 63
"""The logarithm of the number of members beyond which no table has a row for each."""


def check_countable(space: gymnasium.Space[Any], bins: Any = None, *, what: str = "observation") -> None:
    """Refuse a space whose members are too many for any table, such as images, before anything is made of it.

    Parameters
    ----------
    space, bins, what
        See :func:`space_encoder`.

    Raises
    ------
    SpaceError
        If that is so: it says how many there are, and what to do.
    ParameterError, ParameterTypeError
        If `bins` does not fit the space.
    """
    bits = _bits(space, bins, what)
    if bits > MOST_BITS:
        raise SpaceError(
            f"{what} {space} has about 10^{bits * math.log10(2):.0f} members with bins={shown(bins)}, more than a "
            "table has rows: give few bins (bins=, or those of tuckerl.quantile_edges(env, bins)) to the dimensions "
            "that matter and one to all others, or observe less, for example by gymnasium.wrappers.TransformObservation"
        )


def _bits(space: gymnasium.Space[Any], bins: Any, what: str) -> float:
    """Return the logarithm to the base of 2 of the number of members, 0 for a space that has no numbers yet."""
    if isinstance(space, (Tuple, Dict)):
        bins_of = _bins_of_parts(space, bins, what)
        return sum(_bits(part, bins_of[key], f"{what}[{key!r}]") for key, part in _parts(space).items())
    if isinstance(space, Box):
        if bins is None:
            if space.dtype.kind not in "iub":
                return 0.0  # it needs bins: its encoder says so
            return float(np.log2(space.high.astype(np.float64) - space.low + 1.0).sum())
        entries = bin_entries(bins, math.prod(space.shape), what)
        sizes = [entry if isinstance(entry, Integral) else np.size(entry) + 1 for entry in entries]
        return sum(math.log2(max(int(size), 1)) for size in sizes)
    if isinstance(space, MultiDiscrete):
        return float(np.log2(space.nvec.astype(np.float64)).sum())
    if isinstance(space, MultiBinary):
        return math.prod(space.shape)
    return math.log2(int(space.n)) if isinstance(space, Discrete) else 0.0


def space_encoder_of_edges(
    space: gymnasium.Space[Any], edges: Iterable[FloatArray], *, what: str = "observation"
) -> SpaceEncoder:
    """Rebuild an encoder from its space and its :attr:`SpaceEncoder.edges`, which are all that a file needs to hold.

    Raises
    ------
    SpaceError, ParameterError, ParameterTypeError
        As :func:`space_encoder` does, and if there are not as many arrays as the space's Boxes have dimensions.
    """
    given = tuple(edges)
    if len(given) != n_dimensions(space):
        raise ParameterError(
            f"edges of {what} must be one array for each of the {n_dimensions(space)} dimensions of its Boxes; "
            f"got {len(given)}"
        )
    return space_encoder(space, _bins_of_edges(space, iter(given)), what=what)


def digit_names(encoder: SpaceEncoder, what: str = "observation") -> tuple[str, ...]:
    """Return a name for each digit of an encoder's numbers: where its value stands in a member that is called `what`.

    Examples
    --------
    >>> from gymnasium.spaces import Box, Dict, Discrete
    >>> digit_names(space_encoder(Dict(place=Box(-1, 1, (2,)), lamp=Discrete(2)), bins=3))
    ("observation['place'][0]", "observation['place'][1]", "observation['lamp']")
    """
    if encoder.parts:
        parts = zip(_parts(encoder.space), encoder.parts, strict=True)
        return tuple(name for key, part in parts for name in digit_names(part, f"{what}[{key!r}]"))
    if not encoder.space.shape:
        return (what,)
    return tuple(f"{what}[{', '.join(map(str, place))}]" for place in np.ndindex(encoder.space.shape))


def _parts(space: gymnasium.Space[Any]) -> dict[Any, gymnasium.Space[Any]]:
    """Return the parts of a Tuple or Dict by place or key, in order; none of another space."""
    if isinstance(space, Dict):
        return dict(space.spaces)
    return dict(enumerate(space.spaces)) if isinstance(space, Tuple) else {}


def n_dimensions(space: gymnasium.Space[Any]) -> int:
    """Return how many dimensions all Boxes in a space have together."""
    return math.prod(space.shape) if isinstance(space, Box) else sum(map(n_dimensions, _parts(space).values()))


def _bins_of_parts(space: gymnasium.Space[Any], bins: Bins | None, what: str) -> dict[Any, Bins | None]:
    """Return the bins of each part by its key or place."""
    parts = _parts(space)
    if bins is None:
        return dict.fromkeys(parts)
    if n_dimensions(space) == 0:
        raise ParameterError(f"{what} {space} has no Box to cut into bins, so bins must be None; got {shown(bins)}")
    if isinstance(bins, Integral) and not isinstance(bins, bool):
        return {key: bins if n_dimensions(part) else None for key, part in parts.items()}
    if isinstance(space, Dict):
        if not isinstance(bins, Mapping):
            raise ParameterTypeError(
                f"bins of {what} must be a whole number or a mapping by its keys; got {shown(bins)}"
            )
        unknown = [key for key in bins if key not in parts]
        if unknown:
            raise ParameterError(f"bins of {what} must have keys of {space}; got {', '.join(map(shown, unknown))}")
        return {key: bins.get(key) for key in parts}
    if not isinstance(bins, Sequence) or isinstance(bins, str):
        raise ParameterTypeError(
            f"bins of {what} must be a whole number or a sequence with an entry for each part; got {shown(bins)}"
        )
    if len(bins) != len(parts):
        raise ParameterError(
            f"bins of {what} must have an entry for each of its {len(parts)} parts, None for one without a Box; "
            f"got {len(bins)}"
        )
    return dict(zip(parts, bins, strict=True))


def _bins_of_edges(space: gymnasium.Space[Any], edges: Iterator[FloatArray]) -> Bins | None:
    """Return the bins that give these edges again, taken one by one."""
    if n_dimensions(space) == 0:
        return None
    if isinstance(space, Dict):
        return {key: _bins_of_edges(part, edges) for key, part in space.spaces.items()}
    if isinstance(space, Tuple):
        return tuple(_bins_of_edges(part, edges) for part in space.spaces)
    return tuple(islice(edges, n_dimensions(space)))
