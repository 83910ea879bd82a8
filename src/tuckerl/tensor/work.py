"""All that kernels do for a decomposition, behind one door: what Python calls is compiled once for all of it."""

import math

from tuckerl._jit import routine
from tuckerl.tensor.lapack import multiply
from tuckerl.tensor.singular import FAILED, SURE, copy
from tuckerl.tensor.sweeps import find_factors
from tuckerl.tensor.tail import energy_beyond
from tuckerl.types import FloatArray, IntArray

START, BEST_FIRST, OWN_FIRST, SWEEP, FIRST_SWEEP, COMPARE = range(6)
"""What `work` may be asked to do."""

ENDED, GOES_ON, UNDECIDED = range(10, 13)
"""What it returns of a first sweep: whether it has gained less than `tol`, or that this is to be found another way."""

ENERGY, TOL, FIT = range(3)
"""Places in `numbers`."""

# Above this fit, errors of energies show in it.
_NEARLY_ALL = 1.0 - 1e-3

# Up to so many rows, finding what the first mode has beyond its rank takes next to no time.
_LARGE = 200


@routine
def work(
    what: int,
    tools: IntArray,
    X: FloatArray,
    sizes: IntArray,
    ranks: IntArray,
    places: IntArray,
    numbers: FloatArray,
    own: FloatArray,
    factors: FloatArray,
    squares: FloatArray,
    buffers: FloatArray,
    room: FloatArray,
    projected: FloatArray,
    core: FloatArray,
) -> int:
    """Do one piece of work of a decomposition.

    Parameters
    ----------
    what : int
        `START`: find the start, as it is in :mod:`tuckerl.tensor.start`. `BEST_FIRST`, `OWN_FIRST`: of it, the best
        factor of the first mode, or its own. `SWEEP`: improve all factors. `FIRST_SWEEP`: improve the start's, which
        has the first of them already, and compare. `COMPARE`: say only on which side of `tol` the gain lies.
    tools : (T,) int64
        As of `new_tools`.
    X : (I_0 * ... * I_{N-1},) float64
    sizes, ranks, places : (N,) int64, (N,) int64, (N + 1,) int64
        As for `find_factors`.
    numbers : (3,) float64
        The sum of squares of X, `tol`, and the fit after the first sweep, which that one writes.
    own, factors : (F,) float64, (F,) float64
        The start's factors, and those that sweeps improve.
    squares, buffers, room : (N + 1, R) float64, (4, I_0 * ... * I_{N-1}) float64, (M,) float64
        As for `find_factors`.
    projected : (P,) float64
        X projected on the start's factors but for the first one, its fibres as rows; written with the best first one.
    core : (C,) float64
        X multiplied by all factors, its modes in reversed order; written by sweeps.

    Returns
    -------
    int
        `SURE`, `UNSURE` or `FAILED` of factors; `ENDED`, `GOES_ON` or `UNDECIDED` of a first sweep.
    """
    n = sizes.size
    if what == COMPARE:
        return _compare(tools, X, sizes, ranks, numbers, squares, room, projected)
    is_sweep = what in (SWEEP, FIRST_SWEEP)
    first = 1 if what in (START, FIRST_SWEEP) else n if what == BEST_FIRST else 0
    beyond = 1 if what == OWN_FIRST else n if is_sweep else n + 1
    if what == FIRST_SWEEP:
        copy(own, factors)
    found, out = (factors, core) if is_sweep else (own, projected)
    status = find_factors(tools, X, sizes, ranks, places, first, beyond, is_sweep, found, squares, buffers, room, out)
    if what != FIRST_SWEEP or status == FAILED:
        return status
    length = 1
    for mode in range(n):
        length *= ranks[mode]
    numbers[FIT] = _fit(_energy(core[:length]), numbers[ENERGY])
    status = _compare(tools, X, sizes, ranks, numbers, squares, room, projected)
    if status != UNDECIDED or numbers[FIT] >= _NEARLY_ALL or sizes[0] > _LARGE:
        return status
    if find_factors(tools, X, sizes, ranks, places, 0, 1, False, own, squares, buffers, room, projected) != SURE:
        return UNDECIDED
    multiply(tools, projected, False, own[places[n] :], True, buffers[2], length // ranks[0], ranks[0], sizes[0])
    fit = _fit(_energy(buffers[2, :length]), numbers[ENERGY])
    return ENDED if abs(numbers[FIT] - fit) < numbers[TOL] else GOES_ON


@routine
def _compare(
    tools: IntArray,
    X: FloatArray,
    sizes: IntArray,
    ranks: IntArray,
    numbers: FloatArray,
    squares: FloatArray,
    room: FloatArray,
    projected: FloatArray,
) -> int:
    """Return whether the start's fit surely differs by less than `tol` from the first sweep's, or surely does not.

    It is at most that with the best first factor. And it is at least what is left where the first mode loses of the
    projection as much as of all.

    Parameters
    ----------
    tools, X : (T,) int64, (I_0 * ... * I_{N-1},) float64
    sizes, ranks, numbers : (N,) int64, (N,) int64, (3,) float64
    squares, room, projected : (N + 1, R) float64, (M,) float64, (P,) float64
        As for `work`.
    """
    energy, tol, fit = numbers[ENERGY], numbers[TOL], numbers[FIT]
    if fit >= _NEARLY_ALL:
        return UNDECIDED
    highest = _fit(_sum(squares[sizes.size, : ranks[0]]), energy)
    if fit - highest >= tol:
        return GOES_ON
    if sizes[0] > _LARGE:
        return UNDECIDED
    length = sizes[0]
    for mode in range(1, sizes.size):
        length *= ranks[mode]
    lost = energy_beyond(tools, X, sizes[0], ranks[0], room)
    lowest = _fit(_energy(projected[:length]) - lost, energy)
    margin = tol * (1.0 - 1e-6)
    return ENDED if fit - lowest < margin and highest < fit + margin else UNDECIDED


@routine
def _fit(core: float, whole: float) -> float:
    """Return the fit of a core with orthonormal factors, as of `fit_of_energies`."""
    return 1.0 - math.sqrt(max(0.0, 1.0 - core / whole))


@routine
def _energy(values: FloatArray) -> float:
    """Return the sum of the squares of `values`, (L,) float64."""
    total = 0.0
    for value in values:
        total += value * value
    return total


@routine
def _sum(values: FloatArray) -> float:
    """Return the sum of `values`, (L,) float64."""
    total = 0.0
    for value in values:
        total += value
    return total
