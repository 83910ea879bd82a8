"""What users' functions answer, as arrays."""

import numpy as np

from tuckerl.checks import NO_ARRAY, refuse_mask
from tuckerl.memory import Part, check_memory
from tuckerl.types import FloatArray


def real_array(name: str, answer: object) -> FloatArray | None:
    """Return a copy of `answer` as float64, or None if it is no array of real numbers.

    Raises
    ------
    ParameterTypeError
        If there is a masked array in it.
    TableSizeError
        If a copy needs more memory than is free, as of a view that is larger than all of it.
    """
    refuse_mask(name, answer)
    try:
        values = np.asarray(answer)
    except NO_ARRAY:
        return None
    check_memory(name, [Part(f"its shape {values.shape}", 8 * values.size, "answer with fewer numbers")])
    return values.astype(np.float64) if values.dtype.kind in "biuf" else None
