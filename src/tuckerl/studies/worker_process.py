"""A process that plays runs for the one that has started it, on one BLAS thread, so that all bits agree.

It ends with that process, and Ctrl-C is not its business. On Linux it is forked from a server that has imported the
package once for all of them and does nothing else; elsewhere each imports it.
"""

import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from typing import Any

import scipy.linalg  # noqa: F401  # its BLAS must be loaded before it can be limited
from threadpoolctl import threadpool_limits

from tuckerl.studies.playing import warm_up
from tuckerl.studies.study import Study
from tuckerl.studies.workers import Played, Task, play_task

_IS_FORKED = sys.platform == "linux"
_CONTEXT: Any = multiprocessing.get_context("forkserver" if _IS_FORKED else "spawn")
_SECONDS_TO_END = 1.0


def prepare_workers() -> None:
    """Let the server begin to import what workers need, while this process does other things."""
    if _IS_FORKED:
        _CONTEXT.set_forkserver_preload([__name__, *({"typer"} & set(sys.modules))])  # which the command line needs
        with _interrupts_ignored():
            forkserver.ensure_running()


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C here and in every process that is started meanwhile, for as long as that process lives."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread hears signals, and only it may say what becomes of them
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class WorkerProcess:
    """A worker as the process sees it that has started it.

    Attributes
    ----------
    handles : tuple
        For `multiprocessing.connection.wait`: one of them is ready where the worker has said something, or has ended.
    given : deque of tuples of Task
        What it was given and has not said anything of, the piece in front being in play.
    """

    def __init__(self) -> None:
        self._connection, theirs = _CONTEXT.Pipe()
        self.given = deque[tuple[Task, ...]]()
        self._n_studies = 0  # that it was sent and has not said anything of
        self._process = _CONTEXT.Process(target=_work, args=(theirs,))
        if _IS_FORKED:  # by the server, which ignores Ctrl-C: it may be heard here while that imports
            self._process.start()
        else:
            with _interrupts_ignored():
                self._process.start()
        theirs.close()
        # Its connection does not tell that it has ended as long as a process that it has started holds its end open.
        self.handles = self._connection, self._process.sentinel

    @property
    def is_ready(self) -> bool:
        """Whether it can play the latest study that it was sent."""
        return self._n_studies == 0

    def prepare(self, study: bytes) -> None:
        """Send it the study that its tasks are of, pickled."""
        self._n_studies += 1
        with suppress(OSError):  # it has ended, which its handles say
            self._connection.send_bytes(study)

    def give(self, piece: tuple[Task, ...]) -> None:
        """Let it play a piece after all that it was given before."""
        self.given.append(piece)
        with suppress(OSError):
            self._connection.send(piece)

    def heard(self) -> list[Played] | None:
        """Return what came of the piece in front; nothing where it says that it is ready; None where it has ended."""
        try:
            if not self._connection.poll():
                return None
            said: list[Played] = self._connection.recv()
        except (EOFError, OSError):
            return None
        if self.is_ready:
            self.given.popleft()
        else:
            self._n_studies -= 1
        return said

    def end(self) -> None:
        """Let it end; what it plays is lost."""
        self._connection.close()
        if self.given or not self.is_ready:
            self._process.kill()
        self._process.join(_SECONDS_TO_END)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _work(connection: Connection) -> None:
    """Play pieces of the study that was sent last, until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    os.environ.setdefault("POLARS_MAX_THREADS", "1")  # its tables are small, and there is a worker for each core
    threadpool_limits(1)
    study: Study | None = None
    with suppress(EOFError, OSError):
        while True:
            given = connection.recv()
            if isinstance(given, Study):
                study = given
                warm_up(study)  # or the first runs would pay for loading the kernels
                connection.send([])
            elif study is not None:
                connection.send([play_task(study, task) for task in given])


def _end_with_parent() -> None:
    """End this worker when the process that started it has ended, however that was: nobody waits for its tasks."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
