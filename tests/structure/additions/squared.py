"""A weighting: the paper's weights, squared."""

import numpy as np

from tuckerl.errors import ParameterError
from tuckerl.generalization.weights import action_weights
from tuckerl.tensor import TuckerDecomposition
from tuckerl.types import FloatArray


def weigh(decomposition: TuckerDecomposition | None, n_actions: int, rng: np.random.Generator) -> FloatArray:
    """Return the squares of the paper's weights, (A,)."""
    if decomposition is None:
        raise ParameterError("this weighting needs a decomposition")
    return np.square(action_weights(decomposition.factors[1]))
