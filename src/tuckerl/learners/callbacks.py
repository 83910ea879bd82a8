"""What is called while a learner learns: at the end of every window of episodes, when it is at rest and can be saved.

A callback is an object with three methods, of which a subclass writes those it needs. To stop learning, `on_window`
returns False.
"""

import sys
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from tuckerl.checks import check_int
from tuckerl.errors import ParameterTypeError
from tuckerl.progress import progress_bar

if TYPE_CHECKING:
    from tuckerl.learners.learner import Learner


class Callback:
    """Something that follows a learner.

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

    def __init__(self, every: int | None = None) -> None:
        self.every = None if every is None else check_int("every", every, 1)

    def on_start(self, learner: "Learner") -> None:
        """Follow a call of `learn` from its beginning."""

    def on_window(self, learner: "Learner") -> bool | None:
        """Look at the learner after a window; False ends learning."""
        return None

    def on_end(self, learner: "Learner") -> None:
        """Follow to the end, whether it is reached, an error or Ctrl-C."""


class Goal(NamedTuple):
    """Where a call of `learn` ends."""

    episodes: int  # of all agents, counted from the first call on
    steps: int  # of the first agent, likewise


_MOST = sys.maxsize


class Followers:
    """All callbacks of one call of `learn`, and its progress bar."""

    def __init__(self, learner: "Learner", callbacks: Sequence[Callback], goal: Goal, *, progress: bool) -> None:
        for callback in callbacks:
            if not isinstance(callback, Callback):
                raise ParameterTypeError(f"callbacks must be tuckerl.Callback objects; got {callback!r}")
        self.go_on = True
        self._learner, self._callbacks, self._goal = learner, tuple(callbacks), goal
        self._last = learner.episodes
        self._bar: Any = progress_bar("episodes" if goal.episodes < _MOST else "steps") if progress else None
        self._show: Any = None

    def next_stop(self) -> int:
        """Return the episode before which no callback waits to be called."""
        episodes = self._learner.episodes
        return min((episodes + own - episodes % own for own in map(self._every, self._callbacks)), default=_MOST)

    def follow(self, *, at_rest: bool) -> None:
        """Call who is due, if the learner is at rest: all agents are at one episode and no tensor step is due."""
        episodes = self._learner.episodes
        self._show_progress()
        if not at_rest or episodes == self._last:
            return
        self._last = episodes
        for callback in self._callbacks:
            if episodes % self._every(callback) == 0 and callback.on_window(self._learner) is False:
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
        for callback in self._callbacks:
            callback.on_start(self._learner)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            for callback in self._callbacks:
                callback.on_end(self._learner)
        finally:
            if self._bar is not None:
                self._bar.__exit__(kind, error, traceback)
