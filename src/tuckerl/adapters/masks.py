"""Reads action masks in all the forms in which environments give them.

Gymnasium's environments put a mask into ``info["action_mask"]``, as ``Taxi`` does. PettingZoo's put it there, or into
the observation: ``{"observation": ..., "action_mask": ...}`` in a ``Dict`` space of exactly these keys. A mask has one
entry for each action of a ``Discrete`` space, in order, 1 or True where the action may be taken. For a ``Tuple`` of
such spaces it is a tuple of masks, as the space's ``sample`` takes them, None where a part is free.
A mask that allows nothing allows everything, as in :class:`~tuckerl.problems.mdp.TabularMDP`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import Space, spaces

from tuckerl.checks import refuse_mask
from tuckerl.errors import ObservationError, SpaceError
from tuckerl.types import BoolArray

MASK = "action_mask"
MASK_IS_LATE = (
    f"an environment with action masks must give one in its reset, too, where all actions may be taken: its first "
    f"info had no {MASK!r}"
)
_KEYS = {"observation", MASK}


def observation_part(space: Space[Any]) -> Space[Any]:
    """Return the space of observations without the mask that may be part of them."""
    if isinstance(space, spaces.Dict) and set(space.spaces) == _KEYS:
        return space["observation"]
    return space


class MaskReader:
    """Separates what an environment returns into the observation and the action mask.

    Parameters
    ----------
    observation_space, action_space : gymnasium.Space
        As the environment declares them.

    Attributes
    ----------
    observation_space : gymnasium.Space
        What is left to observe: :func:`observation_part`.

    Raises
    ------
    SpaceError
        If the observations hold masks and the actions are neither Discrete nor a Tuple of Discrete.

    Examples
    --------
    >>> from gymnasium.spaces import Discrete
    >>> from tuckerl.adapters.masks import MaskReader
    >>> read = MaskReader(Discrete(500), Discrete(3))
    >>> read(17, {"action_mask": [1, 0, 1]})
    (17, array([ True, False,  True]))
    >>> read(17, {})
    (17, None)
    """

    def __init__(self, observation_space: Space[Any], action_space: Space[Any]) -> None:
        self.observation_space = observation_part(observation_space)
        self.action_space = action_space
        self._in_observation = self.observation_space is not observation_space
        self._joint = isinstance(action_space, spaces.Tuple)
        self._sizes = _sizes(action_space)
        if self._in_observation:
            self._check_maskable()

    def part(self, observation: Any) -> Any:
        """Return an observation, or a batch of them, without the mask that may lie beside it."""
        if self._in_observation and isinstance(observation, Mapping) and "observation" in observation:
            return observation["observation"]
        return observation

    def __call__(self, observation: Any, info: Mapping[str, Any]) -> tuple[Any, BoolArray | None]:
        """Return the observation without its mask, and the mask.

        Parameters
        ----------
        observation : Any
            An element of the environment's observation space.
        info : mapping
            What came with it; a mask in the observation goes before one in here.

        Returns
        -------
        observation : Any
            An element of :attr:`observation_space`.
        mask : (A,) bool, or None
            A new array, True where an action may be taken, at least once; None if all may because no mask was given.
            Where actions are a Tuple, A counts the joint ones, numbered in C order.

        Raises
        ------
        ObservationError
            If a mask has another length or other entries than it should, or is missing in the observation.
        SpaceError
            If there is a mask and the actions are neither Discrete nor a Tuple of Discrete.
        """
        given = info.get(MASK)
        if self._in_observation:
            if not isinstance(observation, Mapping) or not observation.keys() >= _KEYS:
                raise ObservationError(
                    f"an observation must be a dict of 'observation' and '{MASK}', as its space says; "
                    f"got {observation!r}"
                )
            observation, given = observation["observation"], observation[MASK]
        return observation, None if given is None else self._read(given)

    def _read(self, given: Any) -> BoolArray | None:
        self._check_maskable()
        if not self._joint:
            return _as_mask(given, self._sizes[0])
        if not isinstance(given, (tuple, list)) or len(given) != len(self._sizes):
            raise ObservationError(
                f"the action mask of {self.action_space} must be a tuple of {len(self._sizes)} masks; got {given!r}"
            )
        if all(part is None for part in given):
            return None
        mask = np.ones(1, dtype=np.bool_)
        for part, size in zip(given, self._sizes, strict=True):
            own = np.ones(size, dtype=np.bool_) if part is None else _as_mask(part, size)
            mask = np.logical_and.outer(mask, own).reshape(-1)  # C order: the last part's action counts ones
        return mask

    def _check_maskable(self) -> None:
        if not self._sizes:
            raise SpaceError(
                f"action masks must belong to a Discrete action space or a Tuple of them; got one for "
                f"{self.action_space}: leave the mask out, or number the actions by a Discrete space"
            )


def _sizes(space: Space[Any]) -> tuple[int, ...]:
    """Return how many actions each part of a space has; nothing if its actions cannot be masked."""
    parts: tuple[Any, ...] = space.spaces if isinstance(space, spaces.Tuple) else (space,)
    if not all(isinstance(part, spaces.Discrete) for part in parts):
        return ()
    return tuple(int(part.n) for part in parts)


def _as_mask(given: Any, size: int) -> BoolArray:
    refuse_mask("an action mask", given)
    try:
        entries = np.asarray(given)
    except ValueError:  # rows of several lengths
        entries = np.empty(())
    if entries.shape != (size,) or entries.dtype.kind not in "biuf":
        raise ObservationError(
            f"an action mask must be a row of {size} entries, 1 where an action may be taken and 0 where not; "
            f"got {given!r}"
        )
    mask: BoolArray = entries.astype(np.bool_)  # a copy, whatever came
    if entries.dtype.kind != "b" and (entries != mask).any():
        raise ObservationError(f"the entries of an action mask must be 0 or 1; got {given!r}")
    if not mask.any():
        mask[:] = True
    return mask
