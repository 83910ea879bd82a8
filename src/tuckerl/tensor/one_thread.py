"""One thread for BLAS: the order of additions, and with it every bit, does not depend on how many there are."""

import functools
import threading
from typing import Any

import scipy.linalg  # noqa: F401  # its BLAS must be loaded before it can be limited
from threadpoolctl import ThreadpoolController


@functools.cache
def _libraries() -> list[Any]:
    """Return what limits the threads of BLAS; looking for its libraries takes longer than a small decomposition."""
    return list(ThreadpoolController().lib_controllers)


class _OneThread:
    """A block in which BLAS has one thread: until the last thread of this program that needs it has left."""

    def __init__(self) -> None:
        self._lock, self._n_inside = threading.Lock(), 0
        self._before: list[int] = []

    def __enter__(self) -> None:
        with self._lock:
            if self._n_inside == 0:
                self._before = [library.num_threads for library in _libraries()]
                self._set([1] * len(self._before))
            self._n_inside += 1

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._n_inside -= 1
            if self._n_inside == 0:
                self._set(self._before)

    def _set(self, numbers: list[int]) -> None:
        for library, now, number in zip(_libraries(), self._before, numbers, strict=True):
            if now > 1:
                library.set_num_threads(number)


ONE_THREAD = _OneThread()
