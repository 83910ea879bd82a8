"""The generators that an environment keeps besides ``np_random``: seeded with it, and saved with it.

Users write ``self.rng = np.random.default_rng()`` or ``random.Random()``, and sample from spaces, each of which has a
generator of its own. No seed of a reset reaches these, unless the environment passes it on.
"""

import random
import warnings
from collections.abc import Iterator, Mapping
from types import FunctionType, MethodType, ModuleType
from typing import Any

import gymnasium
import numpy as np

from tuckerl.adapters.seeding import generator_of
from tuckerl.errors import ResumeWarning, SavedFileError
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

_MOST = 100_000  # objects that are looked at
_WATCHED = 8  # looks at the global generators
_LEAVES = (str, bytes, int, float, complex, bool, np.generic, np.ndarray, type, ModuleType, FunctionType, MethodType)
_SHARED = (random._inst, np.random.mtrand._rand)  # the global ones


class OwnGenerators:
    """The generators of one environment besides the one that its resets seed.

    Parameters
    ----------
    env
    source : str
        What it is called in messages.
    """

    def __init__(self, env: Any, source: str) -> None:
        self._env, self._source = env, source
        self._has_begun = self._is_told = False
        self._own: dict[str, AnyGenerator] = {}  # as they were found latest
        self._kept: list[tuple[AnyGenerator, dict[str, Any]]] | None = None
        self._globals: Any = None
        self._n_watched = 0
        self.reason: str | None = None
        """Why a file cannot hold all that the environment draws from; None where it can."""

    def seed(self, sequence: np.random.SeedSequence) -> None:
        """Seed those that there are before the first reset, whose seed decides all that it passes on."""
        if not self._has_begun:
            self._has_begun = True
            self._own = self._found()
            seed_generators(self._own, sequence)

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
            warnings.warn(
                f"a learner on {self._source} cannot go on from a file to the last bit: {self.reason}; draw from "
                "self.np_random after super().reset(seed=seed)",
                ResumeWarning,
                stacklevel=2,
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
        try:
            found = own_generators(self._env)
        except RecursionError:  # too many objects
            self.reason = "it holds too many objects to look for generators in all of them"
            return {}
        secret = next((place for place, own in found.items() if isinstance(own, random.SystemRandom)), None)
        if secret is not None:
            self.reason = f"{secret:.60} draws from the operating system, which cannot be repeated"
        usual = generator_of(self._env)
        return {
            place: own for place, own in found.items() if own is not usual and not isinstance(own, random.SystemRandom)
        }


def own_generators(env: Any) -> dict[str, AnyGenerator]:
    """Return the generators that an environment, its wrappers and what they hold keep, by where they stand.

    Raises
    ------
    RecursionError
        If the environment holds too much to be searched.
    """
    found: dict[str, AnyGenerator] = {}
    seen: set[int] = set()
    objects: list[tuple[str, Any]] = [("env", env)]
    while objects:
        place, one = objects.pop()
        if id(one) in seen or isinstance(one, _LEAVES) or one is None:
            continue
        seen.add(id(one))
        if len(seen) > _MOST:
            raise RecursionError
        if isinstance(one, (np.random.Generator, np.random.RandomState, random.Random)):
            if not any(one is shared for shared in _SHARED):
                found[place] = one
            continue
        if isinstance(one, gymnasium.Space):
            one.np_random  # noqa: B018  # a space makes its generator when it is first asked
        objects.extend(reversed(list(_parts(place, one))))
    return found


def _parts(place: str, one: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(one, Mapping):
        yield from ((f"{place}[{key!r}]", part) for key, part in one.items())
    elif isinstance(one, (list, tuple)):
        yield from ((f"{place}[{i}]", part) for i, part in enumerate(one))
    yield from ((f"{place}.{name}", part) for name, part in getattr(one, "__dict__", {}).items())


def seed_generators(generators: Mapping[str, AnyGenerator], sequence: np.random.SeedSequence) -> None:
    """Seed generators from the children of a sequence, in their order."""
    for number, generator in enumerate(generators.values()):
        own = child(sequence, number)
        if isinstance(generator, random.Random):
            generator.seed(int(own.generate_state(1, np.uint64)[0]))
        else:
            bits = generator._bit_generator if isinstance(generator, np.random.RandomState) else generator.bit_generator
            bits.state = type(bits)(own).state
