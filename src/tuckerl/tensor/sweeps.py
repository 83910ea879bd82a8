"""The factors of a Tucker decomposition, one mode after the other: of the tensor itself, or of a projection of it.

A factor stands here with its vectors as rows, (r_n, I_n), the weakest first; all factors follow one another in one flat
array, each from its own place on.
"""

from tuckerl._jit import routine
from tuckerl.tensor.lapack import multiply
from tuckerl.tensor.singular import FAILED, SURE, copy, leading
from tuckerl.types import FloatArray, IntArray


@routine
def find_factors(
    tools: IntArray,
    X: FloatArray,
    sizes: IntArray,
    ranks: IntArray,
    places: IntArray,
    first: int,
    beyond: int,
    is_sweep: bool,
    factors: FloatArray,
    squares: FloatArray,
    buffers: FloatArray,
    room: FloatArray,
    out: FloatArray,
) -> int:
    """Find the factors of the truncated higher-order SVD; or, in a sweep, improve factors, each given all others.

    Parameters
    ----------
    tools : (T,) int64
        As of `new_tools`.
    X : (I_0 * ... * I_{N-1},) float64
    sizes, ranks : (N,) int64, (N,) int64
    places : (N + 1,) int64
        Where each factor stands in `factors`; in place of the first mode's own, which has the last place, the best one.
    first, beyond : int
        From which mode on, and up to which one; where N stands for the best first factor, given the others.
    is_sweep : bool
    factors : (F,) float64
        Changed.
    squares : (N + 1, R) float64
        Written: the squares of the singular values that belong to the factors, rising.
    buffers : (4, I_0 * ... * I_{N-1}) float64
        Room.
    room : (M,) float64
        Room as of `room_for`.
    out : (O,) float64
        Written: by a sweep, X multiplied by all factors, its modes in reversed order; else, with the best first factor,
        what that is made of, the fibres of X projected on all others, as rows.

    Returns
    -------
    int
        `SURE`, `UNSURE` if some values are so small that one pass did not resolve them, or `FAILED`.
    """
    # Of a sweep: X projected on the factors so far, whose axes come first, the latest one's before the earlier ones'.
    projected, n, n_columns = X, X.size, 1
    n_modes, status = sizes.size, SURE
    for stage in range(0 if is_sweep else first, beyond):
        mode = stage if stage < n_modes else 0
        factor = factors[places[n_modes - stage if mode == 0 and not is_sweep else mode] :]
        size, rank = sizes[mode], ranks[mode]
        if stage >= first:
            fibres = buffers[2]
            length = n
            has_rows = is_sweep or stage >= n_modes - 1
            if is_sweep or stage == n_modes:
                length = _project(tools, projected, n, sizes, ranks, places, mode, factors, buffers)
                if not is_sweep:
                    copy(fibres[:length], out)
            elif mode == 0 or has_rows:
                fibres = X
            else:
                n_before = 1
                for earlier in range(mode):
                    n_before *= sizes[earlier]
                _to_front(X, n_before, size, n // (n_before * size), fibres)
            one = leading(tools, fibres, has_rows, size, length // size, rank, factor, squares[stage], room, buffers[3])
            status = max(status, one)
            if status == FAILED:
                break
        if is_sweep:
            n_others = n // size
            rows = projected
            if n_columns > 1:
                rows = buffers[2]
                _to_front(projected, n_columns, size, n_others // n_columns, rows)
            projected = buffers[mode % 2]
            multiply(tools, factor, False, rows, False, projected, rank, n_others, size)
            n, n_columns = rank * n_others, n_columns * rank
    if is_sweep:
        copy(projected[:n], out)
    return status


@routine
def _project(
    tools: IntArray,
    X: FloatArray,
    n: int,
    sizes: IntArray,
    ranks: IntArray,
    places: IntArray,
    mode: int,
    factors: FloatArray,
    buffers: FloatArray,
) -> int:
    """Multiply all modes behind one by their factors; write its fibres as rows to the third buffer, return their size.

    They stand in an order of the other modes that is immaterial to singular values and left singular vectors.

    Parameters
    ----------
    tools : (T,) int64
    X : (N,) float64
        The tensor, whose last modes these are.
    n : int
        How many numbers it has.
    sizes, ranks, places : (N,) int64, (N,) int64, (N + 1,) int64
    mode : int
    factors : (F,) float64
    buffers : (4, M) float64
        The last two are changed.
    """
    n_factors = sizes.size - 1 - mode
    if n_factors == 0:
        copy(X[:n], buffers[2])
    for later in range(sizes.size - 1, mode, -1):
        # Contracting the last axis and putting the result first is one matrix product, and nothing is transposed.
        n_factors -= 1
        target, n_others = buffers[2 + n_factors % 2], n // sizes[later]
        multiply(tools, factors[places[later] :], False, X, True, target, ranks[later], n_others, sizes[later])
        X, n = target, ranks[later] * n_others
    return n


@routine
def _to_front(X: FloatArray, n_before: int, size: int, n_behind: int, rows: FloatArray) -> None:
    """Write a tensor (n_before, size, n_behind) as one (size, n_before, n_behind).

    Parameters
    ----------
    X : (N,) float64
    n_before, size, n_behind : int
    rows : (N,) float64
        Written.
    """
    for i in range(size):
        for j in range(n_before):
            source = (j * size + i) * n_behind
            target = (i * n_before + j) * n_behind
            for k in range(n_behind):
                rows[target + k] = X[source + k]
