"""Random play of environments, step by step, so that two plays can be compared or interleaved."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np
from gymnasium.utils.env_checker import data_equivalence

from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.checks import shown
from tuckerl.errors import ProblemCheckError
from tuckerl.rng import child
from tuckerl.testing.limits import BUDGET, LONGEST
from tuckerl.types import BoolArray


class Moment(NamedTuple):
    """What came of a reset (no action) or a step; by agent where there are several."""

    where: str
    action: Any
    observation: Any
    reward: Any
    terminated: Any
    truncated: Any
    mask: Any = None


class Stage(ABC):
    """An environment to be played at random.

    Attributes
    ----------
    is_over : bool
        Whether the episode has ended: nobody is there to act.
    """

    is_over = True

    def __init__(self, env: Any, source: str) -> None:
        self.env, self.source = env, source

    @abstractmethod
    def begin(self, seeds: EpisodeSeeds, where: str) -> Moment:
        """Begin an episode, and check what came."""

    @abstractmethod
    def act(self, rng: np.random.Generator, where: str) -> Moment:
        """Take a random step that is allowed, and check what came."""


def random_code(rng: np.random.Generator, n: int, mask: BoolArray | None) -> int:
    """Return the number of one of `n` actions, which its mask allows where there is one."""
    return int(rng.integers(n) if mask is None else rng.choice(np.flatnonzero(mask)))


def moments(stage: Stage, sequence: np.random.SeedSequence, episodes: int) -> Iterator[Moment]:
    """Play episodes at random, as seeds and actions of `sequence` decide: the first reset is seeded, as learners do.

    Raises
    ------
    ProblemCheckError
        If the environment raises an error or an episode never ends.
    """
    seeds, rng, n_steps = EpisodeSeeds(stage.env), np.random.default_rng(child(sequence, 1)), 0
    seeds.sequence = child(sequence, 0)
    for episode in range(episodes):
        yield _watched(stage, lambda where: stage.begin(seeds, where), f"in the reset of episode {episode}")
        n_done = 0
        while not stage.is_over:
            n_done += 1
            if n_done > LONGEST:
                raise ProblemCheckError(
                    f"an episode of {stage.source} did not end in {LONGEST:,} steps of random play: give it a time "
                    "limit, as gymnasium.make(..., max_episode_steps=...) does, or return truncated=True"
                )
            yield _watched(stage, lambda where: stage.act(rng, where), f"in step {n_done} of episode {episode}")
        n_steps += n_done
        if n_steps >= BUDGET:
            return


def _watched(stage: Stage, call: Any, where: str) -> Moment:
    try:
        moment: Moment = call(where)
    except ProblemCheckError:
        raise
    except Exception as error:  # whatever an environment raises
        raise ProblemCheckError(f"{stage.source} raised {type(error).__name__} {where}: {error}") from error
    return moment


def check_equal(first: Iterable[Moment], second: Iterable[Moment], what: str, advice: str) -> None:
    """Check that two plays are one.

    Raises
    ------
    ProblemCheckError
        ``what``, then where they part, then ``advice``.
    """
    for one, other in zip_longest(first, second):
        if one is None or other is None:
            where = (one or other).where
            raise ProblemCheckError(f"{what}; one play ended and the other went on {where}: {advice}")
        for name in Moment._fields[1:]:
            ours, theirs = getattr(one, name), getattr(other, name)
            if not data_equivalence(ours, theirs, exact=True):
                raise ProblemCheckError(
                    f"{what}; {one.where} the {name} was {shown(ours)}, then {shown(theirs)}: {advice}"
                )
