"""Names for the arrays that pass between the layers."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ByteArray = NDArray[np.uint8]
UInt64Array = NDArray[np.uint64]

StateArray = NDArray[np.uint32]
"""States as kernels keep them: unsigned, so that Numba need not ask at every index whether it counts from the end."""

Stream = UInt64Array
"""(4,) uint64: the state of one random stream."""

Seed = int | np.random.SeedSequence | None
"""What users may pass as a seed."""

Ranks = Sequence[int]
"""One rank for each mode of a tensor."""

AskedRanks = Ranks | float | str
"""Ranks, or the share of a tensor's energy that they are to explain; "auto" is a share by name."""
