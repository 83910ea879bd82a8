"""Which states lead where."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from tuckerl.types import BoolArray, IntArray


def reachable_from(graph: csr_array, sources: BoolArray) -> BoolArray:
    """Return the nodes to which some path leads from one of the sources, (N,), the sources among them.

    Parameters
    ----------
    graph : (N, N) sparse
        An entry in row i and column j is an edge from i to j.
    sources : (N,) bool
    """
    n, first = graph.shape[0], np.flatnonzero(sources)
    indptr = np.append(graph.indptr, graph.indptr[-1] + first.size)  # one more node, which leads to all sources
    indices = np.concatenate([graph.indices, first])
    whole = csr_array((np.ones(indices.size), indices, indptr), shape=(n + 1, n + 1))
    found = np.zeros(n + 1, dtype=np.bool_)
    found[breadth_first_order(whole, n, return_predecessors=False)] = True
    return found[:n]


def named(states: IntArray) -> str:
    """Return the first few states' numbers in words.

    Examples
    --------
    >>> named(np.array([3])), named(np.arange(12))
    ('state 3', 'states 0, 1, 2, 3, 4 and 7 more')
    """
    if len(states) == 1:
        return f"state {states[0]}"
    first = ", ".join(map(str, states[:5]))
    return f"states {first} and {len(states) - 5:,} more" if len(states) > 5 else f"states {first}"
