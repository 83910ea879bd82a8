"""Random streams: which seeds they come from, and how compiled kernels draw from them.

A stream is four uint64 words, the state of xoshiro256++ (Blackman and Vigna 2021), passed to a kernel as an explicit
array and changed in place. Streams are children of a NumPy ``SeedSequence``, so they are independent of each other
and of how many others there are; nothing reads a global generator.
"""

import random
from collections.abc import Mapping
from typing import Any

import numpy as np

from tuckerl._jit import kernel, silent
from tuckerl.checks import check_int, shown
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.types import Seed, Stream, UInt64Array

_MOST_SEED = 2**4096 - 1  # files hold it as text, and Python writes no whole number of some thousand digits


def seed_sequence(seed: Seed) -> np.random.SeedSequence:
    """Return `seed` as a SeedSequence; ``None`` draws a fresh one from the operating system.

    Raises
    ------
    ParameterError, ParameterTypeError
        If the seed is negative, or has more than 4096 bits, or is neither an int nor a SeedSequence nor None.
    """
    if isinstance(seed, np.random.SeedSequence):
        return seed
    number = None if seed is None else check_int("seed", seed, 0)
    if number is not None and number > _MOST_SEED:
        raise ParameterError(f"seed must have at most 4096 bits; got {shown(number)}")
    return np.random.SeedSequence(number)


def child(sequence: np.random.SeedSequence, *key: int) -> np.random.SeedSequence:
    """Return a child by its number: the one that ``spawn`` would give, without its memory of earlier calls."""
    return np.random.SeedSequence(sequence.entropy, spawn_key=(*sequence.spawn_key, *key))


def stream(sequence: np.random.SeedSequence) -> Stream:
    """Return a (4,) uint64 state for the kernels' generator, seeded from `sequence`."""
    words: Stream = sequence.generate_state(4, np.uint64).astype(np.uint64, copy=False)
    return words


AnyGenerator = np.random.Generator | np.random.RandomState | random.Random
"""What environments draw from: NumPy's generators, those of its first kind, and Python's own."""

_PLACES = {"MT19937": ("pos", 624), "Philox": ("buffer_pos", 4)}
"""Where generators keep the place in their block of numbers, which NumPy takes unchecked, and its largest value."""


def kind_of_generator(generator: AnyGenerator) -> str:
    """Return what files call a generator's kind: by its bits, as NumPy does, or ``random.Random``."""
    if isinstance(generator, random.Random):
        return "random.Random"
    bits = generator._bit_generator if isinstance(generator, np.random.RandomState) else generator.bit_generator
    return type(bits).__name__


def restore_generator(generator: AnyGenerator, held: Mapping[str, Any]) -> None:
    """Let a generator go on from the state that a file holds, as JSON.

    Raises
    ------
    SavedFileError
        If it is no state of this kind of generator.
    """
    kind, fresh = kind_of_generator(generator), generator_as_json(generator)
    try:
        if kind in _PLACES:
            name, most = _PLACES[kind]
            where = held["state"] if kind == "MT19937" else held
            check_int(name, where[name], 0, most)
        if kind.startswith("PCG64") and held["state"]["inc"] % 2 == 0:
            raise ValueError("its increment must be odd")
        set_state(generator, held)
        if generator_as_json(generator) != held:
            raise ValueError("its numbers are out of range")
    except Exception as error:  # whatever NumPy raises
        set_state(generator, fresh)
        raise SavedFileError(f"it holds no state of a random generator {kind} ({error})") from error


def set_state(generator: AnyGenerator, held: Mapping[str, Any]) -> None:
    """Let a generator go on from what `state_of` returned, or from the same as JSON, which is not checked."""
    if isinstance(generator, random.Random):
        version, words, gauss = held["state"]
        generator.setstate((version, tuple(words), gauss))
    elif isinstance(generator, np.random.RandomState):
        generator.set_state(held)  # type: ignore[arg-type]  # a file's dict; what is wrong in it raises
    else:
        generator.bit_generator.state = held


def state_of(generator: AnyGenerator) -> dict[str, Any]:
    """Return a generator's state, for `set_state`."""
    if isinstance(generator, random.Random):
        return {"bit_generator": kind_of_generator(generator), "state": generator.getstate()}
    if isinstance(generator, np.random.RandomState):
        return dict(generator.get_state(legacy=False))
    return dict(generator.bit_generator.state)


def generator_as_json(generator: AnyGenerator) -> Any:
    """Return a generator's state as JSON."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: plain(part) for name, part in value.items()}
        if isinstance(value, tuple):
            return list(map(plain, value))
        return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value

    return plain(state_of(generator))


@kernel
def _rotate_left(x: np.uint64, k: int) -> np.uint64:
    return (x << np.uint64(k)) | (x >> np.uint64(64 - k))


@silent
@kernel
def uniform(state: UInt64Array) -> float:
    """Draw a float64 uniformly from [0, 1), a multiple of 2**-53 (xoshiro256++).

    Parameters
    ----------
    state : (4,) uint64
        The stream, which moves on.
    """
    s0, s1, s2, s3 = state[0], state[1], state[2], state[3]
    result = _rotate_left(s0 + s3, 23) + s0
    s2 ^= s0
    s3 ^= s1
    state[0] = s0 ^ s3
    state[1] = s1 ^ s2
    state[2] = s2 ^ (s1 << np.uint64(17))
    state[3] = _rotate_left(s3, 45)
    return float(result >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def below(n: int, state: UInt64Array) -> int:
    """Draw an integer uniformly from 0 to n - 1.

    Parameters
    ----------
    n : int
        Far below 2**53.
    state : (4,) uint64
        The stream, which moves on.
    """
    return int(uniform(state) * n)
