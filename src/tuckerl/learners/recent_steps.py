"""The steps of an episode that an update still needs, for learners that wait before they learn from a step."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.saved_arrays import SavedArrays
from tuckerl.training.agent_arrays import Transition
from tuckerl.types import StateArray

MOST_STEPS = 1_000_000
"""How many steps may be waited for: that many take 16 MB for each agent."""

# A step and the reward that came after it: one record, as it is found in memory at once.
STEP = np.dtype([("reward", np.float64), ("state", np.uint32), ("action", np.uint32)], align=True)

PLACE, COUNT = 0, 1


class RecentSteps(NamedTuple):
    """One agent's latest N steps in a ring, which is empty between two episodes: so it is neither saved nor shared."""

    ring: NDArray[np.void]  # (N,) of STEP
    cursor: StateArray  # (2,) where the next step goes, and how many steps there are

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return nothing: what was waited for has been learned from, as this is called between two episodes."""
        return {}

    def set_arrays(self, arrays: SavedArrays) -> None:
        """Be as between two episodes, also in the middle of one that is broken off."""
        self.clear()

    def clear(self) -> None:
        """Forget all steps."""
        self.cursor[:] = 0


def no_steps(capacity: int) -> RecentSteps:
    """Return room for so many steps."""
    return RecentSteps(np.zeros(capacity, dtype=STEP), np.zeros(2, dtype=np.uint32))


@kernel
def keep_step(steps: RecentSteps, transition: Transition) -> int:
    """Put a step where it goes in ``steps.ring`` (N,), and return where that is; the cursor stays."""
    place = steps.cursor[PLACE]
    step = steps.ring[place]
    step["state"], step["action"], step["reward"] = transition.state, transition.action, transition.reward
    return int(place)
