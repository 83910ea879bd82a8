"""Checks for those who write a problem or a learner of their own: what is wrong, and how to correct it.

Both return None where all is well; call them in the tests of what they check.
"""

from tuckerl.testing.check_learner import check_learner
from tuckerl.testing.check_problem import check_problem

__all__ = ["check_learner", "check_problem"]
