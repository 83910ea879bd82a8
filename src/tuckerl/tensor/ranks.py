"""Which ranks a tensor can have: what may be asked for, and what is used of it.

The ranks of a Tucker decomposition with orthonormal factors and no superfluous column obey, in each mode,

* r_n <= I_n, for there are no more orthonormal columns;
* r_n <= prod over m != n of r_m, for the unfolded core has no more columns [1]_;
* r_n <= the numerical rank of the mode-n unfolding, for further columns would be arbitrary.

References
----------
.. [1] T. G. Kolda, B. W. Bader (2009). Tensor decompositions and applications. SIAM Review 51(3), 455-500,
   section 4.
"""

import math
from collections.abc import Sequence

import numpy as np

from tuckerl.checks import check_int, check_real, check_sequence
from tuckerl.types import AskedRanks

Ranks = tuple[int, ...]

AUTO = "auto"
AUTO_SHARE = 0.95
"""The share of the energy that "auto" stands for: the customary one of principal component analysis.

The paper's ranks explain no less in its scenarios: with three agents, in the median window, 99.2, 99.3, 100 and 99.9 %
in the modes of states, actions, episodes and agents (cart pole), 100, 96.4, 100 and 99.8 % (maze), and 100, 99.4, 100
and 99.9 % (rescue).
"""


def check_ranks(ranks: object, expected: str, names: Sequence[str]) -> Ranks | float:
    """Return ranks as a tuple of one positive int a mode; or the share of the energy that they are to explain.

    Parameters
    ----------
    ranks
    expected : str
        What messages say that ranks must be.
    names : sequence of N str
        What messages call the rank of each mode.

    Raises
    ------
    ParameterTypeError
        If it is neither a sequence of whole numbers nor such a share.
    ParameterError
        If there is not one for each of the modes, one is not positive, or a share is not in (0, 1].
    """
    if isinstance(ranks, str) and ranks == AUTO:
        return AUTO_SHARE
    if isinstance(ranks, (float, np.floating)):
        return check_real("ranks, as a share of the energy,", ranks, 0.0, 1.0, low_open=True)
    asked = check_sequence("ranks", ranks, f"{expected}, or 'auto' or a share of the energy such as 0.95", len(names))
    return tuple(check_int(name, rank, low=1) for name, rank in zip(names, asked, strict=True))


def numbers_or_share(ranks: AskedRanks) -> Ranks | float:
    """Return checked ranks as decompositions take them: "auto" as the share that it stands for."""
    if isinstance(ranks, str):
        return AUTO_SHARE
    return ranks if isinstance(ranks, float) else tuple(ranks)


def clip_ranks(asked: Sequence[int], limits: Sequence[int]) -> Ranks:
    """Lower ranks to the limit of each mode, and then to the product of the others.

    Parameters
    ----------
    asked : sequence of N int
    limits : sequence of N int
        The most that each mode has: its size or its numerical rank.

    Returns
    -------
    tuple of N int

    Examples
    --------
    >>> clip_ranks((9, 2, 2), (5, 5, 5))
    (4, 2, 2)
    """
    ranks = [min(pair) for pair in zip(asked, limits, strict=True)]
    # At most one mode, the largest, exceeds the product of the others, and lowering it to that product leaves
    # the others within theirs: one look at each is enough.
    for mode, rank in enumerate(ranks):
        ranks[mode] = min(rank, math.prod(ranks[:mode] + ranks[mode + 1 :]))
    return tuple(ranks)
