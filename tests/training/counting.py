"""An environment whose episodes can be told beforehand: a Gymnasium environment that is stepped in Python."""

from collections.abc import Callable
from typing import Any

import gymnasium


class Counting(gymnasium.Env[Any, Any]):
    """Episode e (from 0) takes e % 3 + 1 steps, whatever is done, and its return is e + 10 k for the k-th to begin."""

    observation_space = gymnasium.spaces.Discrete(3)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, resets: list[Any]) -> None:
        self.resets, self.more, self.episode, self.left = resets, 0.0, -1, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        # Learners reset the first once more, to find mistakes before learning begins.
        if self.episode < 0 and self.resets:
            self.more = 10.0 * (len(self.resets) - 1)
        self.episode += bool(self.resets)
        if self.episode <= 0:
            self.resets.append(seed)
        self.left = self.episode % 3 + 1
        return self.left - 1, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.left -= 1
        ended = self.left == 0
        return max(self.left - 1, 0), (self.episode + self.more) * ended, ended, False, {}


def countings() -> Callable[[], Counting]:
    """Return a maker: the first agent's returns are 0, 1, 2, ..., and the second's lie 10 higher."""
    resets: list[Any] = []
    return lambda: Counting(resets)
