"""An environment whose episodes can be told beforehand: a Gymnasium environment that is stepped in Python."""

from collections.abc import Callable
from typing import Any

import gymnasium


class Counting(gymnasium.Env[Any, Any]):
    """Episode e (from 0) takes e % 3 + 1 steps, whatever is done, and its return is e + `more`."""

    observation_space = gymnasium.spaces.Discrete(3)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, more: float = 0.0) -> None:
        self.more, self.episode, self.left = more, -1, 0
        self.is_tried_out = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        # Learners reset once more, to find mistakes before learning begins.
        self.episode += self.is_tried_out
        self.is_tried_out = True
        self.left = self.episode % 3 + 1
        return self.left - 1, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.left -= 1
        ended = self.left == 0
        return max(self.left - 1, 0), (self.episode + self.more) * ended, ended, False, {}


def countings() -> Callable[[], Counting]:
    """Return a maker: the first agent's returns are 0, 1, 2, ..., and the second's lie 10 higher."""
    made: list[Counting] = []

    def make() -> Counting:
        made.append(Counting(10.0 * len(made)))
        made[-1].is_tried_out = len(made) > 1  # only the first is looked at
        return made[-1]

    return make
