"""The factors of one window's tables, for those who want to look at them."""

import math
from typing import NamedTuple

import numpy as np

from tuckerl.tensor import TuckerDecomposition
from tuckerl.types import FloatArray, IntArray

STATES, ACTIONS, EPISODES, AGENTS = range(4)


class Loadings(NamedTuple):
    """A Tucker decomposition of the tables of E episodes and N agents.

    A state that `states` does not name has no row in `factors[0]`: its row of the tables did not change.
    """

    states: IntArray  # (n,) the states that the rows of the state factor stand for, each once
    factors: tuple[FloatArray, ...]  # (n, r_0), (A, r_1), (E, r_2), (N, r_3)
    core: FloatArray  # (r_0, r_1, r_2, r_3); of tables above 1e270, in units of 2**600
    episode: int  # the last of the E episodes, counted from 1
    fit: float = math.nan  # NaN where it is not known

    @property
    def first_episode(self) -> int:
        """The first of the E episodes, counted from 1."""
        return self.episode - int(self.factors[EPISODES].shape[0]) + 1

    def energies(self, mode: int) -> FloatArray:
        """Return the part of the core's sum of squares that belongs to each column of a factor, (r,); 0 of zeros."""
        squares: FloatArray = np.square(self.core).sum(axis=tuple(axis for axis in range(4) if axis != mode))
        whole = squares.sum()
        return squares / whole if whole > 0 else squares

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays from which `loadings_of_arrays` makes them again."""
        factors = {f"loadings.factor{mode}": factor for mode, factor in enumerate(self.factors)}
        numbers = {"loadings.episode": np.array(self.episode), "loadings.fit": np.array(self.fit)}
        return {"loadings.states": self.states, "loadings.core": self.core, **factors, **numbers}


def loadings_of(decomposition: TuckerDecomposition, states: IntArray, episode: int) -> Loadings:
    """Keep the rows of the state factor that belong to states; others stand for those that did not change."""
    of_states, *others = decomposition.factors
    factors = (of_states[: states.size].copy(), *others)
    return Loadings(states, factors, decomposition.core, episode, decomposition.fit)


def loadings_of_arrays(arrays: dict[str, np.ndarray]) -> Loadings | None:
    """Return the loadings that a saved learner holds; None where nothing was decomposed, or of a file of format 1."""
    if "loadings.states" not in arrays:
        return None
    factors = tuple(arrays[f"loadings.factor{mode}"] for mode in range(4))
    episode, fit = int(arrays["loadings.episode"]), float(arrays["loadings.fit"])
    return Loadings(arrays["loadings.states"], factors, arrays["loadings.core"], episode, fit)
