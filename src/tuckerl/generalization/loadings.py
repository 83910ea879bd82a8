"""The factors of one window's tables, for those who want to look at them."""

import math
from typing import NamedTuple

import numpy as np

from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.tensor import TuckerDecomposition
from tuckerl.types import FloatArray, IntArray, Ranks

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
        """Return the arrays from which `read_loadings` makes them again."""
        factors = {f"factor{mode}": factor for mode, factor in enumerate(self.factors)}
        numbers = {"episode": np.array(self.episode), "fit": np.array(self.fit)}
        return {"states": self.states, "core": self.core, **factors, **numbers}


def loadings_of(decomposition: TuckerDecomposition, states: IntArray, episode: int) -> Loadings:
    """Keep the rows of the state factor that belong to states; others stand for those that did not change."""
    of_states, *others = decomposition.factors
    factors = (of_states[: states.size].copy(), *others)
    return Loadings(states, factors, decomposition.core, episode, decomposition.fit)


def read_loadings(
    arrays: SavedArrays, sizes: tuple[int, int, int, int], ranks: Ranks, episodes: int
) -> Loadings | None:
    """Return the loadings that a file holds; None where nothing was decomposed, or of a file of format 1.

    Parameters
    ----------
    arrays : SavedArrays
        As `Loadings.to_arrays` returns them.
    sizes : four ints
        How many states, actions, episodes and agents the tables have.
    ranks : four ints
        The most columns of each factor.
    episodes : int
        How many were finished.

    Raises
    ------
    SavedFileError
        If they are none of such tables'.
    """
    if not len(arrays):
        return None
    states = arrays.take("states", np.int64, (range(sizes[STATES] + 1),), 0, sizes[STATES] - 1)
    check_distinct("the states of the loadings", states)
    core = arrays.take("core", np.float64, tuple(range(1, rank + 1) for rank in ranks))
    rows = (states.size, *sizes[ACTIONS:])
    factors = tuple(arrays.take(f"factor{k}", np.float64, (rows[k], core.shape[k]), finite=True) for k in range(4))
    episode = arrays.take("episode", np.int64, (), 1, episodes)
    fit = arrays.take("fit", np.float64, ())
    return Loadings(states, factors, core, int(episode), float(fit))
