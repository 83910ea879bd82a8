"""What users' functions answer, as arrays."""

import numpy as np

from tuckerl.types import FloatArray


def real_array(answer: object) -> FloatArray | None:
    """Return a copy of `answer` as float64, or None if it is no array of real numbers."""
    try:
        values = np.asarray(answer)
    except ValueError:  # lists of different lengths
        return None
    return values.astype(np.float64) if values.dtype.kind in "biuf" else None
