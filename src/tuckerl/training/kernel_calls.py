"""Calls of kernels that may take long: how they hear of Ctrl-C, and how they return now and then.

While a kernel runs, no handler of a signal does. So it asks Python now and then, in the caller's thread. A kernel that
may not come to that, because functions of a user's own are in it or because it has to be compiled first, runs in a
thread of its own while the caller's listens. Where it need not, it does not: to change threads, and with them the
core, whose caches have the tables, takes longer than a short window.
"""

import _thread
import contextvars
import itertools
import os
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from tuckerl._jit import NumbaError, is_ours, python_callback, silent
from tuckerl.errors import LearnerError
from tuckerl.interrupts import is_impatient, was_pressed_again
from tuckerl.problems.problem import Problem
from tuckerl.training.agent_arrays import AFTER_EPISODE, AT_ONCE
from tuckerl.training.policies.policy import Policy
from tuckerl.types import IntArray

SLICE = 0.25
"""Seconds after which a kernel returns, at the end of an episode: what is undone and played again takes no longer."""

_LISTENS_EVERY = 0.05  # seconds
_GIVES_UP_AFTER = 0.5  # seconds in which a kernel returns that can
_NUMBERS = itertools.count(1)

Kind = tuple[type, ...]
_RETURNED: set[Kind] = set()
"""What has returned in this process, and so is compiled."""


class _Worker:
    """A thread that runs one function after the other: to start a new one takes longer than a short window."""

    def __init__(self) -> None:
        self._wanted = threading.Lock()
        self._task: Callable[[], object] = _nothing
        self._wanted.acquire()
        _thread.start_new_thread(self._work, ())

    def run(self, task: Callable[[], object]) -> None:
        """Run a function that raises nothing, while the caller goes on."""
        self._task = task
        self._wanted.release()

    def _work(self) -> None:
        while True:
            self._wanted.acquire()
            self._task()
            self._task = _nothing  # whose arrays may be large
            _IDLE.append(self)


def _nothing() -> None:
    pass


_IDLE: list[_Worker] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_IDLE.clear)  # a child has the thread that made it, and no other


def kind_of(problem: Problem, algorithm: type, policy: Policy) -> Kind | None:
    """Return by what kernels are known that call no function of a user's own; None where they may call one."""
    kind = type(problem), algorithm, type(policy)
    return None if problem.has_users_functions or not all(map(is_ours, kind)) else kind


def _listening(stop: IntArray, seconds: float) -> Callable[[int], int]:
    """Return a function that sets `stop` where a kernel should return; just to be called lets Python hear of Ctrl-C."""
    end = time.monotonic() + seconds

    def listen(_: int) -> int:
        if is_impatient():
            stop[0] = AT_ONCE
        elif stop[0] == 0 and time.monotonic() > end:
            stop[0] = AFTER_EPISODE
        return 0

    return listen


class KernelCall:
    """One call of a kernel that plays episodes.

    Parameters
    ----------
    kind : tuple of type, optional
        As of `kind_of`. A kernel that has returned before, and will again, runs in the caller's thread.
    calls_python : bool
        Whether the kernel calls Python, and so belongs to the caller's thread, which made the environment.
    seconds : float
        After how many the kernel is asked to return at the end of an episode.

    Attributes
    ----------
    number : int
        No other call has it.
    stop : (1,) int64
        What the kernel looks at, see `EpisodeRecord`.
    listen : int
        The address of what it calls now and then, which sets `stop`; 0 where another thread does.
    """

    def __init__(self, kind: Kind | None = None, *, calls_python: bool, seconds: float = SLICE) -> None:
        self.number, self.stop = next(_NUMBERS), np.zeros(1, dtype=np.int64)
        self._kind, self._seconds = kind, seconds
        self._in_callers_thread = calls_python or kind in _RETURNED
        self._callback: Any = None
        self.listen = 0
        if self._in_callers_thread:
            self._callback, self.listen = python_callback(_listening(self.stop, seconds))

    @property
    def was_stopped(self) -> bool:
        """Whether the kernel was to return at once, whatever it left behind."""
        return bool(self.stop[0] == AT_ONCE)

    def run(self, kernel: Callable[..., int], *arguments: Any) -> int:
        """Return what the kernel returns.

        Raises
        ------
        KeyboardInterrupt
            If a function in it does not return, and Ctrl-C was pressed again: the call is given up. Where the function
            returns later, the kernel finds `stop` and leaves everything else alone.
        LearnerError
            If a kernel of a user's own, of those that are called, cannot be compiled.
        """
        kernel = silent(kernel)
        try:
            if self._in_callers_thread:
                return kernel(*arguments)
            answer = self._run_beside(kernel, arguments)
            if self._kind is not None:
                _RETURNED.add(self._kind)
            return answer
        except NumbaError as error:
            raise LearnerError(
                "a kernel of your own cannot be compiled: it may use numbers, arrays, math, NamedTuples and what is in "
                "tuckerl.rng, call other kernels, and return what its documentation says; Numba's own words are above"
            ) from error

    def _run_beside(self, kernel: Callable[..., int], arguments: tuple[Any, ...]) -> int:
        answers: list[int] = []
        errors: list[BaseException] = []
        done = threading.Lock()
        done.acquire()

        def work() -> None:
            try:
                answers.append(kernel(*arguments))
            except BaseException as error:  # noqa: BLE001  # raised again where it belongs
                errors.append(error)
            finally:
                done.release()

        try:
            worker = _IDLE.pop()
        except IndexError:
            worker = _Worker()
        worker.run(partial(contextvars.copy_context().run, work))
        begun, stopped = time.monotonic(), 0.0
        while not done.acquire(timeout=_LISTENS_EVERY):
            now = time.monotonic()
            if self.was_stopped:
                if was_pressed_again() and now > stopped + _GIVES_UP_AFTER:
                    raise KeyboardInterrupt
            elif is_impatient():
                self.stop[0], stopped = AT_ONCE, now
            elif now > begun + self._seconds:
                self.stop[0] = AFTER_EPISODE
        if errors:
            raise errors[0]
        return answers[0]
