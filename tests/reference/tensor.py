"""The Tucker decomposition by its definition: loops over entries and a full SVD of each unfolding, no shortcuts."""

import itertools

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def unfold(X: Floats, mode: int) -> Floats:
    """Entry by entry: row i_n, column counted over the other indices, the last of them fastest."""
    others = [size for n, size in enumerate(X.shape) if n != mode]
    matrix = np.zeros((X.shape[mode], int(np.prod(others))))
    for index in itertools.product(*map(range, X.shape)):
        column = 0
        for n, i in enumerate(index):
            if n != mode:
                column = column * X.shape[n] + i
        matrix[index[mode], column] = X[index]
    return matrix


def mode_product(X: Floats, matrix: Floats, mode: int) -> Floats:
    """``Y[.., j, ..] = sum over i of matrix[j, i] X[.., i, ..]``."""
    shape = list(X.shape)
    shape[mode] = matrix.shape[0]
    Y = np.zeros(shape)
    for index in itertools.product(*map(range, X.shape)):
        for j in range(matrix.shape[0]):
            target = (*index[:mode], j, *index[mode + 1 :])
            Y[target] += matrix[j, index[mode]] * X[index]
    return Y


def leading_vectors(X: Floats, mode: int, rank: int) -> Floats:
    """Return the leading left singular vectors of an unfolding."""
    return np.linalg.svd(unfold(X, mode))[0][:, :rank]


def project(X: Floats, factors: list[Floats], skip: int | None = None) -> Floats:
    """Multiply by the transposed factors in every mode but one."""
    for mode, factor in enumerate(factors):
        if mode != skip:
            X = mode_product(X, factor.T, mode)
    return X


def expand(core: Floats, factors: list[Floats]) -> Floats:
    """Multiply a core by its factors."""
    for mode, factor in enumerate(factors):
        core = mode_product(core, factor, mode)
    return core


def tucker(X: Floats, ranks: tuple[int, ...], iterations: int) -> Floats:
    """Return the approximation after so many sweeps of HOOI from the truncated higher-order SVD."""
    factors = [leading_vectors(X, mode, rank) for mode, rank in enumerate(ranks)]
    for _ in range(iterations):
        for mode, rank in enumerate(ranks):
            factors[mode] = leading_vectors(project(X, factors, skip=mode), mode, rank)
    return expand(project(X, factors), factors)
