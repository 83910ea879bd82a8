"""Two agents of opposite interests: one wins if both show the same side of a coin, the other if they do not."""

from typing import Any

import numpy as np
import pettingzoo
from gymnasium import spaces

from tests.adapters.parallel_worlds import World

ID = "tuckerl-tests/Pennies-v0"
WEIGHED = "tuckerl-tests/WeighedPennies-v0"
AGENTS = ("same", "other")


class Pennies(World):
    """Five throws; each sees their number."""

    def __init__(self) -> None:
        super().__init__(
            {agent: spaces.Discrete(6) for agent in AGENTS}, {agent: spaces.Discrete(2) for agent in AGENTS}
        )

    def observe(self, agent: str) -> Any:
        return np.int64(self.clock)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        won = 1.0 if actions["same"] == actions["other"] else -1.0
        return {"same": won, "other": -won}, set(AGENTS) if self.clock == 5 else set(), set()


class WeighedPennies(Pennies):
    """Each sees the number as a Box."""

    def __init__(self) -> None:
        super().__init__()
        self.observation_spaces = {agent: spaces.Box(0.0, 9.0, (1,)) for agent in AGENTS}

    def observe(self, agent: str) -> Any:
        return np.array([self.clock], np.float32)


def parallel_env(max_cycles: int) -> Pennies:
    return Pennies()


def weighed_env(max_cycles: int) -> WeighedPennies:
    return WeighedPennies()


pettingzoo.register("parallel", ID, entry_point="tests.cli.pennies_world:parallel_env", max_cycles=5)
pettingzoo.register("parallel", WEIGHED, entry_point="tests.cli.pennies_world:weighed_env", max_cycles=5)
