"""What a scenario says of its figures. How these are drawn is the reports' business.

In the words, ``{base}`` stands for the base's name and ``{instances}`` for the number of instances with their noun.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class FigureText:
    """The name of a figure's files and its title."""

    name: str
    title: str


@dataclass(frozen=True)
class CurveText(FigureText):
    """The words of the cumulative curves of all variants, and of what each has gained on the base."""

    total: str  # the cumulative measure, on its axis
    gain: str  # the difference from the base, counted so that more is better, on its axis
    summed: str  # what is added up, in the caption


@dataclass(frozen=True)
class PathText(FigureText):
    """The words of the paths through a maze."""

    paper_steps: Mapping[str, int] = field(default_factory=dict)  # by variant: the lengths that the paper reports


@dataclass(frozen=True)
class WeightText(FigureText):
    """The words of the action weights over time."""

    actions: tuple[str, ...]  # their names
    axis: str = "action"
