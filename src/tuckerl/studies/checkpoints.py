"""A run that takes minutes keeps what it has learned, and goes on from there if it is broken off, to the same bits."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tuckerl.adapters.resolve import Environment
from tuckerl.errors import TuckerlError
from tuckerl.files import write_whole
from tuckerl.training.learner import Learner

SECONDS_BETWEEN = 30.0
_SECONDS_OF_A_PIECE = 2.0  # of learning, after which the clock is looked at


class Spent(NamedTuple):
    """Processor time before a learner was read from its checkpoint."""

    seconds: float
    tensor_step_seconds: float


def learned(
    make: Callable[[], Learner], environment: Environment, n_episodes: int, checkpoint: Path | None
) -> tuple[Learner, Spent]:
    """Return a learner that has learned `n_episodes`, and what of it was spent before.

    Parameters
    ----------
    make : callable
        Returns the learner that has learned nothing.
    environment
        On which it learns.
    n_episodes : int
    checkpoint : Path, optional
        Where the learner is kept every half minute, with the time that it has spent. A learner that no file can hold
        begins anew.
    """
    begun, saved = time.process_time(), time.monotonic()
    learner, spent = _from_checkpoint(checkpoint, environment) or (make(), Spent(0.0, 0.0))
    episodes = 1
    while learner.episodes < n_episodes and learner.diverged_at is None:
        before = time.monotonic()
        learner.learn(episodes=min(episodes, n_episodes - learner.episodes))
        now = time.monotonic()
        # Pieces grow to about two seconds, so that few calls are made: 50 and 50 episodes are 100, to the last bit.
        episodes = max(1, min(64 * episodes, int(episodes * _SECONDS_OF_A_PIECE / max(now - before, 1e-9))))
        if checkpoint is not None and now - saved > SECONDS_BETWEEN and learner.episodes < n_episodes:
            seconds = time.process_time() - begun + spent.seconds
            checkpoint = _keep(learner, checkpoint, seconds, spent.tensor_step_seconds + learner.tensor_step_seconds)
            saved = time.monotonic()
    return learner, spent


def _keep(learner: Learner, checkpoint: Path, *spent: float) -> Path | None:
    """Write a learner and the time that it has spent; return None if no file can hold it."""
    try:
        write_whole(_times(checkpoint), json.dumps([learner.episodes, *spent]).encode())
        learner.save(checkpoint)
    except TuckerlError:  # an environment or policy of a user's own, or a full disk: the run goes on without
        return None
    return checkpoint


def _from_checkpoint(checkpoint: Path | None, environment: Environment) -> tuple[Learner, Spent] | None:
    """Return the learner that is kept; None where there is none that can be read."""
    import tuckerl

    if checkpoint is None or not checkpoint.exists():
        return None
    try:
        learner = tuckerl.load(checkpoint, env=environment)
        episodes, *numbers = json.loads(_times(checkpoint).read_bytes())
        spent = Spent(*map(float, numbers))
    except (TuckerlError, OSError, ValueError, TypeError):
        return None
    return learner, spent if episodes == learner.episodes else Spent(0.0, 0.0)


def _times(checkpoint: Path) -> Path:
    return checkpoint.with_suffix(".json")


def forget(checkpoint: Path) -> None:
    """Delete what is kept of a run."""
    for path in (checkpoint, _times(checkpoint)):
        path.unlink(missing_ok=True)
