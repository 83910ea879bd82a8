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

from tuckerl.checks import check_int, check_sequence

Ranks = tuple[int, ...]


def check_ranks(ranks: Sequence[int], order: int) -> Ranks:
    """Return `ranks` as a tuple of one positive int a mode.

    Raises
    ------
    ParameterTypeError
        If it is not a sequence of whole numbers.
    ParameterError
        If there is not one for each of the `order` modes, or one is not positive.
    """
    asked = check_sequence("ranks", ranks, f"{order} whole numbers, one for each mode of the tensor", order)
    return tuple(check_int(f"ranks[{mode}]", rank, low=1) for mode, rank in enumerate(asked))


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
