"""Bins of a Box by the quantiles of what random play observes."""

import math
from collections.abc import Callable, Sequence
from typing import Any, overload

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete

from tuckerl.adapters.generators import OwnGenerators
from tuckerl.adapters.joint import agents_of
from tuckerl.adapters.making import GymEnvironment, Made, ParallelEnvironment, close, made_of, name_of
from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.adapters.step_results import reset_result, step_result
from tuckerl.checks import check_int, shown
from tuckerl.errors import ObservationError, SpaceError
from tuckerl.rng import child, seed_sequence
from tuckerl.spaces.bins import MOST_BINS, bin_entries
from tuckerl.types import BoolArray, FloatArray, Seed


@overload
def quantile_edges(
    env: GymEnvironment | Callable[[], GymEnvironment],
    bins: int | Sequence[int],
    *,
    steps: int = ...,
    seed: Seed = ...,
) -> tuple[FloatArray, ...]: ...


@overload
def quantile_edges(
    env: str | ParallelEnvironment | Callable[[], ParallelEnvironment],
    bins: int | Sequence[int],
    *,
    steps: int = ...,
    seed: Seed = ...,
) -> Any: ...


def quantile_edges(
    env: str | Made | Callable[[], Made],
    bins: int | Sequence[int],
    *,
    steps: int = 10_000,
    seed: Seed = 0,
) -> tuple[FloatArray, ...] | dict[Any, tuple[FloatArray, ...]]:
    """Play at random and return the edges between which what was observed falls evenly.

    Parameters
    ----------
    env
        A Gymnasium environment that observes a Box, be it beside an action mask, or a PettingZoo parallel environment
        of which some agents do: its id, an instance, or a callable that makes one. An instance is reset and left where
        the last step led, its action spaces reseeded; one that is made here is closed.
    bins : int or sequence of int
        How many bins each dimension gets, or one number for each, in C order.
    steps : int
        How many random actions to take; the observations after a reset count too.
    seed : int, SeedSequence or None
        Of the environment, the generators that it keeps besides, and the actions.

    Returns
    -------
    tuple of float64 arrays
        The inner edges of each dimension, for ``bins=``. Equal quantiles become one edge, and an edge that nothing
        lies below is left out: a dimension with few different values gets fewer bins, a constant one a single bin. Of a
        PettingZoo environment, a dict of such tuples, by agent that observes a Box.

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
    steps = check_int("steps", steps, 1)
    sequence = seed_sequence(seed)
    made, make = made_of(env, "env")
    try:
        if isinstance(made, gymnasium.Env):
            read = MaskReader(made.observation_space, made.action_space)
            space = read.observation_space
            if not isinstance(space, Box):
                raise SpaceError(f"quantile_edges needs an environment that observes a Box; {made} observes {space}")
            counts = _counts(bins, space, "observation")
            return _edges(counts, _values(_play_alone(made, read, steps, sequence), space))
        readers = {
            agent: MaskReader(made.observation_space(agent), made.action_space(agent)) for agent in agents_of(made)
        }
        spaces = {agent: reader.observation_space for agent, reader in readers.items()}
        boxes = {agent: space for agent, space in spaces.items() if isinstance(space, Box)}
        if not boxes:
            raise SpaceError(f"quantile_edges needs an environment of which an agent observes a Box; {made} has none")
        counts_of = {agent: _counts(bins, space, f"observation of {agent}") for agent, space in boxes.items()}
        seen = _play_together(made, readers, steps, sequence)
        return {agent: _edges(counts_of[agent], _values(seen[agent], space)) for agent, space in boxes.items()}
    finally:
        if make is not None:
            close(made, name_of(made))


def _counts(bins: int | Sequence[int], space: Box, what: str) -> list[int]:
    """Return how many bins each dimension gets."""
    entries = bin_entries(bins, math.prod(space.shape), what)
    return [check_int(f"bins of dimension {i}", count, 1, MOST_BINS) for i, count in enumerate(entries)]


def _edges(counts: list[int], seen: FloatArray) -> tuple[FloatArray, ...]:
    """Return the edges between equal parts of what was seen, (observations, dimensions)."""
    edges = []
    for count, values in zip(counts, seen.T, strict=True):
        quantiles = np.unique(np.quantile(values, np.arange(1, count) / count))
        edges.append(quantiles[quantiles > values.min()])
    return tuple(edges)


def _play_alone(
    env: gymnasium.Env[Any, Any], read: MaskReader, steps: int, sequence: np.random.SeedSequence
) -> list[Any]:
    """Return what is observed, without the masks in it."""
    seeds, first = _begun(env, sequence)
    env.action_space.seed(int(child(sequence, 1).generate_state(1)[0]))
    part, mask = read(*first)
    seen = [part]
    for _ in range(steps):
        observation, _, terminated, truncated, info = step_result(env.step(_sample(env.action_space, mask)))
        part, mask = read(observation, info)
        seen.append(part)
        if terminated or truncated:
            part, mask = read(*reset_result(seeds.reset()))
            seen.append(part)
    return seen


def _play_together(
    env: Any, readers: dict[Any, MaskReader], steps: int, sequence: np.random.SeedSequence
) -> dict[Any, list[Any]]:
    """Return what each agent observes, without the masks in it."""
    seeds, (observations, infos) = _begun(env, sequence)
    for place, agent in enumerate(readers):
        env.action_space(agent).seed(int(child(sequence, 1, place).generate_state(1)[0]))
    seen: dict[Any, list[Any]] = {agent: [] for agent in readers}
    for _ in range(steps):
        masks = {}
        for agent, observation in observations.items():
            part, masks[agent] = readers[agent](observation, infos.get(agent) or {})
            seen[agent].append(part)
        actions = {agent: _sample(env.action_space(agent), masks.get(agent)) for agent in env.agents}
        observations, _, _, _, infos = step_result(env.step(actions))
        if not env.agents:
            for agent, observation in observations.items():
                seen[agent].append(readers[agent](observation, infos.get(agent) or {})[0])
            observations, infos = reset_result(seeds.reset())
    return seen


def _begun(env: Any, sequence: np.random.SeedSequence) -> tuple[EpisodeSeeds, tuple[Any, Any]]:
    """Seed all that an environment draws from; return the seeds of later resets, and what the first one returned."""
    OwnGenerators(env, name_of(env)).seed(child(sequence, 2))
    seeds = EpisodeSeeds(env)
    seeds.sequence = sequence
    first = reset_result(seeds.reset())
    seeds.sequence = child(sequence, 3)  # the child 1 seeds actions, which must not be what a second reset draws
    return seeds, first


def _sample(space: gymnasium.Space[Any], mask: BoolArray | None) -> Any:
    return space.sample(mask.astype(np.int8)) if mask is not None and isinstance(space, Discrete) else space.sample()


def _values(seen: list[Any], space: Box) -> FloatArray:
    """Return what was observed as numbers, (observations, dimensions)."""
    for observation in seen:
        if np.shape(observation) != space.shape:
            raise ObservationError(f"observation must have the shape of {space}; got shape {np.shape(observation)}")
    values = np.array(seen, dtype=np.float64).reshape(len(seen), -1)
    if not np.isfinite(values).all():
        worst = seen[int(np.argmin(np.isfinite(values).all(axis=1)))]
        raise ObservationError(f"quantiles need finite observations; got {shown(worst)}: give edges instead")
    return values
