"""Tensors for the tests of this folder."""

import numpy as np
from numpy.typing import NDArray

from tuckerl.tensor import mode_product

Floats = NDArray[np.float64]


def random_tensor(shape: tuple[int, ...], seed: int = 0) -> Floats:
    return np.random.default_rng(seed).standard_normal(shape)


def low_rank(shape: tuple[int, ...], ranks: tuple[int, ...], noise: float = 0.0, seed: int = 0) -> Floats:
    """Make a tensor of known ranks, and add noise of so large a part of its norm."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal(ranks)
    for mode, (size, rank) in enumerate(zip(shape, ranks, strict=True)):
        X = mode_product(X, np.linalg.qr(rng.standard_normal((size, rank)))[0], mode)
    rest = rng.standard_normal(shape)
    return np.asarray(X + noise * np.linalg.norm(X) / np.linalg.norm(rest) * rest)
