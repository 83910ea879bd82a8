"""All figures of the report. To add one, write its file and list it here."""

from tuckerl.reports.fig10 import FIG10
from tuckerl.reports.fig11 import FIG11
from tuckerl.reports.omega import OMEGA_DYNA_MAZE
from tuckerl.reports.picture import Picture

PICTURES: tuple[Picture, ...] = (
    FIG10,
    FIG11,
    OMEGA_DYNA_MAZE,
)
