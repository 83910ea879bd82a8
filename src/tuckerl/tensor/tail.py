"""What a matrix has beyond its leading singular vectors, estimated from above without finding any.

The squares of all singular values but the k largest add up to the squared error of the best matrix of rank k [1]_. No
other one of rank k is better: not the projection on k of the matrix's own rows, those that greedily leave least, which
Cholesky's factorisation with pivots finds from the Gram matrix, and whose error is the trace that it leaves [2]_.

References
----------
.. [1] C. Eckart, G. Young (1936). The approximation of one matrix by another of lower rank. Psychometrika 1, 211-218.
.. [2] N. J. Higham (1990). Analysis of the Cholesky decomposition of a semi-definite matrix. In: Reliable numerical
   computation, 161-185. Oxford University Press.
"""

import math

from tuckerl._jit import routine
from tuckerl.tensor.lapack import gram
from tuckerl.types import FloatArray, IntArray


@routine
def energy_beyond(tools: IntArray, X: FloatArray, n: int, count: int, room: FloatArray) -> float:
    """Return a number that is at least the sum of the squares of all singular values but the `count` largest.

    Parameters
    ----------
    tools : (T,) int64
        As of `new_tools`.
    X : (N * M,) float64
        A matrix of n rows.
    n, count : int
        0 <= count <= n.
    room : (R,) float64
        At least n * (n + count + 1) long.
    """
    G, rows, left = room[: n * n], room[n * n : n * (n + count)], room[n * (n + count) :]
    gram(tools, X, True, n, X.size // n, G)
    for place in range(n):
        left[place] = G[place * n + place]
    for done in range(count):
        pivot = 0
        for place in range(1, n):
            if left[place] > left[pivot]:
                pivot = place
        if left[pivot] <= 0.0:
            return 0.0
        row = rows[done * n : (done + 1) * n]
        for place in range(pivot):
            row[place] = G[place * n + pivot]
        for place in range(pivot, n):
            row[place] = G[pivot * n + place]
        for before in range(done):
            earlier = rows[before * n : (before + 1) * n]
            part = earlier[pivot]
            for place in range(n):
                row[place] -= part * earlier[place]
        scale = 1.0 / math.sqrt(left[pivot])
        for place in range(n):
            row[place] *= scale
            left[place] -= row[place] * row[place]
        left[pivot] = 0.0
    total = 0.0
    for place in range(n):
        total += max(left[place], 0.0)
    return total
