"""Reads action masks in all the forms in which environments give them.

Gymnasium's environments put a mask into ``info["action_mask"]``, as ``Taxi`` does. PettingZoo's put it there, or into
the observation: ``{"observation": ..., "action_mask": ...}`` in a ``Dict`` space of exactly these keys. A mask has one
entry for each action of a ``Discrete`` space, in order, 1 or True where the action may be taken. For a ``Tuple`` of
such spaces it is a tuple of masks, as the space's ``sample`` takes them, None where a part is free. For a
``MultiDiscrete`` or ``MultiBinary`` space it is such a tuple; or the masks of all dimensions one after the other in one
row, as sb3-contrib has them; or a row with an entry for each joint action, where that has another length.
While learning, a mask that allows nothing allows everything, as in :class:`~tuckerl.problems.mdp.TabularMDP`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import Space, spaces

from tuckerl.checks import shown
from tuckerl.errors import ObservationError, SpaceError
from tuckerl.problems.action_masks import Batch, as_mask, freed, joint_mask, masks_in_row, masks_of_parts
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
        If the observations hold masks, and the actions are of a space that has none.

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
        self._sizes = _sizes(action_space)
        if self._in_observation:
            self._check_maskable()

    def take_apart(self, observation: Any) -> tuple[Any, Any]:
        """Return an observation, or a batch of them, without the mask that may lie beside it, and that mask or None."""
        if self._in_observation and isinstance(observation, Mapping) and "observation" in observation:
            return observation["observation"], observation.get(MASK)
        return observation, None

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
            Where actions have parts, A counts the joint ones, numbered in C order.

        Raises
        ------
        ObservationError
            If a mask has another length or other entries than it should, or is missing in the observation.
        SpaceError
            If there is a mask, and the actions are of a space that has none.
        """
        given = info.get(MASK)
        if self._in_observation:
            if not isinstance(observation, Mapping) or not observation.keys() >= _KEYS:
                raise ObservationError(
                    f"an observation must be a dict of 'observation' and '{MASK}', as its space says; "
                    f"got {shown(observation)}"
                )
            observation, given = observation["observation"], observation[MASK]
        parts = self._parts(given, ())
        return observation, None if parts is None else joint_mask([freed(part) for part in parts])

    def allowed(self, given: Any, batch: Batch) -> BoolArray | None:
        """Return as (*batch, A) which actions a mask allows, perhaps none; None where nothing was given.

        Raises
        ------
        ObservationError, SpaceError
            As reading an environment's mask does.
        """
        parts = self._parts(given, batch)
        return None if parts is None else joint_mask(parts)

    def _parts(self, given: Any, batch: Batch) -> list[BoolArray] | None:
        """Return the mask of each part of an action; one that has no parts is one."""
        if given is None or (isinstance(given, (tuple, list)) and all(part is None for part in given)):
            return None
        self._check_maskable()
        if isinstance(self.action_space, spaces.Discrete):
            return [as_mask(given, self._sizes[0], batch)]
        if isinstance(self.action_space, spaces.Tuple) or _are_masks(given):
            return masks_of_parts(given, self._sizes, batch)
        return masks_in_row(given, self._sizes, batch)

    def _check_maskable(self) -> None:
        if not self._sizes:
            raise SpaceError(
                f"action masks must belong to an action space that is Discrete, MultiDiscrete, MultiBinary or a Tuple "
                f"of Discrete; got one for {self.action_space}: leave the mask out, or number the actions by a Discrete"
            )


def _sizes(space: Space[Any]) -> tuple[int, ...]:
    """Return how many actions each part of a space has; nothing if its actions cannot be masked."""
    if isinstance(space, spaces.MultiDiscrete):
        return tuple(map(int, space.nvec.ravel()))
    if isinstance(space, spaces.MultiBinary):
        return (2,) * int(np.prod(space.shape))
    parts: tuple[Any, ...] = space.spaces if isinstance(space, spaces.Tuple) else (space,)
    if not all(isinstance(part, spaces.Discrete) for part in parts):
        return ()
    return tuple(int(part.n) for part in parts)


def _are_masks(given: Any) -> bool:
    """Return whether these are several masks and not the entries of one."""
    return isinstance(given, tuple) and any(part is None or np.iterable(part) for part in given)
