"""Bins of a Box by the quantiles of what random play observes."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete

from tuckerl.adapters.making import maker_of
from tuckerl.checks import check_int
from tuckerl.errors import ObservationError, ParameterTypeError, SpaceError
from tuckerl.rng import child, seed_sequence
from tuckerl.spaces.bins import MOST_BINS, bin_entries
from tuckerl.types import FloatArray, Seed


def quantile_edges(
    env: str | gymnasium.Env[Any, Any] | Callable[[], gymnasium.Env[Any, Any]],
    bins: int | Sequence[int],
    *,
    steps: int = 10_000,
    seed: Seed = 0,
) -> tuple[FloatArray, ...]:
    """Play at random and return the edges between which what was observed falls evenly.

    Parameters
    ----------
    env
        A Gymnasium environment that observes a Box: its id, an instance, or a callable that makes one. An instance is
        reset and left where the last step led, its action space reseeded; one that is made here is closed.
    bins : int or sequence of int
        How many bins each dimension gets, or one number for each, in C order.
    steps : int
        How many random actions to take; the observations after a reset count too.
    seed : int, SeedSequence or None
        Of the environment and of the actions.

    Returns
    -------
    tuple of float64 arrays
        The inner edges of each dimension, for ``bins=``. Equal quantiles become one edge, and an edge that nothing
        lies below is left out: a dimension with few different values gets fewer bins, a constant one a single bin.

    Raises
    ------
    SpaceError
        If the environment does not observe a Box.
    ObservationError
        If an observation is not finite or has another shape than its space.
    UnknownNameError
        If no environment has this id.
    ParameterError, ParameterTypeError
        If a number is impossible or `env` is something else.

    Examples
    --------
    >>> import tuckerl
    >>> edges = tuckerl.quantile_edges("CartPole-v1", 4)
    >>> [len(e) for e in edges]
    [3, 3, 3, 3]
    """
    check_int("steps", steps, 1)
    sequence = seed_sequence(seed)
    make = maker_of(env)
    made: Any = env if make is None else make()
    if not isinstance(made, gymnasium.Env):
        raise ParameterTypeError(
            f"env must be a Gymnasium environment, the id of one, or a callable that makes one; got {made!r}"
        )
    try:
        space = made.observation_space
        if not isinstance(space, Box):
            raise SpaceError(f"quantile_edges needs an environment that observes a Box; {made} observes {space}")
        counts = [
            check_int(f"bins of dimension {i}", count, 1, MOST_BINS)
            for i, count in enumerate(bin_entries(bins, math.prod(space.shape), "observation"))
        ]
        seen = _random_play(made, space, steps, sequence)
    finally:
        if make is not None:
            made.close()
    edges = []
    for count, values in zip(counts, seen.T, strict=True):
        quantiles = np.unique(np.quantile(values, np.arange(1, count) / count))
        edges.append(quantiles[quantiles > values.min()])
    return tuple(edges)


def _random_play(env: gymnasium.Env[Any, Any], space: Box, steps: int, sequence: np.random.SeedSequence) -> FloatArray:
    """Return what is observed, (observations, dimensions)."""
    env_seed, action_seed = (int(child(sequence, i).generate_state(1)[0]) for i in range(2))
    env.action_space.seed(action_seed)
    observation, info = env.reset(seed=env_seed)
    seen = [observation]
    for _ in range(steps):
        masked = isinstance(env.action_space, Discrete) and "action_mask" in info
        action = env.action_space.sample(np.asarray(info["action_mask"], np.int8) if masked else None)
        observation, _, terminated, truncated, info = env.step(action)
        seen.append(observation)
        if terminated or truncated:
            observation, info = env.reset()
            seen.append(observation)
    for observation in seen:
        if np.shape(observation) != space.shape:
            raise ObservationError(f"observation must have the shape of {space}; got shape {np.shape(observation)}")
    values = np.array(seen, dtype=np.float64).reshape(len(seen), -1)
    if not np.isfinite(values).all():
        worst = seen[int(np.argmin(np.isfinite(values).all(axis=1)))]
        raise ObservationError(f"quantiles need finite observations; got {worst!r}: give edges instead")
    return values
