"""The record of a learner's tensor steps, window by window."""

from typing import NamedTuple

import numpy as np

from tuckerl.types import BoolArray, FloatArray, IntArray


class TensorStepHistory(NamedTuple):
    """What the step did each of W times: after each window, and where tables are shared more often, then too."""

    episode: IntArray  # (W,) episodes finished by then
    weights: FloatArray  # (W, A) the learning-rate weights from then on
    chosen: IntArray  # (W,) the agent whose table was copied, -1 where none was
    fit: FloatArray  # (W,) of the decomposition, NaN where there was none
    ranks: IntArray  # (W, 4) used, 0 where there was no decomposition, -1 where none could be found

    @property
    def failed(self) -> BoolArray:
        """After which windows no decomposition could be found, (W,): weights and tables stayed as they were."""
        return np.asarray((self.ranks < 0).any(axis=1))


def empty_history(n_actions: int) -> TensorStepHistory:
    """Return the history of no windows."""
    none = np.zeros(0, dtype=np.int64)
    return TensorStepHistory(none, np.zeros((0, n_actions)), none, np.zeros(0), np.zeros((0, 4), dtype=np.int64))
