"""All figures of the report. To add one, write its file and list it here.

Two are no pictures of a summary and are drawn where there is something to draw: ``gain_figure`` and
``sensitivity_figure``.
"""

from tuckerl.reports.fig9 import FIG9
from tuckerl.reports.fig10 import FIG10
from tuckerl.reports.fig11 import FIG11
from tuckerl.reports.fig13 import FIG13
from tuckerl.reports.omega import OMEGA_DYNA_MAZE
from tuckerl.reports.omega_map import OMEGA_CART_POLE, OMEGA_ROBOT_RESCUE
from tuckerl.reports.picture import Picture

PICTURES: tuple[Picture, ...] = (
    FIG9,
    OMEGA_CART_POLE,
    FIG10,
    FIG11,
    OMEGA_DYNA_MAZE,
    FIG13,
    OMEGA_ROBOT_RESCUE,
)
