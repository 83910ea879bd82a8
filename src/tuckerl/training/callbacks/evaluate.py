"""Evaluate a learner while it learns, and keep the best one."""

import math
from os import PathLike
from typing import TYPE_CHECKING, NamedTuple

from tuckerl.checks import check_int, check_path
from tuckerl.files import check_folder_of
from tuckerl.rng import seed_sequence
from tuckerl.training.callbacks.base import Callback
from tuckerl.types import Seed

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class Evaluated(NamedTuple):
    """What one evaluation has shown."""

    episode: int  # episodes learned before it
    mean: float  # return of the greedy episodes
    low: float  # of the 95 % interval of the mean
    high: float


class Evaluate(Callback):
    """Evaluate the greedy policy after windows, and keep the best learner. Learning goes on as if it had not been.

    Parameters
    ----------
    episodes : int
        Greedy episodes in each evaluation; see :meth:`tuckerl.training.learner.Learner.evaluate`.
    every : int, optional
        Evaluate after every so many episodes; see :class:`Callback`.
    seed : int or SeedSequence, optional
        Of the evaluations, which all use the same. Default: the learner's own stream for them.
    best : path-like, optional
        Save the learner here whenever the mean is above all before. In a run that goes on from a checkpoint, the one
        that was saved here before still counts: its tables are evaluated again.

    Attributes
    ----------
    history : list of Evaluated
        All that this object has made, of (episode, mean, low, high).

    Raises
    ------
    ParameterError, ParameterTypeError
        If `episodes` or `every` is not a whole number of at least 1, or `seed` is no seed.
    OutputError
        From `learn`: if the folder of `best` does not exist or cannot be written.
    """

    def __init__(
        self,
        episodes: int = 100,
        *,
        every: int | None = None,
        seed: Seed = None,
        best: str | PathLike[str] | None = None,
    ) -> None:
        super().__init__(every)
        self.episodes = check_int("episodes", episodes, 1)
        self.seed = None if seed is None else seed_sequence(seed)
        self.best = None if best is None else check_path("best", best)
        self.history: list[Evaluated] = []
        self._best_mean = -math.inf

    def on_start(self, learner: "Learner") -> None:
        """Find out what there is to be surpassed."""
        if self.best is not None:
            check_folder_of(self.best)
            if not self.history:
                earlier = learner.evaluate_saved(self.best, self.episodes, seed=self.seed)
                self._best_mean = -math.inf if earlier is None else earlier.mean

    def on_window(self, learner: "Learner") -> None:
        """Evaluate, and save what is better than all before."""
        result = learner.evaluate(self.episodes, seed=self.seed)
        self.history.append(Evaluated(learner.episodes, result.mean, result.low, result.high))
        if self.best is not None and result.mean > self._best_mean:
            self._best_mean = result.mean
            learner.save(self.best)
