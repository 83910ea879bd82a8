"""The figures of studies, in the order in which pages show them. To add one, write its file and list it here."""

from typing import Any

from tuckerl.registers import load
from tuckerl.reports.figure import FigureSpec

_LISTED = (
    "tuckerl.reports.paths:PATHS",
    "tuckerl.reports.curves:CURVES",
    "tuckerl.reports.action_weights:WEIGHTS",
    "tuckerl.reports.ablation:ABLATION",
    "tuckerl.reports.sensitivity_figure:SENSITIVITY",
    "tuckerl.reports.curves:COMPARISON",
    "tuckerl.reports.curves:PROBLEM",
)

FIGURES: tuple[FigureSpec[Any], ...] = tuple(map(load, _LISTED))
