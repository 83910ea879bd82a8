"""The optimal values beside those that were learned."""

import numpy as np
from matplotlib.figure import Figure

from tuckerl.problems.parts import Layout
from tuckerl.reports.figure import WIDTH, FigureSpec, panel, panel_figure
from tuckerl.reports.inspect import cells
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.styles import BLUE
from tuckerl.reports.text import counted, number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray

_LEFT, _SIDE = 0.62, 3.4  # inches


def draw_optimum(inspection: Inspection) -> Figure:
    """Draw both over the grid, in the same colours; without a layout, the one over the other."""
    return _draw_points(inspection) if inspection.layout is None else _draw_maps(inspection, inspection.layout)


def _draw_maps(inspection: Inspection, layout: Layout) -> Figure:
    learned, optimum = inspection.known[0], inspection.optimum
    room = cells.room_for(layout, width=(WIDTH - _LEFT - 1.7) / 2)
    figure = Figure(figsize=(WIDTH, room.height + cells.ABOVE + cells.BELOW))
    norm = cells.scale(np.concatenate([learned, optimum]))
    for place, (shown, title) in enumerate(((learned, "learned, agent 0: max Q(s, a)"), (optimum, "optimal: V*(s)"))):
        left = _LEFT + place * max(room.width + 0.6, 2.6)
        axes = panel(figure, left, cells.BELOW, room.width, room.height)
        colours = cells.draw_cells(axes, shown, layout, inspection.walls, norm, room)
        axes.set_title(title, loc="left")
        if place == 0:
            key = cells.key_of_cells(inspection.walls, np.isnan(shown), "agent 0 prefers nothing")
            cells.legend_below(axes, room, key, 2)
        else:
            cells.colour_bar(axes, colours, "state value")
    return figure


def _draw_points(inspection: Inspection) -> Figure:
    learned, optimum = inspection.known[0], inspection.optimum
    figure, axes = panel_figure(0.8, 0.5, _SIDE, _SIDE, 0.3)
    norm = cells.scale(np.concatenate([learned, optimum]))
    low, high = norm.vmin or 0.0, norm.vmax or 0.0
    axes.plot([low, high], [low, high], color="0.6", linewidth=0.9)
    look = {"linestyle": "none", "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0, "color": BLUE}
    axes.plot(optimum, learned, **look)  # type: ignore[arg-type]  # keywords of several types
    axes.set_xlabel("optimal: V*(s)")
    axes.set_title("learned, agent 0: max Q(s, a)", loc="left")
    return figure


def gaps(inspection: Inspection) -> FloatArray:
    """Return how far the values that agent 0 has learned are from the optimal ones, where it prefers something."""
    both: FloatArray = np.abs(inspection.optimum - inspection.known[0])
    return both[np.isfinite(both)]


def _caption(inspection: Inspection) -> str:
    found = gaps(inspection)
    if inspection.layout is None:
        first = "Each point is a state in which agent 0 prefers something; on the line, its value is the optimal one"
    else:
        first = "Left what agent 0 has learned, right the optimal values of the problem, in the same colours"
    words = [first, "The optimal values are computed from the problem's transitions, with the learner's discount"]
    if found.size:
        mean, most = number(float(found.mean())), number(float(found.max()))
        words.append(
            f"In the {counted(found.size, 'state')} where agent 0 prefers something, the two differ by {mean} on the "
            f"average, and by {most} at most"
        )
    return ". ".join(words) + "."


def _alt(inspection: Inspection) -> str:
    optimum, most = inspection.optimum, number(float(gaps(inspection).max(initial=0.0)))
    kind = "Points, learned over optimal values" if inspection.layout is None else "Two grids coloured by state value"
    if not np.isfinite(optimum).any():
        return f"{kind}; no state has an optimal value."
    best = int(np.nanargmax(optimum))
    where = cells.where(best, inspection.layout)
    return (
        f"{kind}. The highest optimal value is {number(float(optimum[best]))}, in {where}; they differ by up to {most}."
    )


OPTIMUM = FigureSpec(
    Inspection,
    FigureText("optimum", "Learned and optimal values"),
    draw_optimum,
    _caption,
    _alt,
    applies=lambda one: one.optimal is not None,
)
