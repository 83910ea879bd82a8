"""Ctrl-C, held back while a learner is between two states that it could go on from."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_held: list[tuple[int, FrameType | None]] = []
_bearable = 1


@contextmanager
def interrupts_held_back(bearable: int = 1) -> Iterator[None]:
    """Let Ctrl-C wait for the end of the block, which may look at `is_impatient`; an error does not make it forgotten.

    Python would hear it right after a kernel returns: some agents would have played, and nothing would know it. Or it
    would hear it at the door of a function that a kernel calls, from where no error finds its way out.

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
    _bearable = bearable
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
    """Return whether Ctrl-C was pressed more often than the block that holds it back can bear."""
    return len(_held) > _bearable
