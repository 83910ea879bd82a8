"""Loops in C and C++, compiled on the spot where there is a compiler."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.problems.mdp import TabularMDP
from tuckerl.rng import child, seed_sequence, stream
from tuckerl.types import FloatArray, IntArray, Stream

HERE = Path(__file__).parent
NO_COMPILER = "left out: no compiler"


COMPILERS = {".c": ("cc", "gcc", "clang"), ".cpp": ("c++", "g++", "clang++")}


def compiled(source: str) -> ctypes.CDLL | None:
    """Return a file of this folder as a loaded library, or None without a compiler."""
    compiler = next((found for found in map(shutil.which, COMPILERS[Path(source).suffix]) if found), None)
    if compiler is None:
        return None
    (HERE / "build").mkdir(exist_ok=True)
    library = HERE / "build" / f"{source}.so"
    # Without contraction of a * b + c, so that its results are the kernels' to the last bit.
    flags = ["-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, "-o", str(library), str(HERE / source), "-lm"], check=True)
    return ctypes.CDLL(str(library))


Played = tuple[FloatArray, IntArray]


def dyna_h(problem: TabularMDP, planning_steps: int, episodes: int, seed: int) -> Callable[[], Played] | None:
    """Return a function that plays Dyna-H (Q-learning with 0 planning steps) in C: tables and steps out."""
    library = compiled("dyna_h.c")
    if library is None:
        return None
    arrays = problem.arrays
    outcomes = [np.ascontiguousarray(part) for part in (arrays.next_state, arrays.reward, arrays.terminated)]
    heuristic = np.zeros(problem.n_states) if problem.heuristic is None else problem.heuristic
    weights = np.ones(problem.n_actions)

    def play() -> Played:
        q = np.zeros((problem.n_states, problem.n_actions))
        steps = np.zeros(episodes, dtype=np.int64)
        rng = agents_stream(seed)
        library.play(
            *map(pointer, (*outcomes, heuristic)),
            *map(ctypes.c_int64, (problem.n_states, problem.n_actions, int(arrays.start_state[0]))),
            *map(ctypes.c_int64, (arrays.max_episode_steps, episodes, planning_steps)),
            *map(ctypes.c_double, (0.1, 0.95, 0.1)),
            *map(pointer, (weights, rng, q, steps)),
        )
        return q, steps

    return play


def agents_stream(seed: int) -> Stream:
    """Return the stream that a learner's first agent draws from."""
    return stream(child(seed_sequence(seed), 0))


def pointer(array: Any) -> ctypes.c_void_p:
    """Return where an array begins, whose entries must follow each other: C knows no strides.

    Raises
    ------
    ValueError
        If they do not.
    """
    if not array.flags.c_contiguous:
        raise ValueError(f"C would read beyond the entries of an array with the strides {array.strides}")
    return ctypes.c_void_p(array.ctypes.data)
