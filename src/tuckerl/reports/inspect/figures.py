"""The figures of an inspection, in the order of the page. To add one, write its file and list it here."""

from typing import Any

from tuckerl.reports.figure import FigureSpec
from tuckerl.reports.inspect.agents import AGENTS
from tuckerl.reports.inspect.curve import CURVE
from tuckerl.reports.inspect.loadings import LOADINGS
from tuckerl.reports.inspect.plain import PLAIN
from tuckerl.reports.inspect.policy import POLICY
from tuckerl.reports.inspect.state_loadings import STATE_LOADINGS
from tuckerl.reports.inspect.weights import WEIGHTS
from tuckerl.reports.inspect.windows import COPIED, FIT

FIGURES: tuple[FigureSpec[Any], ...] = (
    CURVE,
    POLICY,
    PLAIN,
    AGENTS,
    WEIGHTS,
    COPIED,
    FIT,
    STATE_LOADINGS,
    LOADINGS,
)
