"""Logs of learning as text: a row for each window of episodes.

A log is no diary: it tells the whole history of the learner that it follows, and is written anew, whole or not at all,
after every window. So a reader never sees half a row, and a run that goes on from a checkpoint has every row once,
whatever an earlier program wrote after that checkpoint.
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterator
from os import PathLike
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tuckerl.checks import check_path
from tuckerl.files import write_whole
from tuckerl.training.callbacks.base import Callback
from tuckerl.types import FloatArray

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class WindowRow(NamedTuple):
    """What is told of a window of `every` episodes."""

    episode: int
    steps: int
    mean_return: float
    mean_steps: float
    alpha: float
    epsilon: float
    weights: tuple[float, ...]


def window_rows(learner: "Learner", every: int, after: int) -> Iterator[WindowRow]:
    """Give a row for each window that ends after the episode `after`, a multiple of `every`.

    Of a window whose tensor step is still to come there is none yet.
    """
    history, alpha, epsilon = learner.history, learner.scheduled("alpha"), _epsilon_of(learner)
    steps = int(history.steps[0, :after].sum())
    last = learner.episodes if learner.in_sync else learner.episodes - 1
    for end in range(after + every, last + 1, every):
        window = slice(end - every, end)
        steps += int(history.steps[0, window].sum())
        yield WindowRow(
            episode=end,
            steps=steps,
            mean_return=float(history.returns[:, window].mean()),
            mean_steps=float(history.steps[:, window].mean()),
            alpha=float(alpha[end - 1]),
            epsilon=float(epsilon[end - 1]),
            weights=tuple(_weights_after(learner, end)),
        )


def _epsilon_of(learner: "Learner") -> FloatArray:
    """Return the probability of a random action by episode; NaN where the policy has none."""
    return learner.scheduled("epsilon") if "epsilon" in learner.scheduled_names else np.full(learner.episodes, np.nan)


def _weights_after(learner: "Learner", episode: int) -> list[float]:
    weights = learner.action_weights
    if episode < learner.episodes:
        history = learner.tensor_step_history
        n_windows = int(np.searchsorted(history.episode, episode, side="right"))
        weights = history.weights[n_windows - 1] if n_windows else np.ones_like(weights)
    return [float(weight) for weight in weights]


class _Log(Callback, ABC):
    """A file of rows."""

    _head = ""

    def __init__(self, path: str | PathLike[str], *, every: int | None = None) -> None:
        super().__init__(every)
        self.path = check_path("path", path)
        self._lines: list[str] = []
        self._told = 0  # episodes of which there are rows

    def on_start(self, learner: "Learner") -> None:
        """Write the rows of what the learner did before."""
        self._lines, self._told = [self._head] if self._head else [], 0
        self.on_window(learner)

    def on_window(self, learner: "Learner") -> None:
        """Write the file with the new rows."""
        rows = list(window_rows(learner, self.every or learner.window, self._told))
        self._lines += map(self._line, rows)
        self._told = rows[-1].episode if rows else self._told
        write_whole(self.path, "".join(f"{line}\n" for line in self._lines).encode())

    @abstractmethod
    def _line(self, row: WindowRow) -> str:
        """Return a row as text."""


class CsvLog(_Log):
    """Write a row of comma-separated values for each window of episodes.

    The file always holds the whole history of the learner, also what it learned before the log began to follow it, and
    is written whole or not at all: see :mod:`tuckerl.training.callbacks.logs`. Numbers are written so that reading them
    gives the same bits. Its columns are:

    ===========  ==========================================================================
    episode      episodes that every agent has finished: a multiple of `every`
    steps        steps of the first agent in all of them
    mean_return  undiscounted return of the window's episodes, the mean over them and all agents
    mean_steps   their number of steps, likewise
    alpha        learning rate of the window's last episode, before the action weights
    epsilon      probability of a random action in it
    ===========  ==========================================================================

    Parameters
    ----------
    path : path-like
        The file; one that is there is replaced.
    every : int, optional
        Episodes in a window; see :class:`Callback`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `every` is not a whole number of at least 1.
    OutputError
        From `learn`: if the file cannot be written.
    """

    _head = ",".join(WindowRow._fields[:-1])

    def _line(self, row: WindowRow) -> str:
        return ",".join(map(repr, row[:-1]))


class JsonLinesLog(_Log):
    """Write a line of JSON for each window of episodes: an object with the columns of :class:`CsvLog`, and weights.

    ``weights`` is the list of the action weights after the window, all 1 without a tensor step. All else is as in
    :class:`CsvLog`.

    Parameters
    ----------
    path : path-like
        The file; one that is there is replaced.
    every : int, optional
        Episodes in a window; see :class:`Callback`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `every` is not a whole number of at least 1.
    OutputError
        From `learn`: if the file cannot be written.
    """

    def _line(self, row: WindowRow) -> str:
        return json.dumps(row._asdict())
