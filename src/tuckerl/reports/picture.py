"""What a figure is, and how one becomes a file: the same bytes every time, whatever the user's own settings."""

import io
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.figure import Figure

from tuckerl.studies.summary import Summary

PNG_DPI = 200

_STYLE: dict[str, Any] = {
    # Text as shapes: no font of the reader's machine changes the layout.
    "svg.fonttype": "path",
    "svg.hashsalt": "tuckerl",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "axes.edgecolor": "0.25",
    "lines.linewidth": 1.5,
}


class Picture(NamedTuple):
    """A figure of the report: how to draw it and what to say of it."""

    name: str  # of its files, without ending
    scenario: str
    title: str
    draw: Callable[[Summary], Figure]
    caption: Callable[[Summary], str]
    alt: Callable[[Summary], str]  # what it shows, for those who cannot see it
    interactive: Callable[[Summary], dict[str, Any]] | None = None  # the same for plotly.js


class Drawn(NamedTuple):
    """A figure as the content of its two files."""

    svg: bytes
    png: bytes


def own_style() -> AbstractContextManager[None]:
    """Return the context in which everything is drawn and saved: matplotlib's defaults and this module's style."""
    # The user's matplotlibrc must not show; the backend is the one setting that cannot be set back and forth.
    settings: Any = {name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"}
    return mpl.rc_context(settings | _STYLE)


class Shown(NamedTuple):
    """A figure as drawn, and all that the page says of it."""

    name: str
    title: str
    caption: str
    alt: str
    drawn: Drawn
    plotly: dict[str, Any] | None = None


def show(picture: Picture, summary: Summary) -> Shown:
    """Draw a picture of a summary."""
    drawn = render(lambda: picture.draw(summary))
    plotly = picture.interactive(summary) if picture.interactive else None
    return Shown(picture.name, picture.title, picture.caption(summary), picture.alt(summary), drawn, plotly)


def render(draw: Callable[[], Figure]) -> Drawn:
    """Draw a figure and return its files."""
    with own_style():
        figure = draw()
        svg, png = io.BytesIO(), io.BytesIO()
        figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
        figure.savefig(png, format="png", dpi=PNG_DPI, metadata={"Software": None})
    return Drawn(svg.getvalue(), png.getvalue())
