"""Which places in the change logs are whose: those of episodes, and those of tables that were shared between two.

The logs begin anew after as many episodes as something reads of them (`TensorStep.logged_episodes`). Where agents
share more often than that, what they go on with takes a place of its own behind the episode before, so that the rows
after each episode can be rebuilt.
"""

import numpy as np

from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.types import IntArray


class LogWindow:
    """The places of a learner's change logs."""

    def __init__(self, step: TensorStep, n_agents: int) -> None:
        self.length = step.logged_episodes(n_agents)  # in episodes; 0 where nothing is logged
        shares_within = n_agents > 1 and step.share_interval < self.length
        self._share_every = step.share_interval if shares_within else max(1, self.length)
        self._of_windows: dict[tuple[int, int], IntArray] = {}

    @property
    def n_places(self) -> int:
        """How many there are."""
        return self.length + max(0, self.length // self._share_every - 1) if self.length else 0

    def is_end(self, episode: int) -> bool:
        """Return whether the logs begin anew after so many episodes."""
        return self.length > 0 and episode % self.length == 0

    def is_shared_within(self, episode: int) -> bool:
        """Return whether what is shared after so many episodes takes a place in the logs."""
        return not self.is_end(episode) and episode % self._share_every == 0

    def place(self, episode: int) -> int:
        """Return the place of an episode, counted from 1."""
        before = (episode - 1) % self.length
        return before + before // self._share_every

    def of_window(self, episode: int, every: int) -> IntArray:
        """Return the places of the latest `every` episodes up to this one, (every,), which are not to be changed."""
        key = episode % self.length, every
        if key not in self._of_windows:
            window = range(episode - every + 1, episode + 1)
            self._of_windows[key] = np.array([self.place(one) for one in window], dtype=np.int64)
        return self._of_windows[key]

    def n_filled(self, finished: int, stepped: int) -> int:
        """Return how many places an agent has filled that has `finished` episodes, `stepped` of them with their steps.

        An agent may be ahead of others, for which the latest step waits.
        """
        begun = stepped - stepped % self.length if self.length else stepped
        return finished - begun + (stepped - begun) // self._share_every
