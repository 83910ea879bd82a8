"""Checks of Gymnasium environments."""

import contextlib
import copy
import io
import math
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from numbers import Real
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

from tuckerl.adapters.making import name_of
from tuckerl.adapters.masks import MASK, MaskReader
from tuckerl.adapters.python_world import EnvironmentCopies
from tuckerl.adapters.resolve import carried_within
from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.checks import shown
from tuckerl.errors import ObservationError, ProblemCheckError, ProblemError, SpaceError
from tuckerl.rng import child, seed_sequence
from tuckerl.spaces.encoder import SpaceEncoder, space_encoder
from tuckerl.testing.carried import check_carried
from tuckerl.testing.playing import Moment, Stage, check_equal, moments, random_code

_BESIDE = 200  # steps of two environments side by side
SEEDS_DECIDE = "the same seed and the same actions must lead to the same play"
SEEDS_ADVICE = (
    "draw from self.np_random after super().reset(seed=seed), from nothing global, and let reset set everything anew"
)


def check_environment(env: Any, make: Callable[[], Any] | None, episodes: int, seed: int) -> None:
    """Check a Gymnasium environment.

    Raises
    ------
    ProblemCheckError
    """
    source = name_of(env)
    stage = GymStage(env, source)
    test = partial(check_env, env, skip_render_check=True, skip_close_check=True)
    check_by_library(test, "gymnasium.utils.env_checker.check_env", source)
    sequence = seed_sequence(seed)
    played = list(moments(stage, child(sequence, 0), episodes))
    check_equal(played, moments(stage, child(sequence, 0), episodes), SEEDS_DECIDE, SEEDS_ADVICE)
    check_beside(stage, GymStage(EnvironmentCopies(env, source, make).another(), source), sequence, played)
    try:
        carried = carried_within(env)
    except ProblemError:  # what is called P here is something else, and stays unread
        return
    if carried is not None:
        check_carried(carried, stage, played, episodes, seed)


def check_beside(stage: Stage, other: Stage, sequence: np.random.SeedSequence, played: list[Moment]) -> None:
    """Check that a play stays as it was when another environment is played beside it.

    Raises
    ------
    ProblemCheckError
    """
    beside = moments(other, child(sequence, 1), 1)

    def interleaved() -> Iterator[Moment]:
        for moment in moments(stage, child(sequence, 0), 1):
            yield moment
            next(beside, None)

    first = [moment for moment in played if moment.where.endswith("episode 0")]
    check_equal(
        islice(first, _BESIDE),
        islice(interleaved(), _BESIDE),
        "two environments side by side must not touch each other",
        "keep what changes in self, not in the class, the module or an array that all share",
    )


class GymStage(Stage):
    """A Gymnasium environment to be played at random."""

    def __init__(self, env: Any, source: str) -> None:
        super().__init__(env, source)
        self.actions = space_encoder(env.action_space, what="action")
        self.read = MaskReader(env.observation_space, env.action_space)
        self.observations = encoder_of_observations(self.read.observation_space)
        self._spaces = (copy.deepcopy(env.observation_space), copy.deepcopy(env.action_space))
        self._mask: Any = None

    def begin(self, seeds: EpisodeSeeds, where: str) -> Moment:
        """Begin an episode."""
        observation, info = seeds.reset()
        if (self.env.observation_space, self.env.action_space) != self._spaces:
            raise ProblemCheckError(
                f"spaces must stay as they are, as tables have as many rows and columns; {where} those of "
                f"{self.source} became {self.env.observation_space} and {self.env.action_space}: declare the largest"
            )
        self.is_over = False
        return self._seen(Moment(where, None, observation, 0.0, False, False), info)

    def act(self, rng: np.random.Generator, where: str) -> Moment:
        """Take a random step that is allowed."""
        code = random_code(rng, self.actions.n, self._mask)
        action = self.actions.decode(code)
        observation, reward, terminated, truncated, info = self.env.step(action)
        check_reward(reward, f"{where} (action {action})", self.source)
        for name, end in (("terminated", terminated), ("truncated", truncated)):
            if not isinstance(end, (bool, np.bool_)):
                raise ProblemCheckError(
                    f"{name} must be True or False; {where} of {self.source} it was {shown(end)}: write bool(...)"
                )
        self.is_over = bool(terminated or truncated)
        return self._seen(Moment(where, code, observation, reward, terminated, truncated), info)

    def _seen(self, moment: Moment, info: Any) -> Moment:
        check_observation(self.env.observation_space, moment.observation, moment.where, self.source)
        if not isinstance(info, dict):
            raise ProblemCheckError(f"info must be a dict; {moment.where} of {self.source} it was {shown(info)}")
        observation, self._mask = read_mask(self.read, moment.observation, info, moment, over=self.is_over)
        return moment._replace(observation=copy.deepcopy(observation), mask=copy.deepcopy(self._mask))


def encoder_of_observations(space: gymnasium.Space[Any]) -> SpaceEncoder | None:
    """Return the numbers of a space; None of one that has them by `bins` only.

    Raises
    ------
    SpaceError
        If it has none.
    """
    try:
        return space_encoder(space)
    except SpaceError:
        space_encoder(space, 1)  # has numbers if all dimensions are left out
        return None


def check_reward(reward: Any, where: str, source: str) -> None:
    """Check that a reward is a finite number.

    Raises
    ------
    ProblemCheckError
    """
    if isinstance(reward, bool) or not isinstance(reward, Real) or not math.isfinite(reward):
        raise ProblemCheckError(
            f"a reward must be a finite number; {where} of {source} it was {shown(reward)}: return float(...), and "
            "guard divisions and logarithms"
        )


def check_observation(space: gymnasium.Space[Any], observation: Any, where: str, source: str) -> None:
    """Check that an observation lies in its space.

    Raises
    ------
    ProblemCheckError
    """
    if not space.contains(observation):
        raise ProblemCheckError(
            f"an observation must lie in {space}; {where} of {source} it was {shown(observation)}: make the space "
            "larger, clip, or mind its dtype and shape"
        )


def read_mask(read: MaskReader, observation: Any, info: Any, moment: Moment, *, over: bool) -> tuple[Any, Any]:
    """Return an observation and its mask, which must allow something while the episode goes on.

    Raises
    ------
    ProblemCheckError
    """
    try:
        part, mask = read(observation, info)
    except ObservationError as error:
        raise ProblemCheckError(f"{error} ({moment.where})") from error
    given = info.get(MASK) if part is observation else observation[MASK]
    parts = given if isinstance(given, tuple) else (given,)
    if not over and any(part is not None and not np.any(part) for part in parts):
        raise ProblemCheckError(
            f"an action mask must allow at least one action while the episode goes on; {moment.where} it was "
            f"{shown(given)}: return terminated=True where nothing can be done"
        )
    return part, mask


def check_by_library(test: Callable[[], object], name: str, source: str) -> None:
    """Check that an environment passes the test of the library that it is written for.

    Raises
    ------
    ProblemCheckError
    """
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        try:
            test()
        except Exception as error:  # the libraries' own, AssertionError, and whatever the environment raises
            raise ProblemCheckError(f"{source} does not pass {name}: {str(error) or repr(error)}") from error
