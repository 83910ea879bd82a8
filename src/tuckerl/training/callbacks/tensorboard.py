"""A log for TensorBoard, which needs the extra ``tuckerl[tensorboard]``."""

import os
import time
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tuckerl.errors import MissingExtraError, OutputError
from tuckerl.training.callbacks.base import Callback
from tuckerl.training.callbacks.logs import window_rows

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class TensorBoard(Callback):
    """Write curves for TensorBoard, with a point for each window of episodes.

    They are ``return`` and ``steps`` (means over the window's episodes and all agents), ``alpha`` and ``epsilon`` (of
    its last episode) and, with a tensor step, ``weights/0``, ``weights/1``, ... (of the actions, after it), over the
    number of episodes. In a run that goes on from a checkpoint, TensorBoard hides the points that an earlier program
    wrote after that checkpoint.

    Parameters
    ----------
    folder : path-like
        Made if it is not there. A run has one of its own.
    every : int, optional
        Episodes in a window; see :class:`Callback`.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `every` is not a whole number of at least 1.
    MissingExtraError
        If the extra is not installed: ``pip install "tuckerl[tensorboard]"``.
    OutputError
        From `learn`: if the folder cannot be written.
    """

    def __init__(self, folder: str | PathLike[str], *, every: int | None = None) -> None:
        super().__init__(every)
        self.folder = Path(folder)
        self._library = _library()
        self._writer: Any = None

    def on_start(self, learner: "Learner") -> None:
        """Begin a file of events."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            # The library names files by the second: two calls of `learn` within one would write the same file.
            suffix = f".{learner.episodes:012}.{os.getpid()}"
            self._writer = self._library.EventsWriter(str(self.folder / "events"), suffix)
        except OSError as error:
            reason = error.strerror or str(error)
            raise OutputError(f"cannot write into {self.folder}: {reason}; choose another folder") from error
        self._write(learner.episodes + 1, session_log={"status": 1})  # a start: points from here on are not shown

    def on_window(self, learner: "Learner") -> None:
        """Write the points of the latest window."""
        every = self.every or learner.window
        (row,) = window_rows(learner, every, learner.episodes - every)
        points = {"return": row.mean_return, "steps": row.mean_steps, "alpha": row.alpha, "epsilon": row.epsilon}
        if learner.tensor_step is not None:
            points |= {f"weights/{action}": weight for action, weight in enumerate(row.weights)}
        values = [{"tag": tag, "simple_value": value} for tag, value in points.items()]
        self._write(row.episode, summary={"value": values})

    def on_end(self, learner: "Learner") -> None:
        """Close the file."""
        self._writer.close()

    def _write(self, step: int, **content: Any) -> None:
        """Write an event through to the disk: what a checkpoint knows must not get lost."""
        event = self._library.event_pb2.Event(wall_time=time.time(), step=step, **content)
        self._writer.write_event(event)
        self._writer.flush()


def _library() -> Any:
    # Its SummaryWriter would write from another thread, for whose queue its own flush() does not wait.
    try:
        from tensorboardX import event_file_writer
    except ImportError as error:
        raise MissingExtraError(
            'TensorBoard needs tensorboardX, which is not installed: pip install "tuckerl[tensorboard]"'
        ) from error
    return event_file_writer
