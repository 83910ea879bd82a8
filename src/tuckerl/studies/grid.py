"""Grids of settings: what a study file has in its ``grid`` tables, and the variants that follow."""

import json
import math
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from tuckerl.checks import check_int, check_name, check_real, shown
from tuckerl.errors import ParameterError
from tuckerl.studies.toml_place import Place, check_value

_DIGITS = 12  # of numbers in a range, so that the third of 0.5, 0.6, ... is 0.7 and not 0.7000000000000001


class Span(NamedTuple):
    """So many numbers from one to another, both included, at equal distances or, of scale "log", equal ratios."""

    low: float
    high: float
    steps: int
    scale: str

    @property
    def values(self) -> list[float | int]:
        """The numbers: whole ones where both ends and all between are whole."""
        space = np.geomspace if self.scale == "log" else np.linspace
        numbers = [float(f"{number:.{_DIGITS}g}") for number in space(self.low, self.high, self.steps)]
        ends_whole = isinstance(self.low, int) and isinstance(self.high, int)
        whole = ends_whole and all(number.is_integer() for number in numbers)
        return [int(number) for number in numbers] if whole else list(numbers)


class Axis(NamedTuple):
    """A setting that a grid varies."""

    name: str
    choices: list[Any] | Span
    place: Place

    @property
    def size(self) -> int:
        """Number of values; they are made only when they are asked for, of which there may be very many."""
        return self.choices.steps if isinstance(self.choices, Span) else len(self.choices)

    @property
    def values(self) -> list[Any]:
        """The values."""
        return self.choices.values if isinstance(self.choices, Span) else self.choices

    def place_of(self, value: Any) -> Place:
        """Return where a value stands."""
        return self.place if isinstance(self.choices, Span) else self.place.inside(self.choices.index(value))


def read_axis(name: str, value: Any, place: Place) -> Axis:
    """Return an axis: a list of values, or a table with ``from``, ``to``, ``steps`` and perhaps ``scale``.

    Raises
    ------
    ParameterError, UnknownNameError
        If it is neither, empty, or has a value twice.
    """
    if isinstance(value, dict):
        return Axis(name, _span(value, place), place)
    if not isinstance(value, list):
        raise place.wrong(
            f"{name} of a grid must be a list of values, or {{ from = 0.1, to = 0.5, steps = 5 }}; got {shown(value)}"
        )
    if not value:
        raise place.wrong(f"{name} has no value: give it one or more, or leave it out of the grid")
    written: set[str] = set()
    for at, one in enumerate(value):
        with place.inside(at).blamed():
            check_value(name, one)
            if in_a_name(one) in written:
                raise ParameterError(f"{name} has the value {in_a_name(one)} twice")
        written.add(in_a_name(one))
    return Axis(name, value, place)


def _number(name: str, value: Any) -> float | int:
    check_real(name, value)
    return value  # type: ignore[no-any-return]  # whole ones stay whole


_CHECKS = {
    "from": _number,
    "to": _number,
    "steps": lambda name, value: check_int(name, value, 2),
    "scale": lambda name, value: check_name(name, value, ("linear", "log")),
}


def _span(table: Mapping[str, Any], place: Place) -> Span:
    found = place.entries(table, _CHECKS)
    for key in ("from", "to", "steps"):
        if key not in found:
            raise place.wrong(f"{key} is missing: a range is {{ from = 0.1, to = 0.5, steps = 5 }}")
    low, high, scale = found["from"], found["to"], found.get("scale", "linear")
    if not low < high:
        raise place.wrong(f"from must be below to; got {low} and {high}")
    if scale == "log" and low <= 0:
        raise place.wrong(f"from must be above 0 where the scale is log; got {low}")
    return Span(low, high, found["steps"], scale)


def in_a_name(value: Any) -> str:
    """Return how a value stands in a variant's name: text as it is, all else as JSON without spaces."""
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"), default=str)


def size_of(grid: tuple[Axis, ...]) -> int:
    """Return the number of combinations; of no axes there is one."""
    return math.prod(axis.size for axis in grid)


def combinations(grid: tuple[Axis, ...]) -> Iterator[dict[str, Any]]:
    """Give every combination of the axes' values by their names."""
    names = [axis.name for axis in grid]
    for values in product(*(axis.values for axis in grid)):
        yield dict(zip(names, values, strict=True))


def name_of(base: str, chosen: Mapping[str, Any]) -> str:
    """Return a variant's name: that of its algorithm, with what the grid chose in brackets."""
    inside = ",".join(f"{name}={in_a_name(value)}" for name, value in chosen.items())
    return f"{base}[{inside}]" if chosen else base
