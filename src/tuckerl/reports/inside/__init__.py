"""More than one way to look inside: figures and a page of what a learner, or a tensor of Q-tables, holds.

To add a figure, write its file with a :class:`~tuckerl.reports.inside.view.View` in it and list that in ``views.py``.
"""

from tuckerl.reports.inside.content import Inside, Loadings
from tuckerl.reports.inside.learner import inside_of_learner
from tuckerl.reports.inside.page import pictures_inside, write_inside
from tuckerl.reports.inside.tensor import inside_of_tensor

__all__ = ["Inside", "Loadings", "inside_of_learner", "inside_of_tensor", "pictures_inside", "write_inside"]
