"""Calls of kernels that may take long: how they hear of Ctrl-C, and how they return now and then.

While a kernel runs, no handler of a signal does. So a kernel runs in a thread of its own while the caller's listens;
or, where it calls Python anyway (an environment belongs to the thread that made it), in the caller's, asking now and
then. One that is over before anybody would notice runs in the caller's, too, and asks nothing: to change threads, and
with them the core, whose caches have the tables, takes longer than a short window (see `Pace`).
"""

import _thread
import contextvars
import itertools
import math
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
from tuckerl.training.agent_arrays import AFTER_EPISODE, AT_ONCE, AgentArrays

SLICE = 0.25
"""Seconds after which a kernel returns, at the end of an episode: what is undone and played again takes no longer."""

_LISTENS_EVERY = 0.05  # seconds
_GIVES_UP_AFTER = 0.5  # seconds in which a kernel returns that can
_BRIEF = 0.02  # seconds of a call that need not hear of Ctrl-C
_NUMBERS = itertools.count(1)


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


class Pace:
    """How long a step of one learner takes, by which its next call is judged before it is made.

    Parameters
    ----------
    may_hang : bool
        Whether functions of a user's own are called, which need not return.
    """

    def __init__(self, *, may_hang: bool) -> None:
        self._may_hang = may_hang
        self._kind: tuple[Any, ...] | None = None  # of what was played last: another one may have to be compiled
        self._seconds_of_a_step = math.inf

    def is_brief(self, world: Any, agent: Any) -> bool:
        """Return whether a call takes a moment, though all its episodes be as long as the time limit allows.

        Parameters
        ----------
        world : NamedTuple
            What the kernel reads of the problem.
        agent : AgentArrays or tuple of them
        """
        if self._kind is None or _kind(world, agent) != self._kind:
            return False
        most: int = agent.record.steps.size * world.max_episode_steps
        return most * self._seconds_of_a_step <= _BRIEF

    def note(self, world: Any, agent: Any, *, n_finished: int, seconds: float) -> None:
        """Remember how long a call took that has finished so many episodes."""
        kind = _kind(world, agent)
        is_known = kind is not None and not self._may_hang and all(map(is_ours, kind[:-1]))
        steps = int(agent.record.steps[:n_finished].sum()) if is_known and n_finished > 0 else 0
        self._kind = kind if steps else None
        self._seconds_of_a_step = seconds / steps if steps else math.inf


def _kind(world: Any, agent: Any) -> tuple[Any, ...] | None:
    """Return what a kernel is compiled for, as far as it differs between calls of a learner; None of several agents."""
    if not isinstance(agent, AgentArrays):
        return None
    return type(world), type(agent.algorithm), type(agent.policy), type(agent.maxima), len(agent.log.tables)


class KernelCall:
    """One call of a kernel that plays episodes.

    Parameters
    ----------
    calls_python : bool
        Whether the kernel calls Python, and so belongs to the caller's thread.
    pace : Pace, optional
        The learner's; without it, no call is brief.
    is_replay : bool
        Whether it plays again what has been played: to the end, in the caller's thread, deaf.
    seconds : float
        After how many the kernel is asked to return at the end of an episode, where nothing in Python tells it.

    Attributes
    ----------
    number : int
        No other call has it.
    stop : (1,) int64
        What the kernel looks at, see `EpisodeRecord`.
    listen : int
        The address of what it calls to hear of Ctrl-C; 0 where it need not.
    """

    def __init__(
        self, *, calls_python: bool, pace: Pace | None = None, is_replay: bool = False, seconds: float = SLICE
    ) -> None:
        self.number, self.stop = next(_NUMBERS), np.zeros(1, dtype=np.int64)
        self._pace, self._stays, self._seconds = pace, calls_python or is_replay, seconds
        self._callback: Any = None
        self.listen = 0
        if calls_python:
            self._callback, self.listen = python_callback(self._listen)

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
            if self._stays:
                return kernel(*arguments)
            if self._pace is None:
                return self._run_beside(kernel, arguments)
            is_brief, begun = self._pace.is_brief(*arguments), time.monotonic()
            n = kernel(*arguments) if is_brief else self._run_beside(kernel, arguments)
            self._pace.note(*arguments, n_finished=n, seconds=time.monotonic() - begun)
            return n
        except NumbaError as error:
            raise LearnerError(
                "a kernel of your own cannot be compiled: it may use numbers, arrays, math, NamedTuples and what is in "
                "tuckerl.rng, call other kernels, and return what its documentation says; Numba's own words are above"
            ) from error

    def _listen(self, _: int) -> int:
        """Set `stop` where a kernel in this thread should break off; just to be called lets Python hear of Ctrl-C."""
        if is_impatient():
            self.stop[0] = AT_ONCE
        return 0

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
        try:
            self._listen_until(done)
        except BaseException:  # also what a handler of another signal raises: the kernel is to leave the arrays alone
            if not self.was_stopped:
                self.stop[0] = AT_ONCE
                done.acquire(timeout=_GIVES_UP_AFTER)
            raise
        if errors:
            raise errors[0]
        return answers[0]

    def _listen_until(self, done: threading.Lock) -> None:
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
