"""Ctrl-C, held back while a learner is between two states that it could go on from.

Python would hear it right after a kernel returns: some agents would have played, and nothing would know it. Or it would
hear it at the door of a function that a kernel calls, from where no error finds its way out. So it waits, but not for
long: after a second, or when it is pressed again, `is_impatient` tells whatever takes its time to break off.
"""

import _thread
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FrameType
from typing import Any, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])

PATIENCE = 1.0  # seconds that Ctrl-C waits for a better moment
_UNHEARD = PATIENCE + 0.7  # seconds after which something does not listen
_WORDS = (
    "\nCtrl-C was heard, but what is running here has not returned yet: a function that a learner calls, or a kernel "
    "that is being compiled. Press Ctrl-C again to break it off.\n"
)

_held: list[tuple[int, FrameType | None]] = []
_since = 0.0
_bearable = 1
_may_raise: set[CodeType] = set()


@contextmanager
def interrupts_held_back(bearable: int = 1) -> Iterator[None]:
    """Let Ctrl-C wait for the end of the block, which looks at `is_impatient`; an error does not make it forgotten.

    Parameters
    ----------
    bearable : int
        How often Ctrl-C may be pressed before the block should break off.
    """
    global _bearable
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    outer, _bearable = _bearable, bearable
    signal.signal(signal.SIGINT, _hold)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        _bearable = outer
        first = _held[:1]
        _held.clear()
        if first:
            before(*first[0])


def _hold(number: int, frame: FrameType | None) -> None:
    global _since
    if not _held:
        _since = time.monotonic()
        _thread.start_new_thread(_speak_if_unheard, (_since,))  # a lock of the module threading may be held here
    _held.append((number, frame))
    if was_pressed_again() and frame is not None and _is_in_users_function(frame):
        raise KeyboardInterrupt


def _speak_if_unheard(since: float) -> None:
    time.sleep(_UNHEARD)
    if _held and _since == since and sys.stderr is not None:
        sys.stderr.write(_WORDS)
        sys.stderr.flush()


def _is_in_users_function(frame: FrameType) -> bool:
    """Return whether a function that `may_raise_interrupts` has called another one, which is running now."""
    caller = frame.f_back
    while caller is not None and caller.f_code not in _may_raise:
        caller = caller.f_back
    return caller is not None


def may_raise_interrupts(function: _Function) -> _Function:
    """Let Ctrl-C that is pressed again be raised in what `function` calls; an error there must leave nothing broken.

    Only so can a function of a user's own be left that never returns.
    """
    _may_raise.add(function.__code__)
    return function


def is_waiting() -> bool:
    """Return whether Ctrl-C was pressed and waits for the end of a block."""
    return bool(_held)


def is_impatient() -> bool:
    """Return whether to break off: Ctrl-C was pressed more often than can be borne, or a while ago."""
    return bool(_held) and (was_pressed_again() or time.monotonic() > _since + PATIENCE)


def was_pressed_again() -> bool:
    """Return whether Ctrl-C was pressed more often than the block that holds it back can bear."""
    return len(_held) > _bearable
