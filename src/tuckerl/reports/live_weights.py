"""Action weights (omega) to be explored: those of every variant, and which agent its windows were copied from."""

import math
from itertools import cycle
from typing import Any

import numpy as np

from tuckerl.reports.figure import Columns, Live
from tuckerl.reports.lines import Line, looks_of, rounded
from tuckerl.reports.styles import ACTION_STYLES, LineStyle
from tuckerl.studies.figure_text import WeightText
from tuckerl.studies.summary import Summary

_LOOKS = [
    *ACTION_STYLES,
    *(LineStyle(one.colour, dash, "", 1.4) for dash in ("dashed", "dotted", "dashdot") for one in ACTION_STYLES),
]


def weight_columns(summary: Summary, text: WeightText) -> Columns:
    """Return the weights of all variants, a row for each window and action."""
    rows = [
        (course.variant, episode, action, *numbers, course.n_runs)
        for course in summary.weights
        for action, band in zip(text.actions, course.bands, strict=True)
        for episode, *numbers in zip(course.episode.tolist(), *map(rounded, band), strict=True)
    ]
    names = ("variant", "episode", "action", "mean", "low", "high", "runs")
    return dict(zip(names, zip(*rows, strict=True) if rows else [()] * len(names), strict=True))


def live_weights(summary: Summary, text: WeightText) -> Live | None:
    """Return the weights for a page, the T-version with one agent first; None where no window was finished."""
    courses = {course.variant: course for course in summary.weights if course.episode.size}
    if not courses:
        return None
    first = f"{summary.scenario.algorithm.t_version}-1"
    names = sorted(courses, key=lambda name: name != first)
    agents = [f"agent {agent}" for agent in range(max(len(one.chosen) for one in courses.values()))]
    weights, copied = {}, {}
    for name, course in courses.items():
        every = np.arange(course.episode.size)
        lines = zip(text.actions, course.bands, strict=True)
        weights[name] = [Line(action, band, course.n_runs).rounded(every) for action, band in lines]
        if len(course.chosen) > 1:
            parts = zip(agents, course.chosen, strict=False)
            copied[name] = [[agent, rounded(part), None, None, course.n_runs] for agent, part in parts]
    n_actions = len(text.actions)
    level = 1 / math.sqrt(n_actions)
    content: dict[str, Any] = {
        "title": text.title,
        "x": {name: courses[name].episode.tolist() for name in names},
        "xLabel": "episodes finished",
        "xOne": "episode",
        "choose": {"label": "Variant", "names": names},
        "looks": looks_of({**dict(zip(agents, cycle(_LOOKS))), **dict(zip(text.actions, cycle(_LOOKS)))}),
        "panels": [
            {
                "labels": {"": "action weight ω"},
                "lines": weights,
                "reference": {"value": level, "label": f"constant control, 1/√{n_actions} = {level:.3g}"},
            },
            {"labels": {"": "part of the runs in which it is copied"}, "lines": copied},
        ],
        "note": "Shaded: pointwise 95 % interval of the mean over runs. Press a name to hide or show its line.",
    }
    caption = (
        "What the learning rate is multiplied by for each action, as set by the tensor step after each window, in the "
        "mean over runs. During the first window every weight is 1. Squares of the weights sum to 1: their root mean "
        f"square is always that of the constant control, dotted, 1/√{n_actions} = {level:.3g}."
    )
    return Live("lines", content, caption)
