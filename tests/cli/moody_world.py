"""A corridor that Python steps, and that does what a test tells it to in the middle: ``tests.cli.moody_world:...``."""

from collections.abc import Callable
from typing import Any

import gymnasium
from gymnasium.spaces import Discrete

ID = "tuckerl-tests/Moody-v0"


class Mood:
    """What happens after so many more steps."""

    left = -1
    act: Callable[[], None] | None = None


class Moody(gymnasium.Env[Any, Any]):
    """States 0 to `length`; action 1 leads to the right, where the episode ends, unless the floor is wet."""

    def __init__(self, length: int = 4) -> None:
        self.observation_space, self.action_space = Discrete(length + 1), Discrete(2)
        self._length, self._at = length, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self._at = 0
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        Mood.left -= 1
        if Mood.left == 0 and Mood.act is not None:
            Mood.act()
        slips = self.np_random.random() < 0.2
        self._at = max(0, self._at + (1 if action and not slips else -1))
        return self._at, -1.0, self._at == self._length, False, {}


gymnasium.register(ID, entry_point="tests.cli.moody_world:Moody", max_episode_steps=50)
