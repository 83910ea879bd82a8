"""The optimal values beside those that were learned."""

import numpy as np
from matplotlib.figure import Figure

from tuckerl.reports.figure import WIDTH, FigureSpec
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.maps import Map, draw_maps, scale, where, with_legend
from tuckerl.reports.styles import BLUE
from tuckerl.reports.text import counted, number
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray

_TITLES = ("learned, agent 0: max Q(s, a)", "optimal: V*(s)")


def draw_optimum(inspection: Inspection) -> Figure:
    """Draw both over the grid, in the same colours; without a layout, the one over the other."""
    both = (inspection.known[0], inspection.optimum)
    norm = scale(np.concatenate(both))
    if inspection.layout is not None:
        maps = [Map(both[0], norm, _TITLES[0]), Map(both[1], norm, _TITLES[1], "state value")]
        drawn, _, key = draw_maps(inspection, maps, "agent 0 prefers nothing")
        return with_legend(drawn, key)
    figure = Figure(figsize=(WIDTH, 4.2), layout="compressed")
    axes = figure.subplots(subplot_kw={"box_aspect": 1})
    ends = [norm.vmin or 0.0, norm.vmax or 0.0]
    axes.plot(ends, ends, color="0.6", linewidth=0.9)
    axes.plot(both[1], both[0], linestyle="none", marker="o", markersize=3.0, markeredgewidth=0.0, color=BLUE)
    axes.set_xlabel(_TITLES[1])
    axes.set_title(_TITLES[0], loc="left")
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
    place = where(best, inspection.layout)
    value = number(float(optimum[best]))
    return f"{kind}. The highest optimal value is {value}, in {place}; they differ by up to {most}."


OPTIMUM = FigureSpec(
    Inspection,
    FigureText("optimum", "Learned and optimal values"),
    draw_optimum,
    _caption,
    _alt,
    applies=lambda one: one.optimal is not None,
)
