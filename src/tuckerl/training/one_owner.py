"""One learner is one thread's at a time, and at rest where it is saved, evaluated or changed."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from tuckerl.errors import LearnerInUseError

LEARN = "learn()"
_ELSEWHERE = (
    "{what} was called in thread {here!r} while {use} of the same learner was running in thread {there!r}: a learner "
    "is one thread's at a time; wait until that has returned, or give each thread a learner of its own "
    "(copy.deepcopy makes one)"
)
_INSIDE = "{what} was called from inside of {use} of the same learner: call it when that has returned"
_IN_EPISODE = (
    "{what} was called in the middle of an episode of the same learner: call it in a callback, or after learn()"
)


class Owner:
    """Who uses a learner, and what for."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._uses: list[str] = []  # of the thread that has the lock, the latest last
        self._thread, self._name = 0, ""
        self._is_playing = False

    @contextmanager
    def learning(self, what: str = LEARN) -> Iterator[None]:
        """Use the learner alone, for what changes what it has learned.

        Raises
        ------
        LearnerInUseError
            If it is in use, by whomever.
        """
        with self._locked(what):
            if self._uses:
                raise LearnerInUseError(_INSIDE.format(what=what, use=self._uses[-1]))
            yield from self._use(what)

    @contextmanager
    def at_rest(self, what: str) -> Iterator[None]:
        """Use the learner between two episodes; callbacks may, while it learns.

        Raises
        ------
        LearnerInUseError
            If another thread uses it, or it is in the middle of an episode or of another use.
        """
        with self._locked(what):
            if self._is_playing:
                raise LearnerInUseError(_IN_EPISODE.format(what=what))
            if self._uses not in ([], [LEARN]):
                raise LearnerInUseError(_INSIDE.format(what=what, use=self._uses[-1]))
            yield from self._use(what)

    @contextmanager
    def playing(self) -> Iterator[None]:
        """Play episodes, in the midst of which nothing else can be done."""
        self._is_playing = True
        try:
            yield
        finally:
            self._is_playing = False

    def check_thread(self, what: str) -> None:
        """Refuse to look at, or to set, what another thread may be changing.

        Raises
        ------
        LearnerInUseError
            If another thread uses the learner.
        """
        uses = tuple(self._uses)
        if uses and self._thread != threading.get_ident():
            raise self._refusal(what, uses)

    @contextmanager
    def _locked(self, what: str) -> Iterator[None]:
        if not self._lock.acquire(blocking=False):
            raise self._refusal(what, tuple(self._uses))
        try:
            yield
        finally:
            self._lock.release()

    def _use(self, what: str) -> Iterator[None]:
        self._thread, self._name = threading.get_ident(), threading.current_thread().name  # before others see a use
        self._uses.append(what)
        try:
            yield
        finally:
            self._uses.pop()

    def _refusal(self, what: str, uses: tuple[str, ...]) -> LearnerInUseError:
        here, use = threading.current_thread().name, uses[0] if uses else "another use"
        return LearnerInUseError(_ELSEWHERE.format(what=what, here=here, use=use, there=self._name))
