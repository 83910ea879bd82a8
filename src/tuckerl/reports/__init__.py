"""Figures and the HTML page: a summary in, a picture out.

To add a figure, write its file with a :class:`~tuckerl.reports.picture.Picture` in it and list that in ``figures.py``.
"""

from tuckerl.reports.compare_report import write_comparison
from tuckerl.reports.report import write_report

__all__ = ["write_comparison", "write_report"]
