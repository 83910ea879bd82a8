"""Curves to be explored: what ``scripts/lines.js`` draws, with every base and all the runs behind a mean."""

import base64
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tuckerl.reports.figure import Columns, Live
from tuckerl.reports.panels import Panels
from tuckerl.reports.styles import COLOUR_NAMES, LineStyle
from tuckerl.studies.statistics import Band
from tuckerl.studies.summary import Curve, paired_band
from tuckerl.types import FloatArray, IntArray

MOST_POINTS = 200  # of a line in a page
MOST_NUMBERS = 1_200_000  # of single runs in a figure, two bytes each: 10,000 runs of 100 points are all in a page
_LEVELS = 2**16 - 1


class Line(NamedTuple):
    """A line: the mean of `n` runs with its interval."""

    name: str
    band: Band
    n: int

    def rounded(self, points: IntArray) -> list[Any]:
        """Return the line at these points, as the script has it."""
        return [self.name, *(rounded(values[points]) for values in self.band), self.n]


def rounded(values: FloatArray) -> list[float | None]:
    """Return numbers with five digits, None where there is none."""
    return [float(f"{value:.5g}") if math.isfinite(value) else None for value in values.tolist()]


def looks_of(styles: Mapping[str, LineStyle]) -> dict[str, dict[str, Any]]:
    """Return how lines look, their colours by the names that the page's styles give them."""
    return {
        name: {"colour": COLOUR_NAMES[look.colour], "dash": look.dash, "width": look.width}
        for name, look in styles.items()
    }


def points_of(panels: Panels) -> IntArray:
    """Return the places of the points that a page has of each curve: all, or evenly chosen ones and the last."""
    n_points = panels.episode.size
    return np.unique(np.linspace(0, n_points - 1, min(n_points, MOST_POINTS)).round().astype(np.int64))


def curve_columns(panels: Panels) -> Columns:
    """Return the numbers of both panels, a row for each variant and point."""
    points = points_of(panels)
    columns: dict[str, list[object]] = {
        name: [] for name in ("variant", "episode", "mean", "low", "high", "runs", "gain", "gain_low", "gain_high")
    }
    for (name, band), gain, curve in zip(panels.totals.items(), panels.gains.values(), panels.curves, strict=True):
        numbers = [rounded(values[points]) for values in (*band, *gain)]
        rows = [[name] * points.size, panels.episode[points].tolist(), *numbers[:3], [curve.n_runs] * points.size]
        for column, values in zip(columns.values(), [*rows, *numbers[3:]], strict=True):
            column.extend(values)
    return columns


def live_curves(panels: Panels, title: str, most_numbers: int = MOST_NUMBERS) -> Live:
    """Return the curves for a page: above the variants' own, below their differences from a base that can be chosen."""
    points, curves = points_of(panels), panels.curves
    bases = {curve.variant: _gains(panels, curve, points) for curve in _bases(panels)}
    n_runs = most_numbers // (points.size * len(curves))
    looks = looks_of(panels.styles)
    content: dict[str, Any] = {
        "title": title,
        "x": {"": panels.episode[points].tolist()},
        "xLabel": "episodes",
        "xOne": "episode",
        "logs": panels.total,
        "choose": {"label": "Difference from", "names": list(bases)},
        "looks": looks,
        "panels": [
            {
                "labels": {"": panels.total},
                "whole": panels.counts_steps,
                "lines": {"": [Line(one.variant, one.band, one.n_runs).rounded(points) for one in curves]},
            },
            {
                "labels": {name: panels.gain_on(name) for name in bases},
                "whole": panels.counts_steps,
                "isDifference": True,
                "lines": bases,
            },
        ],
        "note": "Shaded: pointwise 95 % interval of the mean over runs. Press a name to hide or show its line.",
    }
    if any(curve.samples.runs.size > 1 for curve in curves):
        content["runs"] = {
            "sign": 1 if panels.larger_is_better else -1,
            "whole": panels.counts_steps,
            "label": f"In the columns: {panels.total}, {'at the end' if panels.is_cumulated else 'mean over episodes'}",
            "variants": [_runs(panels, curve, points, n_runs) for curve in curves],
        }
    return Live("lines", content)


def _bases(panels: Panels) -> list[Curve]:
    """Return what differences can be taken from: the first variant, and those without weights or with a control's."""
    first, *others = panels.curves
    plain = {
        one.name for one in panels.scenario.variants if one.tensor_step is None or one.tensor_step.weights != "paper"
    }
    return [first, *(curve for curve in others if curve.variant in plain and curve.samples.runs.size)]


def _gains(panels: Panels, base: Curve, points: IntArray) -> list[list[Any]]:
    """Return the lines of the lower panel with another base."""
    lines = []
    for curve in panels.curves:
        if curve is base:
            continue
        if base is panels.curves[0]:
            n = np.intersect1d(curve.samples.runs, base.samples.runs).size or min(curve.n_runs, base.n_runs)
            lines.append(Line(curve.variant, panels.gains[curve.variant], n).rounded(points))
        else:
            band, n = paired_band(curve.samples, base.samples)
            lines.append(Line(curve.variant, panels.in_favour(band), n).rounded(points))
    return lines


def _runs(panels: Panels, curve: Curve, points: IntArray, most: int) -> dict[str, Any]:
    """Return evenly chosen runs of a curve, each number rounded to one of the levels between the least and largest."""
    runs, values, _ = curve.samples
    kept = np.unique(np.linspace(0, runs.size - 1, min(runs.size, max(most, 1))).round().astype(np.int64))
    totals = values[:, -1] if panels.is_cumulated else values.mean(axis=1)
    shown = values[np.ix_(kept, points)]
    low = float(shown.min()) if shown.size else 0.0
    step = (float(shown.max()) - low) / _LEVELS if shown.size else 0.0
    codes = np.round((shown - low) / (step or 1.0)).astype("<u2")
    return {
        "name": curve.variant,
        "numbers": runs[kept].tolist(),
        "left_out": runs.size - kept.size,
        "totals": rounded(totals[kept]),
        "low": low,
        "step": step,
        "codes": base64.b64encode(codes.tobytes()).decode(),
    }
