"""What users' functions answer, as arrays."""

import numpy as np

from tuckerl.checks import array_of_kinds
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
    values = array_of_kinds(name, answer, "biuf")
    if values is None:
        return None
    check_memory(name, [Part(f"its shape {values.shape}", 8 * values.size, "answer with fewer numbers")])
    return values.astype(np.float64)
