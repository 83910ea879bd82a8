"""A sharing rule: copy the agent of the highest return in the window's last episode."""

import numpy as np

from tuckerl.generalization.sharing import ShareContext
from tuckerl.types import FloatArray


def mix(context: ShareContext) -> FloatArray:
    """Return the mixture that copies one agent, (N,)."""
    mixture = np.zeros(context.returns.shape[1])
    mixture[int(np.argmax(context.returns[-1]))] = 1.0
    return mixture
