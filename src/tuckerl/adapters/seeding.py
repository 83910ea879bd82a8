"""Seeds for the resets of environments, so that a saved learner goes on to the last bit."""

from typing import Any, NotRequired, TypedDict

import numpy as np

from tuckerl.adapters.joint import innermost
from tuckerl.errors import SavedFileError
from tuckerl.rng import child, generator_as_json, restore_generator, seed_sequence
from tuckerl.saved_json import checked_json

_MOST_RESETS = 2**63


class _StoredSeeds(TypedDict):
    """What a file holds of an environment's seeds."""

    resets: int
    generator: dict[str, Any] | None
    always: NotRequired[bool]


class EpisodeSeeds:
    """Seeds for the resets of one environment.

    The first reset gives a seed, as Gymnasium asks for. What an environment remembers from one episode to the next is
    then its generator, `np_random`, which is saved and restored. An environment without one is given a seed in every
    reset, so that it need not remember anything, and so is one that makes other generators anew in each reset.

    Attributes
    ----------
    n_resets : int
        How many there have been.
    always : bool
        Whether every reset gives a seed although there is `np_random`.
    """

    def __init__(self, env: Any) -> None:
        self._env = env
        self.sequence = seed_sequence(0)
        self.n_resets = 0
        self.always = False
        self._seed: int | None = None  # the latest that was given
        self._kept: tuple[int, int | None, Any] = 0, None, None

    def follow(self, original: "EpisodeSeeds") -> None:
        """Go on as those of an environment do of which this one is a copy."""
        self.sequence, self.n_resets, self._seed = original.sequence, original.n_resets, original._seed
        self.always = original.always

    def reset(self) -> tuple[Any, Any]:
        """Begin an episode; return what the environment's reset returns."""
        number = self.n_resets
        self.n_resets += 1
        return self._env.reset() if number > 0 and not self.gives_each_a_seed else self._seeded(number)

    def reset_again(self) -> tuple[Any, Any]:
        """Begin the latest episode again, with a seed."""
        return self._seeded(self.n_resets - 1)

    @property
    def gives_each_a_seed(self) -> bool:
        """Whether the next reset gives a seed, even if it is not the first."""
        return self.always or generator_of(self._env) is None

    def _seeded(self, number: int) -> tuple[Any, Any]:
        self._seed = int(child(self.sequence, number).generate_state(1)[0])
        return self._env.reset(seed=self._seed)

    def keep(self) -> None:
        """Remember what the next reset depends on, for `undo`."""
        generator = generator_of(self._env) if self.n_resets else None
        self._kept = self.n_resets, self._seed, None if generator is None else generator.bit_generator.state

    def undo(self) -> None:
        """Let the next reset be the one that followed `keep`."""
        self.n_resets, self._seed, held = self._kept
        generator = generator_of(self._env)
        if held is not None and generator is not None:
            generator.bit_generator.state = held

    def where(self, step: int) -> str:
        """Return the place of a step for a message: its number, episode and seed."""
        place = f"in step {step}" if step else "in reset"
        return f"{place} of episode {self.n_resets - 1} of this environment (seed {self._seed})"

    def saved(self) -> dict[str, Any]:
        """Return as JSON what `restore` goes on from."""
        generator = generator_of(self._env) if self.n_resets else None
        held = {"resets": self.n_resets, "generator": None if generator is None else generator_as_json(generator)}
        return held | ({"always": True} if self.always else {})

    def restore(self, header: dict[str, Any]) -> None:
        """Go on from what `saved` returned.

        Raises
        ------
        SavedFileError
            If the environment has no generator any more, or one of another kind, or no such seeds are held.
        """
        checked_json(header, _StoredSeeds, "the seeds of an environment")
        if not 0 <= header["resets"] < _MOST_RESETS:
            raise SavedFileError(f"an environment was reset at least 0 times; it holds {header['resets']}")
        self.n_resets, self.always = header["resets"], header.get("always", False)
        if header["generator"] is None:
            return
        self._seeded(0)
        generator = generator_of(self._env)
        held = header["generator"]
        if generator is None or type(generator.bit_generator).__name__ != held.get("bit_generator"):
            raise SavedFileError(
                f"the saved environment drew from np_random, a {held.get('bit_generator')!s:.40}; this one does not: "
                "load with the same environment"
            )
        restore_generator(generator, held)


def generator_of(env: Any) -> np.random.Generator | None:
    """Return the generator that an environment keeps from one episode to the next, if it has one."""
    inner = innermost(env)  # a joint environment's own generator decides nothing
    # Gymnasium's property would make one where there is none.
    generator = getattr(inner, "_np_random", None)
    if generator is None and not hasattr(type(inner), "np_random"):
        generator = getattr(inner, "np_random", None)
    return generator if isinstance(generator, np.random.Generator) else None
