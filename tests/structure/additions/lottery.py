"""A kind of problem: one state, and actions that pay 1 by chance (a bandit)."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import kernel
from tuckerl.problems.dynamics import register_dynamics
from tuckerl.problems.problem import Arrays, Header, Problem
from tuckerl.problems.worlds import World
from tuckerl.rng import uniform
from tuckerl.saved_arrays import SavedArrays
from tuckerl.types import FloatArray, Stream


class LotteryArrays(NamedTuple):
    """What kernels read of a lottery."""

    chances: FloatArray  # (A,) that an action pays 1
    max_episode_steps: int


@kernel
def reset(world: LotteryArrays, rng: Stream) -> int:
    """Return the only state; `rng` is (4,) uint64."""
    return 0


@kernel
def step(world: LotteryArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Return the state, 1 with the chance in ``world.chances`` (A,), and False; `rng` is (4,) uint64."""
    return 0, 1.0 if uniform(rng) < world.chances[action] else 0.0, False


register_dynamics(LotteryArrays, reset=reset, step=step)


class Lottery(Problem):
    """One state, and actions that pay 1 by chance.

    Parameters
    ----------
    chances : (A,) float
    max_episode_steps : int
    """

    kind, title, how_played = "lottery", "lottery", "compiled lottery"
    is_data = True

    def __init__(self, chances: ArrayLike, max_episode_steps: int = 5) -> None:
        self.chances = np.array(chances, dtype=np.float64)
        super().__init__(1, self.chances.size, max_episode_steps=max_episode_steps)
        self._limit = max_episode_steps

    def world(self) -> World:
        """Return a world for one agent."""
        return World(LotteryArrays(self.chances, self._limit))

    def save(self) -> tuple[Header, Arrays]:
        """Return all of the problem."""
        return {"limit": self._limit}, {"chances": self.chances}

    @classmethod
    def restore(
        cls, header: Header, arrays: SavedArrays, given: Any, resolve: Callable[..., Problem], path: Path
    ) -> "Lottery":
        """Return the problem that `save` took apart."""
        return cls(arrays["chances"], header["limit"])
