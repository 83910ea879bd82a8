"""Steps and returns of the episodes of a learner's agents."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tuckerl.errors import SavedFileError
from tuckerl.saved_arrays import SavedArrays
from tuckerl.types import FloatArray, IntArray

_Number = TypeVar("_Number", np.int64, np.float64)

_MOST_STEPS = 2**40  # more than any episode has, whatever its limit was, and few enough for sums of them


_LEAST_ROOM = 256  # episodes: a run of short windows does not grow again and again


class EpisodeHistory:
    """What N agents did in their episodes. One may be ahead of the others where an error or an interrupt came between.

    Parameters
    ----------
    n_agents : int
    shares_world : bool
        Whether all agents are in one world, whose steps are those of the agent that stays longest.

    Attributes
    ----------
    finished : (N,) int64
        Episodes that each agent has finished.
    first_agent_steps : int
        Steps of all episodes that the first agent has finished; of agents in one world, the world's.
    """

    def __init__(self, n_agents: int, *, shares_world: bool = False) -> None:
        self._shares_world = shares_world
        self._clocks = slice(n_agents) if shares_world else slice(1)  # of whose steps the largest number counts
        self._steps: IntArray = np.zeros((n_agents, 0), dtype=np.int64)
        self._returns: FloatArray = np.zeros((n_agents, 0))
        self.finished: IntArray = np.zeros(n_agents, dtype=np.int64)
        self._episodes = self._most_episodes = self.first_agent_steps = 0  # counted once, as a short window asks often

    @property
    def episodes(self) -> int:
        """Episodes that all agents have finished."""
        return self._episodes

    @property
    def most_episodes(self) -> int:
        """Episodes that some agent has finished."""
        return self._most_episodes

    @property
    def capacity(self) -> int:
        """Episodes that there is room for already."""
        return self._steps.shape[1]

    @property
    def in_sync(self) -> bool:
        """Whether no agent is ahead of another."""
        return self.episodes == self.most_episodes

    @property
    def latest_steps(self) -> IntArray:
        """Steps of each agent's latest episode, -1 where there is none, (N,)."""
        pairs = zip(self._steps, self.finished, strict=True)
        return np.array([steps[n - 1] if n else -1 for steps, n in pairs], dtype=np.int64)

    @property
    def steps(self) -> IntArray:
        """Steps of the episodes that all have finished, (N, episodes); not to be changed."""
        return self._steps[:, : self.episodes]

    @property
    def returns(self) -> FloatArray:
        """Their undiscounted returns, (N, episodes); not to be changed."""
        return self._returns[:, : self.episodes]

    def room(self, agent: int, until: int) -> tuple[IntArray, FloatArray]:
        """Return where an agent's steps and returns are to be written, up to its episode `until`."""
        if until > self._steps.shape[1]:
            n = max(until, 2 * self._steps.shape[1], _LEAST_ROOM)
            self._steps, self._returns = _widened(self._steps, n), _widened(self._returns, n)
        chunk = slice(int(self.finished[agent]), until)
        return self._steps[agent, chunk], self._returns[agent, chunk]

    def steps_of(self, agents: Sequence[int], first: int) -> IntArray:
        """Return the steps of these agents' finished episodes from the `first` on."""
        return self._steps[agents, first : int(self.finished[agents[0]])]

    def add(self, agents: Sequence[int], n_episodes: int) -> None:
        """Count `n_episodes` more that these agents have finished."""
        if agents[0] == 0:
            first = int(self.finished[0])
            self.first_agent_steps += self._count(slice(first, first + n_episodes))
        self.finished[agents] += n_episodes
        self._count_episodes()

    def drop_last(self) -> None:
        """Forget the latest episode of all agents."""
        last = int(self.finished[0]) - 1
        self.first_agent_steps -= self._count(slice(last, last + 1))
        self.finished -= 1
        self._count_episodes()

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays from which `set_arrays` goes on."""
        n = self.most_episodes
        return {"steps": self._steps[:, :n], "returns": self._returns[:, :n], "finished": self.finished}

    def read(self, arrays: SavedArrays, n_agents: int, *, diverged: bool) -> dict[str, np.ndarray]:
        """Return the arrays that `to_arrays` returned, from a file.

        Parameters
        ----------
        arrays : SavedArrays
        n_agents : int
        diverged : bool
            Whether returns may be NaN.

        Raises
        ------
        SavedFileError
            If they are none of so many agents'.
        """
        n_episodes = arrays.shape("steps")[-1:]
        steps = arrays.take("steps", np.int64, (n_agents, *n_episodes), 0, _MOST_STEPS)
        returns = arrays.take("returns", np.float64, (n_agents, *n_episodes))
        finished = arrays.take("finished", np.int64, (n_agents,), 0)
        if finished.max() != n_episodes[0]:
            raise SavedFileError(
                f"it has {n_episodes[0]} episodes, and the first to have finished most has another number"
            )
        if self._shares_world and finished.min() != finished.max():  # nobody there can catch up alone
            raise SavedFileError("agents that share a world must have finished equally many episodes")
        if np.isnan(returns).any() and not diverged:  # sums of finite rewards may be infinite
            raise SavedFileError("the returns of episodes must be numbers")
        return {"steps": steps, "returns": returns, "finished": finished}

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `to_arrays` or `read` returned."""
        self._steps, self._returns, self.finished = arrays["steps"], arrays["returns"], arrays["finished"]
        self.first_agent_steps = self._count(slice(int(self.finished[0])))
        self._count_episodes()

    def _count_episodes(self) -> None:
        finished = self.finished.tolist()
        self._episodes, self._most_episodes = min(finished), max(finished)

    def _count(self, episodes: slice) -> int:
        """Return the steps of the first agent, or of the world that all share, in some episodes."""
        steps = self._steps[self._clocks, episodes]
        return int(np.add.reduce(steps[0] if len(steps) == 1 else steps.max(axis=0)))


def _widened(rows: NDArray[_Number], n_columns: int) -> NDArray[_Number]:
    """Return rows with zeros behind them."""
    wide = np.zeros((len(rows), n_columns), rows.dtype)
    wide[:, : rows.shape[1]] = rows
    return wide
