"""What a figure is, and how one becomes a file: the same bytes every time, whatever the user's own settings."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import matplotlib as mpl
from matplotlib.figure import Figure

from tuckerl.studies.figure_text import FigureText

Subject = TypeVar("Subject")

WIDTH = 7.2  # inches: a text's width in print
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


Columns = Mapping[str, Sequence[object]]
"""Numbers and words, by the names of their columns."""


class Live(NamedTuple):
    """What a page's script needs to draw a figure anew, to be explored: in the place of the still one."""

    kind: str  # the script that draws it: ``scripts/KIND.js``
    content: dict[str, Any]  # as JSON
    caption: str = ""  # where what is said of the still figure is not true of it


class RenderedFigure(NamedTuple):
    """A drawn figure: the content of its two files, and all that a page says of it."""

    name: str  # of the files, without ending
    title: str
    caption: str
    alt: str  # what it shows, for those who cannot see it
    svg: bytes
    png: bytes
    csv: str = ""  # the numbers in it; "" where a table beside it has them
    live: Live | None = None


@dataclass(frozen=True)
class FigureSpec(Generic[Subject]):
    """The specification of a figure: how it is drawn, and what is said of it.

    To add one, write a file with a `FigureSpec` in it and list it in :data:`tuckerl.reports.figures.FIGURES`, or in
    that of ``reports/inspect`` where it is a figure of an `Inspection`.
    """

    subject: type[Subject]  # what it is a figure of
    text: FigureText | Callable[[Subject], FigureText]  # its name and title
    draw: Callable[[Subject], Figure]
    caption: Callable[[Subject], str]
    alt: Callable[[Subject], str]
    applies: Callable[[Subject], bool] = lambda _: True  # whether there is anything to draw
    columns: Callable[[Subject], Columns] | None = None  # the numbers in it, where no table beside it has them
    live: Callable[[Subject], Live | None] | None = None

    def text_of(self, subject: Subject) -> FigureText:
        """Return the figure's name and title."""
        return self.text if isinstance(self.text, FigureText) else self.text(subject)

    def render(self, subject: Subject) -> RenderedFigure:
        """Draw the figure of a subject, the same bytes every time."""
        text = self.text_of(subject)
        with own_style():
            figure = self.draw(subject)
            lay_out(figure)
            svg, png = io.BytesIO(), io.BytesIO()
            figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
            figure.savefig(png, format="png", dpi=PNG_DPI, metadata={"Software": None})
        return RenderedFigure(
            text.name,
            text.title,
            self.caption(subject),
            self.alt(subject),
            svg.getvalue(),
            png.getvalue(),
            csv_of(self.columns(subject)) if self.columns else "",
            self.live(subject) if self.live else None,
        )


def csv_of(columns: Columns) -> str:
    """Return columns of one length as CSV."""
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return lines.getvalue()


def lay_out(figure: Figure) -> None:
    """Find the places of everything once, where a layout is to find them: else each file's writing would again."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")


def own_style() -> AbstractContextManager[None]:
    """Return the context in which everything is drawn and saved: matplotlib's defaults and this module's style."""
    # The user's matplotlibrc must not show; the backend is the one setting that cannot be set back and forth.
    settings: Any = {name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"}
    return mpl.rc_context(settings | _STYLE)


def draw_figures(figures: Iterable[FigureSpec[Any]], subject: object) -> list[RenderedFigure]:
    """Draw those of the figures that are of this subject and have anything to show, the same bytes each time."""
    return [spec.render(subject) for spec in figures if isinstance(subject, spec.subject) and spec.applies(subject)]
