"""The weights by which agents' tables are mixed, and mixing.

A *mixture* of N agents is (N,) numbers that sum to 1, by which whole tables are mixed: a single 1 copies one agent's.
Or it is (N, R, A) numbers that sum to 1 over the agents, by which each entry of R rows is mixed in its own way.
"""

import math
from typing import Any

import numpy as np

from tuckerl._jit import kernel
from tuckerl.types import FloatArray, IntArray


def copy_of(agent: int, n_agents: int) -> FloatArray:
    """Return the mixture that copies one agent's table, (N,)."""
    mixture = np.zeros(n_agents)
    mixture[agent] = 1.0
    return mixture


def is_copy(mixture: FloatArray) -> bool:
    """Return whether a mixture is one agent's table alone."""
    return mixture.ndim == 1 and int(np.count_nonzero(mixture)) == 1


def agent_weights(mixture: FloatArray) -> FloatArray:
    """Return the weights of whole tables, (N,): of a mixture of entries their means, equal ones if it has none."""
    if mixture.ndim == 1:
        return mixture
    n_agents, *rows = mixture.shape
    return mixture.mean(axis=(1, 2)) if all(rows) else np.full(n_agents, 1.0 / n_agents)


def row_weights(mixture: FloatArray) -> FloatArray:
    """Return the weights of whole rows: (N,) as it is, (N, R, A) becomes the means over the actions, (N, R)."""
    return mixture if mixture.ndim == 1 else np.asarray(mixture.mean(axis=2))


def share_tables(q: FloatArray, mixture: FloatArray, states: IntArray | None) -> None:
    """Let every agent go on with the mixture of all (N, S, A) tables, updated in place.

    Where the `states` are known that differ between tables, only their rows are mixed; a mixture of entries is of
    theirs. Entries in which the tables of such a mixture are equal stay as they are, to the last bit.
    """
    rows: Any = slice(None) if states is None else states
    if is_copy(mixture):
        q[:, rows] = q[int(np.argmax(mixture)), rows]
        return
    if mixture.ndim == 1:
        with np.errstate(over="ignore", invalid="ignore"):  # the end of the next window finds what is not finite
            q[:, rows] = np.tensordot(mixture, q[:, rows], axes=1)
        return
    tables = np.ascontiguousarray(q[:, rows], dtype=np.float64)
    n_agents, n_rows, *others = tables.shape
    mixed = np.empty((n_rows, math.prod(others)))
    weights = mixture.reshape(n_agents, n_rows, math.prod(mixture.shape[2:]))
    _mix_entries(mixed, tables.reshape(n_agents, *mixed.shape), weights)
    q[:, rows] = mixed.reshape(tables.shape[1:])


@kernel
def _mix_entries(mixed: FloatArray, tables: FloatArray, weights: FloatArray) -> None:
    """Mix each entry in its own way; entries in which the tables are equal stay as they are.

    Parameters
    ----------
    mixed : (R, K) float64
        Changed.
    tables : (N, R, K) float64
    weights : (N, R, K) float64
        Or (N, R, 1) for the same in all entries of a row.
    """
    for row in range(mixed.shape[0]):
        for column in range(mixed.shape[1]):
            first, total, are_equal = tables[0, row, column], 0.0, True
            place = min(column, weights.shape[2] - 1)
            for agent in range(tables.shape[0]):
                value = tables[agent, row, column]
                total += weights[agent, row, place] * value
                are_equal = are_equal and value == first
            mixed[row, column] = first if are_equal else total
