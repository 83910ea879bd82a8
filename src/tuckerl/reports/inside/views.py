"""All figures of the inside, in the order of the page. To add one, write its file and list it here."""

from tuckerl.reports.inside.agents import AGENTS
from tuckerl.reports.inside.curve import CURVE
from tuckerl.reports.inside.loadings import LOADINGS
from tuckerl.reports.inside.plain import PLAIN
from tuckerl.reports.inside.policy import POLICY
from tuckerl.reports.inside.state_loadings import STATE_LOADINGS
from tuckerl.reports.inside.view import View
from tuckerl.reports.inside.weights import WEIGHTS
from tuckerl.reports.inside.windows import COPIED, FIT

VIEWS: tuple[View, ...] = (CURVE, POLICY, PLAIN, AGENTS, WEIGHTS, COPIED, FIT, STATE_LOADINGS, LOADINGS)
