"""A study's runs are played by the workers of a Dask scheduler, on any number of machines, to the same bits as here.

Dask carries tasks and results and knows which workers live. Who plays what is decided here: a worker is given tasks
only after it has shown that it runs the same code on the same versions, in two pieces, so that none waits and the
scheduler holds few. A piece has as many tasks as keep a worker busy for a while, as each costs the scheduler and this
process some milliseconds. What a lost worker was given is played again.
"""

import logging
import socket
import time
import uuid
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

from tuckerl.errors import MissingExtraError, WorkerError, WorkerWarning, warn
from tuckerl.studies.cluster_worker import play, prepare, sent
from tuckerl.studies.study import Study
from tuckerl.studies.workers import Played, Task

if TYPE_CHECKING:
    from distributed import Client, Future

_WAITING = 2  # pieces that a worker is given at once
_SECONDS_OF_A_PIECE = 0.5  # at least, where there is enough to do
_SECONDS_TO_HANDLE = 0.005  # a piece, by the scheduler and this process: with many workers pieces take longer
_MOST_IN_A_PIECE = 500
_DEATHS = 3  # of the workers that a task was given to, twice to it alone, after which it is to blame
_SECONDS_TO_CONNECT = 5.0  # to a port, and then to what listens there
_SECONDS_BETWEEN_LOOKS = 1.0  # at which workers live
_SECONDS_TO_FETCH = 30.0  # what a worker has left


def play_on_cluster(study: Study, tasks: Sequence[Task], address: str) -> Generator[list[Played], None, None]:
    """Play the tasks on a scheduler's workers and yield what came of them as they end, in any order.

    No checkpoints are kept: a folder of this machine need not be one of a worker's.

    Parameters
    ----------
    study : Study
    tasks : sequence of Task
    address : str
        The scheduler's, such as ``tcp://host:8786``.

    Raises
    ------
    MissingExtraError
        If ``dask.distributed`` is not installed.
    WorkerError
        If the scheduler cannot be reached or goes away, the study cannot be sent, or no worker can play it.
    """
    if not tasks:
        return
    with _connected(address) as client:
        yield from _Playing(client, study, tasks).results()


@contextmanager
def _connected(address: str) -> "Iterator[Client]":
    """Give a client, which is closed in the end: the scheduler then forgets what it was given."""
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError as error:
        raise MissingExtraError(
            'a cluster needs dask.distributed, which is not installed: pip install "tuckerl[cluster]"'
        ) from error
    try:
        socket.create_connection(get_address_host_port(address), _SECONDS_TO_CONNECT).close()
        client = Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except Exception as error:
        raise WorkerError(
            f"no Dask scheduler answers at {address} ({error}): give the address that `dask scheduler` shows when it "
            "starts, such as tcp://host:8786, and see that this machine may connect to its port"
        ) from error
    log = logging.getLogger("distributed.client")
    level = log.level
    log.setLevel(logging.CRITICAL)  # what happens to the connection is said here, in a sentence
    try:
        yield client
    finally:
        client.close(_SECONDS_BETWEEN_LOOKS)
        log.setLevel(level)


class _Given(NamedTuple):
    """What a worker was given: a piece of tasks; none stand for being prepared."""

    worker: str
    tasks: tuple[Task, ...]


class _Playing:
    """Tasks on their way: waiting, given to workers, come back."""

    def __init__(self, client: "Client", study: Study, tasks: Sequence[Task]) -> None:
        self._client, self._name, self._sent = client, uuid.uuid4().hex, sent(study)
        self._waiting = deque(Task(task.run, None) for task in tasks)
        self._suspects: deque[Task] = deque()  # given to a worker that died: each is played alone, in the end
        self._deaths: Counter[Task] = Counter()
        self._given: dict[Future[Any], _Given] = {}
        self._ended: SimpleQueue[Future[Any]] = SimpleQueue()
        self._seconds_of_a_task = 0.0  # lately
        self._next_look, self._is_first_look = 0.0, True
        self._living: set[str] = set()
        self._ready: set[str] = set()
        self._refused: dict[str, str] = {}

    def results(self) -> Iterator[list[Played]]:
        """Give what came of the tasks as they end."""
        while self._waiting or self._suspects or any(given.tasks for given in self._given.values()):
            if time.monotonic() > self._next_look:
                yield from self._look()
                self._next_look = time.monotonic() + _SECONDS_BETWEEN_LOOKS
            if self._nobody_fits():
                worker, why = next(iter(self._refused.items()))
                raise WorkerError(f"no worker of the cluster can play this study; {worker}: {why}")
            self._hand_out()
            for future in self._which_ended():
                if future in self._given:
                    yield from self._come_back(future)

    def _look(self) -> Iterator[list[Played]]:
        """See which workers are lost, and which have joined: these are to be prepared."""
        self._see_that_it_runs()
        try:
            threads: dict[str, int] = self._client.nthreads()
        except OSError as error:
            raise WorkerError(_GONE) from error
        if not threads and (self._living or self._is_first_look):
            warn("the cluster has no workers: the study waits until some join", WorkerWarning)
        for worker in (self._living | {given.worker for given in self._given.values()}) - set(threads):
            yield from self._lose(worker)
        joined = {worker: n for worker, n in threads.items() if worker not in self._living}
        for worker in joined:
            self._give(worker, ())
        several = [worker for worker, n in joined.items() if n > 1]
        if several and self._is_first_look:
            warn(
                f"workers such as {several[0]} have several threads, of which a study uses one: start them with "
                "`dask worker --nthreads 1 --nworkers N`",
                WorkerWarning,
            )
        self._living, self._is_first_look = set(threads), False

    def _lose(self, worker: str) -> Iterator[list[Played]]:
        """Take back what a worker was given that is not there any more."""
        self._ready.discard(worker)
        self._refused.pop(worker, None)
        for future in [one for one, given in self._given.items() if given.worker == worker]:
            future.release()
            yield from self._died(self._given.pop(future).tasks)

    def _died(self, tasks: tuple[Task, ...]) -> Iterator[list[Played]]:
        for task in tasks:
            self._deaths[task] += 1
            if self._deaths[task] < _DEATHS:
                self._suspects.append(task)
            else:
                yield [Played(task.run, None, _DIED)]

    def _hand_out(self) -> None:
        n_given = Counter(given.worker for given in self._given.values())
        for worker in self._ready:
            while self._waiting and n_given[worker] < _WAITING:
                n_given[worker] += 1
                self._give(worker, self._piece())
            if self._suspects and n_given[worker] == 0:
                self._give(worker, (self._suspects.popleft(),))

    def _piece(self) -> tuple[Task, ...]:
        """Return tasks that keep a worker busy for long enough, and leave the others their share of what waits."""
        seconds = max(_SECONDS_OF_A_PIECE, _SECONDS_TO_HANDLE * len(self._ready))
        n = min(_MOST_IN_A_PIECE, seconds // self._seconds_of_a_task) if self._seconds_of_a_task else 1
        share = len(self._waiting) // (_WAITING * len(self._ready))
        return tuple(self._waiting.popleft() for _ in range(max(1, min(int(n), share))))

    def _give(self, worker: str, tasks: tuple[Task, ...]) -> None:
        """Give one worker tasks, or else what it needs to show its code and to be ready."""
        work, content = (play, tasks) if tasks else (prepare, self._sent)
        future = self._client.submit(work, self._name, content, workers=[worker], pure=False)
        self._given[future] = _Given(worker, tasks)
        future.add_done_callback(self._ended.put)

    def _which_ended(self) -> "list[Future[Any]]":
        """Return what has ended; where nothing has, wait until it is time to look for workers."""
        ended = []
        try:
            ended.append(self._ended.get(timeout=_SECONDS_BETWEEN_LOOKS))
            while True:
                ended.append(self._ended.get_nowait())
        except Empty:
            return ended

    def _come_back(self, future: "Future[Any]") -> Iterator[list[Played]]:
        """Take what a worker has left: it is ready, or refused, or has played, or says that it knows of nothing."""
        from distributed import KilledWorker

        worker, tasks = self._given.pop(future)
        status = future.status
        if status == "finished":
            yield from self._take(future, worker, tasks)
        elif status != "error":  # cancelled by somebody else, or lost
            self._see_that_it_runs()
            self._put_back(worker, tasks)
        else:
            error = future.exception()
            why = f"{type(error).__name__}: {error}"
            if not tasks:  # it cannot even begin
                self._refuse(worker, why)
            elif isinstance(error, KilledWorker):  # and came back under the same address
                yield from self._died(tasks)
            elif len(tasks) > 1:
                self._suspects += tasks  # each alone, so that only the one to blame fails
            else:
                yield [Played(tasks[0].run, None, f"{why}\n")]
        future.release()

    def _take(self, future: "Future[Any]", worker: str, tasks: tuple[Task, ...]) -> Iterator[list[Played]]:
        """Take what a worker has left: why it is refused, or what it has played; nothing where it is ready."""
        try:
            left = self._fetched(future, worker)
        except (CancelledError, TimeoutError, OSError):  # lost on the way
            self._put_back(worker, tasks)
            return
        if not tasks and left:
            self._refuse(worker, left)
        elif not tasks:
            self._ready.add(worker)
        elif left is None:  # a new process under an old address, that knows of nothing
            self._put_back(worker, tasks)
        else:
            self._seconds_of_a_task += 0.3 * (left.seconds / len(tasks) - self._seconds_of_a_task)
            yield left.played

    def _fetched(self, future: "Future[Any]", worker: str) -> Any:
        """Return what a worker has left; a lost worker has taken it along, for which Dask would wait."""
        seconds = _SECONDS_BETWEEN_LOOKS
        while True:
            try:
                return future.result(timeout=seconds)
            except TimeoutError:
                if seconds > _SECONDS_TO_FETCH or worker not in self._client.nthreads():
                    raise
                seconds *= 2

    def _put_back(self, worker: str, tasks: tuple[Task, ...]) -> None:
        """Let tasks wait again; their worker is looked at as one that joins."""
        self._ready.discard(worker)
        self._living.discard(worker)
        self._waiting.extendleft(reversed(tasks))

    def _refuse(self, worker: str, why: str) -> None:
        is_new = why not in self._refused.values()
        self._refused[worker] = why
        if is_new and not self._nobody_fits():
            warn(f"the cluster's worker {worker} is given no runs: {why}", WorkerWarning)

    def _nobody_fits(self) -> bool:
        return bool(self._living) and self._living <= set(self._refused)

    def _see_that_it_runs(self) -> None:
        if self._client.status != "running":
            raise WorkerError(_GONE)


_GONE = (
    "the cluster's scheduler has gone away: what is finished is kept; start it again, and the same command goes on "
    "from there"
)
_DIED = (
    f"The workers that were given this run died, {_DEATHS} times: they were killed, or left no memory. Give them more "
    "memory, or it a smaller problem.\n"
)
