"""The curves for plotly.js: the same lines and colours as in the printed figure, with numbers on hover.

The figure is plain JSON: importing plotly's own classes would cost a second and add nothing to it.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from tuckerl.reports.panels import Panels
from tuckerl.reports.styles import PLOTLY_DASHES
from tuckerl.studies.statistics import Band
from tuckerl.types import FloatArray

_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"


def plotly_panels(panels: Panels) -> dict[str, Any]:
    """Return a figure of two panels as in :func:`tuckerl.reports.panels.draw_panels`: ``data`` and ``layout``."""
    data: list[dict[str, Any]] = []
    for lines, axis in ((panels.totals, ""), (panels.gains, "2")):
        for name, band in lines.items():
            data += _traces(panels, name, band, axis)
    grid = {"gridcolor": "#e6e6e6", "zeroline": False, "ticks": "outside", "automargin": True}
    counts = {**grid, "tickformat": ",d"}
    measured, mode = (counts, "tozero") if panels.counts_steps else (grid, "normal")
    layout = {
        "font": {"family": _FONT, "size": 13, "color": "#1a1a1a"},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "height": 720,
        "margin": {"l": 90, "r": 30, "t": 30, "b": 50},
        "hovermode": "x unified",
        "legend": {"orientation": "h", "y": -0.1, "yanchor": "top"},
        "xaxis": {**counts, "anchor": "y2", "range": [0, int(panels.episode[-1])], "title": {"text": "episodes"}},
        "yaxis": {**measured, "domain": [0.53, 1], "rangemode": mode, "title": _axis_title(panels.total)},
        "yaxis2": {**measured, "domain": [0, 0.47], "title": _axis_title(panels.gain)},
    }
    return {"data": data, "layout": layout}


def _traces(panels: Panels, name: str, band: Band, axis: str) -> Iterator[dict[str, Any]]:
    """Yield a variant's band and its line; the upper panel's line carries the legend for both panels."""
    look, episodes = panels.styles[name], panels.episode.tolist()
    shared = {"xaxis": "x", "yaxis": f"y{axis}", "legendgroup": name, "type": "scatter", "mode": "lines"}
    yield shared | {
        "x": episodes + episodes[::-1],
        "y": _numbers(band.high) + _numbers(band.low)[::-1],
        "fill": "toself",
        "fillcolor": _transparent(look.colour, 0.16 if look.marker else 0.07),
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    yield shared | {
        "x": episodes,
        "y": _numbers(band.mean),
        "name": _escaped(name),
        "line": {"color": look.colour, "dash": PLOTLY_DASHES[look.dash], "width": look.width * 1.2},
        "hovertemplate": "%{y:,.0f}" if panels.counts_steps else "%{y:,.4~g}",
        "showlegend": not axis,
    }


def _numbers(values: FloatArray) -> list[float | None]:
    return [round(float(value), 3) if np.isfinite(value) else None for value in values]


def _transparent(colour: str, share: float) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {share})"


def _axis_title(text: str) -> dict[str, Any]:
    # The unit goes to a second line: on a narrow screen one line is longer than its panel is high.
    return {"text": _escaped(text).replace(" (", "<br>("), "font": {"size": 12}, "standoff": 12}


def _escaped(text: str) -> str:
    # plotly.js reads a little HTML in names and titles.
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
