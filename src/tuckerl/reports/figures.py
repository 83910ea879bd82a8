"""The figures of studies, in the order in which pages show them. To add one, write its file and list it here."""

from typing import Any

from tuckerl.reports.ablation_figure import ABLATION
from tuckerl.reports.comparison_figure import COMPARISON
from tuckerl.reports.curves import CURVES
from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.paths import PATHS
from tuckerl.reports.sensitivity_figure import SENSITIVITY
from tuckerl.reports.weight_lines import WEIGHT_LINES
from tuckerl.reports.weight_map import WEIGHT_MAP

FIGURES: tuple[FigureSpec[Any], ...] = (
    PATHS,
    CURVES,
    WEIGHT_LINES,
    WEIGHT_MAP,
    ABLATION,
    SENSITIVITY,
    COMPARISON,
)
