"""Ctrl-C, held back while a learner is between two states that it could go on from."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_held: list[tuple[int, FrameType | None]] = []


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Let Ctrl-C wait for the end of the block.

    Python would hear it right after a kernel returns: some agents would have played, and nothing would know it.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    _held.clear()
    signal.signal(signal.SIGINT, lambda number, frame: _held.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        first = _held[:1]
        _held.clear()
    if first:
        before(*first[0])


def is_impatient() -> bool:
    """Return whether a second Ctrl-C came while the first one was held back."""
    return len(_held) > 1
