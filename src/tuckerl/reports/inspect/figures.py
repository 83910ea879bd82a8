"""The figures of an inspection, in the order of the page. To add one, write its file and list it here."""

from typing import Any

from tuckerl.registers import load
from tuckerl.reports.figure import FigureSpec

_LISTED = (
    "tuckerl.reports.inspect.curve:CURVE",
    "tuckerl.reports.inspect.policy:POLICY",
    "tuckerl.reports.inspect.policy:PLAIN",
    "tuckerl.reports.inspect.optimum:OPTIMUM",
    "tuckerl.reports.inspect.agents:AGENTS",
    "tuckerl.reports.inspect.windows:WEIGHTS",
    "tuckerl.reports.inspect.windows:COPIED",
    "tuckerl.reports.inspect.windows:FIT",
    "tuckerl.reports.inspect.loadings:STATE_LOADINGS",
    "tuckerl.reports.inspect.loadings:LOADINGS",
)

FIGURES: tuple[FigureSpec[Any], ...] = tuple(map(load, _LISTED))
