"""More than one way to look inside: figures and a page of what a learner, or a tensor of Q-tables, holds.

To add a figure, write its file with a :class:`~tuckerl.reports.inspect.view.View` in it and list that in ``views.py``.
"""

from tuckerl.reports.inspect.content import Inspection, Loadings
from tuckerl.reports.inspect.learner import inspect_learner
from tuckerl.reports.inspect.page import inspection_figures, write_inspection
from tuckerl.reports.inspect.tensor import inspect_tensor

__all__ = ["Inspection", "Loadings", "inspect_learner", "inspect_tensor", "inspection_figures", "write_inspection"]
