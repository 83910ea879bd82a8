"""Steps and returns of all episodes of all tables."""

import numpy as np

from tuckerl.types import FloatArray, IntArray


class EpisodeHistory:
    """What N tables did in their episodes. One may be ahead of the others where an error or an interrupt came between.

    Attributes
    ----------
    done : (N,) int64
        Episodes that each has finished.
    """

    def __init__(self, n_tables: int) -> None:
        self._steps: IntArray = np.zeros((n_tables, 0), dtype=np.int64)
        self._returns: FloatArray = np.zeros((n_tables, 0))
        self.done: IntArray = np.zeros(n_tables, dtype=np.int64)
        self.first_steps = 0
        """Steps of all episodes that the first table has finished."""

    @property
    def episodes(self) -> int:
        """Episodes that all tables have finished."""
        return int(self.done.min())

    @property
    def furthest(self) -> int:
        """Episodes that some table has finished."""
        return int(self.done.max())

    @property
    def latest_steps(self) -> IntArray:
        """Steps of each table's latest episode, -1 where there is none, (N,)."""
        pairs = zip(self._steps, self.done, strict=True)
        return np.array([steps[done - 1] if done else -1 for steps, done in pairs], dtype=np.int64)

    @property
    def is_even(self) -> bool:
        """Whether no table is ahead of another."""
        return self.episodes == self.furthest

    def add(self, tables: list[int], n_episodes: int) -> None:
        """Count `n_episodes` more that these tables have finished."""
        if tables[0] == 0:
            first = int(self.done[0])
            self.first_steps += int(self._steps[0, first : first + n_episodes].sum())
        self.done[tables] += n_episodes

    @property
    def steps(self) -> IntArray:
        """Steps of the episodes that all have finished, (N, episodes); not to be changed."""
        return self._steps[:, : self.episodes]

    @property
    def returns(self) -> FloatArray:
        """Their undiscounted returns, (N, episodes); not to be changed."""
        return self._returns[:, : self.episodes]

    def room(self, table: int, until: int) -> tuple[IntArray, FloatArray]:
        """Return where a table's steps and returns are to be written, up to its episode `until`."""
        if until > self._steps.shape[1]:
            more = ((0, 0), (0, max(until, 2 * self._steps.shape[1]) - self._steps.shape[1]))
            self._steps, self._returns = np.pad(self._steps, more), np.pad(self._returns, more)
        chunk = slice(int(self.done[table]), until)
        return self._steps[table, chunk], self._returns[table, chunk]

    def drop_last(self) -> None:
        """Forget the latest episode of all: its tables have left the finite numbers."""
        self.first_steps -= int(self._steps[0, self.done[0] - 1])
        self.done -= 1

    def saved(self) -> dict[str, np.ndarray]:
        """Return the arrays from which `restore` goes on."""
        furthest = self.furthest
        return {"steps": self._steps[:, :furthest], "returns": self._returns[:, :furthest], "done": self.done}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `saved` returned."""
        self._steps, self._returns = arrays["steps"], arrays["returns"]
        n_tables, furthest = self._steps.shape
        self.done = arrays.get("done", np.full(n_tables, furthest, dtype=np.int64))  # format 1: all equal
        self.first_steps = int(self._steps[0, : self.done[0]].sum())
