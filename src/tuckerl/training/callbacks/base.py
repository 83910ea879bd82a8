"""What is called while a learner learns: at the end of every window of episodes, when it could be saved.

A callback is an object with three methods, of which a subclass writes those it needs, or just a function that takes the
learner. To stop learning, `on_window` or the function returns False.
"""

import sys
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from tuckerl.checks import check_flag, check_function, check_int, shown
from tuckerl.errors import ParameterTypeError
from tuckerl.progress import progress_bar

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class Callback:
    """Something that is called while a learner learns.

    Its methods may look at everything, and assign parameters, which are in force from the next episode. An error in
    one of them ends learning as Ctrl-C does: all callbacks hear of the end, and the learner can go on.

    Parameters
    ----------
    every : int, optional
        Call `on_window` when the number of episodes is a multiple of it. Default: the learner's own windows, those of
        its tensor step or else a hundred episodes.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `every` is not a whole number of at least 1.
    """

    every: int | None = None  # also of a subclass whose own __init__ does not ask ours

    def __init__(self, every: int | None = None) -> None:
        self.every = None if every is None else check_int("every", every, 1)

    def on_start(self, learner: "Learner") -> None:
        """Prepare for a call of `learn`."""

    def on_window(self, learner: "Learner") -> bool | None:
        """Look at the learner after a window; False ends learning."""
        return None

    def on_end(self, learner: "Learner") -> None:
        """Finish, whether the end was reached or an error or Ctrl-C came before."""


CallbackLike = Callback | Callable[["Learner"], object]
"""What `learn` takes as callbacks."""


class _Function(Callback):
    """A function of the user's own, called after every window."""

    def __init__(self, function: Callable[["Learner"], object]) -> None:
        super().__init__()
        self._function = function

    def on_window(self, learner: "Learner") -> bool | None:
        answer = self._function(learner)
        return bool(answer) if isinstance(answer, (bool, np.bool_)) else None


def _as_callbacks(callbacks: Sequence[CallbackLike]) -> tuple[Callback, ...]:
    expected = "callbacks must be a sequence of tuckerl.Callback objects, or functions that take the learner"
    try:
        each = iter(callbacks)
    except TypeError as error:
        raise ParameterTypeError(f"{expected}; got {shown(callbacks)}: put it into a list") from error
    listed: list[Callback] = []
    for callback in each:  # a view of an array may have more entries than any memory
        if isinstance(callback, type) or not (isinstance(callback, Callback) or callable(callback)):
            raise ParameterTypeError(f"{expected}; got {shown(callback)} among them")
        if not isinstance(callback, Callback):
            check_function("a callback", callback, "learner")
        listed.append(callback if isinstance(callback, Callback) else _Function(callback))
    return tuple(listed)


class Goal(NamedTuple):
    """Where a call of `learn` ends."""

    episodes: int  # of all agents, counted from the first call on
    steps: int  # of the first agent, likewise


_MOST = sys.maxsize


class CallbackList:
    """All callbacks of one call of `learn`, and its progress bar."""

    def __init__(self, learner: "Learner", callbacks: Sequence[CallbackLike], goal: Goal, *, progress: bool) -> None:
        self.go_on = True
        self._learner, self._callbacks, self._goal = learner, _as_callbacks(callbacks), goal
        self._started: list[Callback] = []
        shows = check_flag("progress", progress)
        # An earlier call may have ended before the tensor step of this very episode: its window is still to come.
        self._last = learner.episodes if learner.is_saveable and learner.in_sync else None
        self._bar: Any = progress_bar("episodes" if goal.episodes < _MOST else "steps") if shows else None
        self._show: Any = None

    @property
    def is_empty(self) -> bool:
        """Whether nobody looks at the learner while it learns."""
        return not self._callbacks and self._bar is None

    def next_stop(self) -> int:
        """Return the episode before which no callback waits to be called."""
        episodes = self._learner.episodes
        return min((episodes + own - episodes % own for own in map(self._every, self._callbacks)), default=_MOST)

    def call(self) -> None:
        """Call those that are due, if all agents have finished the window whole."""
        learner, episodes = self._learner, self._learner.episodes
        self._show_progress()
        if not (learner.is_saveable and learner.in_sync) or episodes == self._last:
            return
        self._last = episodes
        for callback in self._callbacks:
            if episodes % self._every(callback) == 0:
                answer = callback.on_window(learner)
                if isinstance(answer, (bool, np.bool_)) and not answer:  # comparing arrays gives NumPy's False
                    self.go_on = False

    def _every(self, callback: Callback) -> int:
        return callback.every or self._learner.window

    def _show_progress(self) -> None:
        if self._show is not None:
            by_episodes = self._goal.episodes < _MOST
            done = self._learner.episodes if by_episodes else self._learner.first_agent_steps
            self._show(done, self._goal.episodes if by_episodes else self._goal.steps)

    def __enter__(self) -> Self:
        if self._bar is not None:
            self._show = self._bar.__enter__()
            self._show_progress()
        try:
            for callback in self._callbacks:
                callback.on_start(self._learner)
                self._started.append(callback)
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            self._end(self._started)
        finally:
            if self._bar is not None:
                self._bar.__exit__(kind, error, traceback)

    def _end(self, callbacks: Sequence[Callback]) -> None:
        """End all of them, whatever they raise; Python then shows every error."""
        if callbacks:
            try:
                callbacks[0].on_end(self._learner)
            finally:
                self._end(callbacks[1:])
