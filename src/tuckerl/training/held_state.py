"""What a file holds of a learner's state, checked; nothing goes on from it yet."""

from typing import Any, NamedTuple

import numpy as np

from tuckerl.errors import SavedFileError
from tuckerl.generalization.step import HeldStep
from tuckerl.saved_arrays import SavedArrays
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


def is_seen(mask: BoolArray) -> bool:
    """Return whether a mask is learned from what an environment gives, as the problem's own is not."""
    return mask.size > 0 and mask.flags.writeable


def read_streams(arrays: SavedArrays, n_agents: int) -> tuple[Stream, ...]:
    """Return each agent's stream from a file.

    Raises
    ------
    SavedFileError
        If there are others, or one is zero and would stay so.
    """
    streams = arrays.take("streams", np.uint64, (n_agents, 4))
    if not streams.any(axis=1).all():
        raise SavedFileError("streams of random numbers must not be zero")
    return tuple(streams)


def read_weights(arrays: SavedArrays, step: HeldStep | None, n_actions: int) -> tuple[FloatArray, int]:
    """Return the weights of actions from a file, (A,), and after how many windows they are in force.

    Raises
    ------
    SavedFileError
        If they are not those of the latest window.
    """
    weights, in_force, n_windows = arrays.take("weights", np.float64, (n_actions,)), np.ones(n_actions), 0
    if step is not None and step.history.episode.size:
        in_force, n_windows = step.history.weights[-1], step.history.episode.size
    if not np.array_equal(weights, in_force):
        raise SavedFileError("the weights of actions must be those of the latest window")
    return weights, n_windows


def read_mask(arrays: SavedArrays, shape: tuple[int, ...], n_actions: int) -> BoolArray:
    """Return an agent's mask (S, A) from a file, of an agent that has the first `n_actions` actions.

    Raises
    ------
    SavedFileError
        If nothing may be done in a state, or something that the agent cannot do.
    """
    mask: BoolArray = arrays.take("action_mask", np.bool_, shape)
    if not mask.any(axis=1).all() or mask[:, n_actions:].any():
        raise SavedFileError("an action mask must allow an action in every state, and none that does not exist")
    return mask
