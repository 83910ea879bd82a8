"""What a file holds of a learner's state, checked; nothing goes on from it yet."""

from typing import Any, NamedTuple

import numpy as np

from tuckerl.generalization.step import HeldStep
from tuckerl.types import BoolArray, FloatArray, IntArray, Stream


class HeldAgent(NamedTuple):
    """What a file holds of one agent."""

    log: dict[str, np.ndarray]
    mask: BoolArray | None  # (S, A), as far as it was seen; None where it is the problem's, or there is none
    declared: dict[str, Any]


class HeldState(NamedTuple):
    """What a file holds of a learner's state."""

    q: FloatArray  # (N, S, A)
    weights: FloatArray  # (A,)
    history: dict[str, np.ndarray]
    trajectory: IntArray  # (N, T)
    streams: tuple[Stream, ...]
    step: HeldStep | None
    agents: tuple[HeldAgent, ...]
    past: dict[str, FloatArray]  # of the scheduled numbers, by name
    diverged_at: int | None

    @property
    def declared(self) -> tuple[dict[str, Any], ...]:
        """What each agent declares."""
        return tuple(agent.declared for agent in self.agents)
