"""Python functions that an algorithm's kernels call, for example to learn a model between episodes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tuckerl._jit import call_python, kernel, python_callback
from tuckerl.errors import LearnerError
from tuckerl.interrupts import is_impatient, may_raise_interrupts
from tuckerl.types import BoolArray

_LEAST, _MOST = np.iinfo(np.int64).min, np.iinfo(np.int64).max


class PythonCallArrays(NamedTuple):
    """What kernels need to call a Python function."""

    address: int
    failed: BoolArray  # (1,) whether the function has raised an error


@kernel
def call_function(call: PythonCallArrays, argument: int) -> int:
    """Call a Python function from a kernel and return its answer, 0 if it raises an error.

    A kernel that calls one returns False from `update` or `end_episode` when ``call.failed`` (1,) is True.
    """
    return call_python(call.address, argument)


class PythonCall:
    """A Python function that kernels call through `call_function`, with its `arrays` among the algorithm's constants.

    Parameters
    ----------
    function : callable
        From an int to an int; what it has to say beyond that, it writes into arrays.
    """

    def __init__(self, function: Callable[[int], int]) -> None:
        self._function = function
        self._error: BaseException | None = None
        self._callback, address = python_callback(self._call)
        self.arrays = PythonCallArrays(address, np.zeros(1, dtype=np.bool_))

    @may_raise_interrupts
    def _call(self, argument: int) -> int:
        try:
            if is_impatient():
                raise KeyboardInterrupt
            return self._checked(self._function(argument))
        except BaseException as error:  # noqa: BLE001  # raised again when the kernel has returned
            self._error, self.arrays.failed[0] = error, True
            return 0

    def _checked(self, answer: object) -> int:
        """Return a function's answer as kernels take it: a whole number of 64 bits."""
        is_whole = isinstance(answer, (int, np.integer, np.bool_))
        if not is_whole or not _LEAST <= int(answer) <= _MOST:  # type: ignore[call-overload]  # it is a number there
            name = getattr(self._function, "__qualname__", repr(self._function))
            raise LearnerError(
                f"{name}, which kernels call, must return a whole number of at most 64 bits; it returned "
                f"{answer!r:.200}"
            )
        return int(answer)  # type: ignore[call-overload]  # as above

    def take_error(self) -> BaseException | None:
        """Return the error that the function raised, if any, and forget it."""
        error, self._error, self.arrays.failed[0] = self._error, None, False
        return error
