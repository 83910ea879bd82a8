"""Other ways to ask a command for its end are heard as Ctrl-C is: what is finished is kept."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_ENDINGS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextmanager
def endings_are_interrupts() -> Iterator[None]:
    """Hear SIGTERM, and SIGHUP where it exists, as Ctrl-C, as often as they come; but for those that are ignored.

    A shell starts what it puts into the background with Ctrl-C ignored, and ``nohup`` starts it with SIGHUP ignored.
    That stays so, and SIGTERM still ends it in order.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread hears signals
        return
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        handler = signal.getsignal(signal.SIGINT)
        if not callable(handler):  # for this moment, as worker processes start
            raise KeyboardInterrupt
        handler(signal.SIGINT, frame)  # which may look at what was running

    def interrupt(number: int, frame: FrameType | None) -> None:
        if asked:
            signal.default_int_handler(number, frame)

    handlers = {ending: ask for ending in _ENDINGS if signal.getsignal(ending) is not signal.SIG_IGN}
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        handlers[signal.SIGINT] = interrupt
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
