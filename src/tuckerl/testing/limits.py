"""How much of a problem is played."""

from tuckerl.problems.parts import STEP_CAP

LONGEST = STEP_CAP
"""Steps of random play in which an episode without a time limit must end: learners cut it off there."""

BUDGET = 20_000
"""Steps of all episodes together, after which no further one begins."""
