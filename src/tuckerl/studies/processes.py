"""A study's runs are played by processes of this machine, or in this one, to the same bits.

Processes, as the tensor step of small windows is mostly Python, which threads would wait for each other with
(docs/decisions/0003). They are kept from one study to the next. Each has two pieces of the work, so that it does not
wait while results are stored, and a piece is as many runs as take a while; towards the end, runs are handed out one
by one, those first that are known to take longest, so that all workers end together.
"""

import math
import multiprocessing.connection
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from multiprocessing.reduction import ForkingPickler
from types import TracebackType

from threadpoolctl import threadpool_limits

from tuckerl.errors import WorkerError
from tuckerl.studies.playing import warm_up
from tuckerl.studies.study import Study
from tuckerl.studies.worker_process import WorkerProcess, prepare_workers
from tuckerl.studies.workers import Played, Task, play_task

_WAITING = 2  # pieces that a worker is given at once, unless each takes long
_SECONDS_OF_A_PIECE = 0.1  # at least, where there is enough to do
_MOST_IN_A_PIECE = 64
_LONG = 1.0  # seconds of a run, from which on no worker is given one that another might play earlier


class Processes:
    """So many processes of this machine, kept until their block ends; a single one is this process itself.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self._n = workers
        self._workers: list[WorkerProcess] = []

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, traceback: TracebackType | None) -> None:
        self._end_all()

    def _end_all(self) -> None:
        while self._workers:
            self._workers.pop().end()

    def play(self, study: Study, tasks: Sequence[Task]) -> Generator[list[Played], None, None]:
        """Play the tasks and yield what came of them as they end, in any order.

        Kernels are compiled here first, so that workers find them ready.

        Raises
        ------
        WorkerError
            If the study cannot be sent to processes, or none of them starts.
        """
        if not tasks:
            return
        if self._n > 1:
            prepare_workers()
        with threadpool_limits(1):
            warm_up(study)
            if self._n == 1:
                for task in tasks:
                    yield [play_task(study, task)]
                return
        try:
            yield from _Playing(self._workers, self._n, study, tasks).results()
        except BaseException:  # Ctrl-C among them: what is in play is not waited for
            self._end_all()
            raise


class _Playing:
    """Tasks of a study on their way: waiting, given to workers, come back."""

    def __init__(self, workers: list[WorkerProcess], n: int, study: Study, tasks: Sequence[Task]) -> None:
        self._workers, self._n, self._study = workers, min(n, len(tasks)), _pickled(study)
        self._waiting = deque(tasks)
        self._suspects: deque[Task] = deque()  # given to a worker that died: each is played alone, in the end
        self._alone: Task | None = None
        self._seconds: dict[tuple[str, str], float] = {}  # of a variant's latest run
        self._is_end = False  # runs are handed out one by one, the longest first
        for worker in workers:
            worker.prepare(self._study)

    def results(self) -> Iterator[list[Played]]:
        """Give what came of the tasks as they end."""
        while self._waiting or self._suspects or any(worker.given for worker in self._workers):
            self._hire()
            self._hand_out()
            for worker in self._which_spoke():
                played = worker.heard()
                if played is None:
                    yield from self._lose(worker)
                elif played:
                    self._note(played)
                    yield played

    def _hire(self) -> None:
        while len(self._workers) < self._n:
            self._workers.append(worker := WorkerProcess())
            worker.prepare(self._study)

    def _which_spoke(self) -> list[WorkerProcess]:
        ready = set(multiprocessing.connection.wait([one for worker in self._workers for one in worker.handles]))
        return [worker for worker in self._workers if not ready.isdisjoint(worker.handles)]

    def _hand_out(self) -> None:
        ready = [worker for worker in self._workers if worker.is_ready]
        for n_given in range(_WAITING):  # a first piece for all of them before anybody's second
            for worker in ready:
                if len(worker.given) == n_given and self._waiting and (n_given == 0 or self._is_quick()):
                    worker.give(self._piece())
        if self._suspects and ready and not any(worker.given for worker in self._workers):
            self._alone = self._suspects.popleft()
            ready[0].give((self._alone,))

    def _is_quick(self) -> bool:
        """Return whether runs take so little time that a worker may have one waiting."""
        return bool(self._seconds) and max(self._seconds.values()) < _LONG

    def _piece(self) -> tuple[Task, ...]:
        """Return tasks that keep a worker busy for a while, and leave the others their share of what waits."""
        share = len(self._waiting) // (_WAITING * self._n)
        if share <= 1 and not self._is_end:
            self._waiting = deque(sorted(self._waiting, key=self._expected, reverse=True))
            self._is_end = True
        piece, seconds = [self._waiting.popleft()], 0.0
        while len(piece) < min(share, _MOST_IN_A_PIECE):
            seconds += self._expected(piece[-1])
            if seconds >= _SECONDS_OF_A_PIECE:
                break
            piece.append(self._waiting.popleft())
        return tuple(piece)

    def _expected(self, task: Task) -> float:
        """Return how long a run takes, as far as is known: as the latest one of its variant."""
        return self._seconds.get((task.run.scenario, task.run.variant), math.inf)

    def _note(self, played: list[Played]) -> None:
        for one in played:
            if one.tables is not None:
                self._seconds[one.run.scenario, one.run.variant] = one.tables.times["seconds"][0]

    def _lose(self, worker: WorkerProcess) -> Iterator[list[Played]]:
        """Take back what a worker was given that has died."""
        self._workers.remove(worker)
        pieces, is_new = list(worker.given), not worker.is_ready
        worker.end()
        if is_new and not self._workers:
            raise WorkerError(_NONE_STARTS)
        if is_new:  # the others do its share
            self._n = min(self._n, len(self._workers))
        for piece in pieces[1:]:
            self._waiting.extendleft(reversed(piece))
        if self._alone is not None and pieces:
            yield [Played(self._alone.run, None, _DIED)]
        elif pieces:
            self._suspects += pieces[0]
        self._alone = None


def _pickled(study: Study) -> bytes:
    try:
        return bytes(ForkingPickler.dumps(study))
    except Exception as error:
        raise WorkerError(
            f"the study cannot be sent to worker processes ({error}): let its problem be a function or a class of a "
            "module that they can import, without open files, locks or the like; or ask for one worker"
        ) from error


_NONE_STARTS = (
    "the worker processes ended before any of them could play a run: ask for one worker, to see why; in a program of "
    'your own, start the study below `if __name__ == "__main__":`, as each worker imports it'
)
_DIED = (
    "The process that played this run died, twice: it was killed, or left no memory. Give it fewer workers, or a "
    "smaller problem.\n"
)
