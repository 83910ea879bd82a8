"""End learning when it goes well enough."""

from typing import TYPE_CHECKING

from tuckerl.checks import check_int, check_real
from tuckerl.training.callbacks.base import Callback

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
        latest = learner.history.returns[:, -self.episodes :]
        return not (latest.shape[1] == self.episodes and latest.mean() >= self.threshold)
