"""Inspecting what a learner, or a tensor of Q-tables, holds: figures and a page."""

from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.learner import inspect_learner
from tuckerl.reports.inspect.page import inspection_figures, write_inspection
from tuckerl.reports.inspect.tensor import inspect_tensor

__all__ = ["Inspection", "inspect_learner", "inspect_tensor", "inspection_figures", "write_inspection"]
