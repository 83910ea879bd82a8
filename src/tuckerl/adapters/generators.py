"""The generators that an environment keeps besides ``np_random``: seeded with it, and saved with it.

Users write ``self.rng = np.random.default_rng()`` or ``random.Random()``, and sample from spaces, each of which has a
generator of its own. No seed of a reset reaches these, unless the environment passes it on.
"""

import random
from collections import deque
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from tuckerl.adapters.held import LEAVES, MOST_PARTS, parts_of
from tuckerl.adapters.seeding import generator_of
from tuckerl.errors import ResumeWarning, SavedFileError, warn
from tuckerl.rng import (
    AnyGenerator,
    child,
    generator_as_json,
    kind_of_generator,
    restore_generator,
    set_state,
    state_of,
)
from tuckerl.saved_json import checked_json

_WATCHED = 8  # looks at the global generators
_SHARED = (random._inst, np.random.mtrand._rand)  # the global ones


class OwnGenerators:
    """The generators of one environment besides the one that its resets seed.

    Parameters
    ----------
    env
    source : str
        What it is called in messages.
    decided : callable, optional
        Returns the places of those that the environment's author seeded, which are left alone. By default there are
        none.
    """

    def __init__(self, env: Any, source: str, decided: Callable[[], Collection[str]] = tuple) -> None:
        self._env, self._source, self._decided = env, source, decided
        self._has_begun = self._is_told = False
        self._own: dict[str, AnyGenerator] = {}  # as they were found latest
        self._kept: list[tuple[AnyGenerator, dict[str, Any]]] | None = None
        self._globals: Any = None
        self._n_watched = 0
        self.reason: str | None = None
        """Why a file cannot hold all that the environment draws from; None where it can."""

    def seed(self, sequence: np.random.SeedSequence) -> None:
        """Seed those that there are, but for those that their author seeded."""
        self._has_begun = True
        self._own = self._found()
        decided = self._decided()
        seed_generators({place: own for place, own in self._own.items() if place not in decided}, sequence)

    def look(self) -> bool:
        """Look again; return whether any is another than at the latest look, or was not there."""
        before, self._own = self._own, self._found()
        return any(own is not before.get(place) for place, own in self._own.items())

    def follow(self, original: "OwnGenerators") -> None:
        """Go on as those of an environment of which this one is a copy: they were copied as they are."""
        self._has_begun, self.reason = original._has_begun, original.reason
        self._own = self._found() if self._has_begun else {}

    def keep(self) -> None:
        """Remember their states, for `undo`."""
        self._kept = [(own, state_of(own)) for own in self._own.values()] if self._has_begun else None

    def undo(self) -> None:
        """Go back to where `keep` was called."""
        self._has_begun = self._kept is not None  # else the first reset is played again, and they are seeded
        for own, state in self._kept or ():
            set_state(own, state)

    def look_away(self) -> None:
        """Forget the state of the global generators: others may draw from them now."""
        self._globals = None

    def watch(self) -> None:
        """Note whether the global generators were drawn from since the latest call, in the first episodes."""
        if self._n_watched == _WATCHED or self.reason is not None:
            return
        self._n_watched += 1
        before, self._globals = self._globals, (random.getstate(), generator_as_json(_SHARED[1]))
        if before is not None and before != self._globals:
            self.reason = "it draws from the global generator of NumPy or of random, which no seed of a learner decides"

    def saved(self) -> dict[str, Any]:
        """Return their states as JSON, by where they stand; warn once where that is not all."""
        states = {place: generator_as_json(own) for place, own in self._found().items()} if self._has_begun else {}
        if self.reason is not None and not self._is_told:
            self._is_told = True
            warn(
                f"a learner on {self._source} cannot go on from a file to the last bit: {self.reason}; draw from "
                "self.np_random after super().reset(seed=seed)",
                ResumeWarning,
            )
        return states

    def restore(self, held: Mapping[str, Any]) -> None:
        """Go on from what `saved` returned.

        Raises
        ------
        SavedFileError
            If one of them is not there, or of another kind, or what is held is no state of it.
        """
        checked_json(held, dict[str, dict[str, Any]], "an environment's own generators")
        self._has_begun = True
        if not held.keys() <= self._found().keys():
            self._env.reset(seed=0)  # which makes them, perhaps
        self._own = found = self._found()
        for place, state in held.items():
            kind = state.get("bit_generator")
            if place not in found or kind_of_generator(found[place]) != kind:
                raise SavedFileError(
                    f"the saved environment drew from {place:.60}, a {kind!s:.40}; this one does not: load with the "
                    "same environment"
                )
            restore_generator(found[place], state)

    def _found(self) -> dict[str, AnyGenerator]:
        found, reason = own_generators(self._env)
        self.reason = self.reason or reason
        return found


class FoundGenerators(NamedTuple):
    """What was found in an environment."""

    generators: dict[str, AnyGenerator]
    """By where they stand, those first that are fewest steps away."""
    reason: str | None
    """Why these are not all, or cannot be saved; None where they are and can."""


def own_generators(env: Any) -> FoundGenerators:
    """Return the generators that an environment, its wrappers and what they hold keep, but for the usual one."""
    found, is_whole = _searched(env)
    usual = generator_of(env), getattr(env.unwrapped, "__dict__", {}).get("_np_random")  # of a joint one: both
    own: dict[str, AnyGenerator] = {}
    reason = None if is_whole else "it holds too many objects to look for generators in all of them"
    for place, generator in found.items():
        if any(generator is one for one in (*usual, *_SHARED)):
            continue
        if isinstance(generator, random.SystemRandom):
            reason = f"{place:.60} draws from the operating system, which cannot be repeated"
            continue
        if "<" in place:  # a part of a set, or of a mapping by a key that is written as its address
            reason = f"{place:.60} stands where it cannot be found again: keep it in a list, or by a name"
        own[place] = generator
    return FoundGenerators(own, reason)


def _searched(env: Any) -> tuple[dict[str, AnyGenerator], bool]:
    """Return all generators, by where they stand, and whether all that an environment holds was looked at."""
    found: dict[str, AnyGenerator] = {}
    seen: set[int] = set()
    objects: deque[tuple[str, Any]] = deque([("env", env)])
    n_parts = 0
    while objects:
        place, one = objects.popleft()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, (np.random.Generator, np.random.RandomState, random.Random)):
            found[place] = one
            continue
        if isinstance(one, gymnasium.Space):
            one.np_random  # noqa: B018  # a space makes its generator when it is first asked
        for template, name, part in parts_of(one):
            n_parts += 1
            if n_parts > MOST_PARTS:
                return found, False
            if part is not None and not isinstance(part, LEAVES) and id(part) not in seen:
                objects.append((place + template.format(name), part))
    return found, True


def seed_generators(generators: Mapping[str, AnyGenerator], sequence: np.random.SeedSequence) -> None:
    """Seed generators from the children of a sequence, in their order."""
    for number, generator in enumerate(generators.values()):
        own = child(sequence, number)
        if isinstance(generator, random.Random):
            generator.seed(int(own.generate_state(1, np.uint64)[0]))
        else:
            bits = generator._bit_generator if isinstance(generator, np.random.RandomState) else generator.bit_generator
            bits.state = type(bits)(own).state
