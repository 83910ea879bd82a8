"""What a figure of the inside is."""

from collections.abc import Callable
from typing import NamedTuple

from matplotlib.figure import Figure

from tuckerl.reports.inspect.content import Inspection

WIDTH = 7.2  # inches: a text's width in print


class View(NamedTuple):
    """A way to look inside: when there is something to see, how it is drawn and what to say of it."""

    name: str  # of its files, without ending
    title: str
    shows: Callable[[Inspection], bool]  # whether there is anything to draw
    draw: Callable[[Inspection], Figure]
    caption: Callable[[Inspection], str]
    alt: Callable[[Inspection], str]  # what it shows, for those who cannot see it
