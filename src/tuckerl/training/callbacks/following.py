"""Callbacks that stop, keep and evaluate what is learned."""

import math
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tuckerl.checks import check_int, check_real
from tuckerl.errors import OutputError, SavedFileError
from tuckerl.rng import seed_sequence
from tuckerl.training import learner_file as saved
from tuckerl.training.callbacks.base import Callback
from tuckerl.training.persistence import restored_seed
from tuckerl.types import Seed

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class StopOnReturn(Callback):
    """End learning when the latest episodes went well enough.

    They are those of learning, exploration included; :class:`Evaluate` tells how the greedy policy does.

    Parameters
    ----------
    threshold : float
        Stop when the mean undiscounted return of the latest `episodes` episodes, over all agents, is at least this.
    episodes : int
        Before so many have been played, learning goes on.
    every : int, optional
        Look after every so many episodes; see :class:`Callback`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a parameter is not a finite number, or not a whole number of at least 1.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning("tuckerl/DynaMaze-v0", seed=0)
    >>> agent.learn(episodes=500, callbacks=[tuckerl.StopOnReturn(-1800.0, episodes=20, every=10)]).episodes
    20
    """

    def __init__(self, threshold: float, *, episodes: int = 100, every: int | None = None) -> None:
        super().__init__(every)
        self.threshold = check_real("threshold", threshold)
        self.episodes = check_int("episodes", episodes, 1)

    def on_window(self, learner: "Learner") -> bool | None:
        """Compare the latest returns with the threshold."""
        latest = learner._accounts.returns[:, -self.episodes :]
        return not (latest.shape[1] == self.episodes and latest.mean() >= self.threshold)


class Checkpoint(Callback):
    """Save the learner again and again, so that little is lost when the program or the machine stops.

    It is saved after windows and at the end, after Ctrl-C or an error, too. A file is written whole or not at all, and
    going on from it (``type(agent).load(path)``, then `learn`) equals never having stopped, to the last bit. What could
    not promise that is not saved: a learner whose tables left the finite numbers, or whose latest episode an error in
    the environment broke off.

    Parameters
    ----------
    path : path-like
        Where to. ``{episode}`` in it stands for the number of episodes played, and every file is kept; without it, the
        newest takes the place of the one before.
    every : int, optional
        Save after every so many episodes; see :class:`Callback`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `every` is not a whole number of at least 1.
    OutputError
        From `learn`: if the folder does not exist or cannot be written.
    """

    def __init__(self, path: str | PathLike[str], *, every: int | None = None) -> None:
        super().__init__(every)
        self.path = Path(path)
        self._saved_at: int | None = None

    def on_start(self, learner: "Learner") -> None:
        """Find out early whether there is a folder."""
        self._saved_at = None
        _check_folder(self.path)

    def on_window(self, learner: "Learner") -> None:
        """Save the learner."""
        learner.save(str(self.path).replace("{episode}", str(learner.episodes)))
        self._saved_at = learner.episodes

    def on_end(self, learner: "Learner") -> None:
        """Save it for the last time, if it has gone on."""
        if learner.is_intact and learner.episodes != self._saved_at:
            self.on_window(learner)


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
        self.best = None if best is None else Path(best)
        self.history: list[Evaluated] = []
        self._best_mean = -math.inf

    def on_start(self, learner: "Learner") -> None:
        """Find out what there is to be surpassed."""
        if self.best is not None:
            _check_folder(self.best)
            if not self.history:
                self._best_mean = self._mean_of_best(learner, self.best)

    def _mean_of_best(self, learner: "Learner", path: Path) -> float:
        """Return the mean of a learner that an earlier part of the same run has saved; -inf where there is none."""
        if not path.is_file():
            return -math.inf
        try:
            header, arrays = saved.read(path)
        except SavedFileError:  # another file, which the first learner that is saved replaces
            return -math.inf
        seed, own = restored_seed(header["seed"]), learner._sequence
        same = header["learner"] == type(learner).__name__ and arrays["q"].shape == learner._q.shape
        same &= bool((seed.generate_state(4) == own.generate_state(4)).all())
        if not same or arrays["steps"].shape[1] > learner.episodes:
            return -math.inf
        return learner._evaluate(arrays["q"], self.episodes, self.seed).mean

    def on_window(self, learner: "Learner") -> None:
        """Evaluate, and save what is better than all before."""
        result = learner.evaluate(self.episodes, seed=self.seed)
        self.history.append(Evaluated(learner.episodes, result.mean, result.low, result.high))
        if self.best is not None and result.mean > self._best_mean:
            self._best_mean = result.mean
            learner.save(self.best)


def _check_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: there is no folder {path.parent}; make it first")
