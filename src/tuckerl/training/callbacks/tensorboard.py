"""A log for TensorBoard, which needs the extra ``tuckerl[tensorboard]``."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from typing import TYPE_CHECKING, Any

from tuckerl.checks import check_path
from tuckerl.errors import MissingExtraError, OutputError
from tuckerl.files import FULL
from tuckerl.training.callbacks.base import Callback
from tuckerl.training.callbacks.logs import window_rows

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner

_SUFFIX = ".tuckerl"  # of the names of our files of events


class TensorBoard(Callback):
    """Write curves for TensorBoard, with a point for each window of episodes.

    They are ``return`` and ``steps`` (means over the window's episodes and all agents), ``alpha`` and ``epsilon`` (of
    its last episode) and, with a tensor step, ``weights/0``, ``weights/1``, ... (of the actions, after it), over the
    number of episodes. The folder always holds the whole history of the learner, every window once, whatever an earlier
    program wrote there: each call of `learn` writes a new file of events, with the windows of before (their wall time
    is that of the call), and deletes those that earlier calls wrote.

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
        self.folder = check_path("folder", folder)
        self._library = _library()
        self._writer: Any = None
        self._told = 0  # episodes of whose windows there are points

    def on_start(self, learner: "Learner") -> None:
        """Begin a file of events with all windows of before, and delete the file that had them."""
        with self._errors():
            self.folder.mkdir(parents=True, exist_ok=True)
            earlier = [path for path in self.folder.iterdir() if path.name.endswith(_SUFFIX)]
            # The library names files by the second: two calls of `learn` within one would write the same file.
            self._writer = self._library.EventsWriter(str(self.folder / "events"), f".{time.time_ns()}{_SUFFIX}")
            self._told = 0
            self._write(0, session_log={"status": 1})  # a start: TensorBoard forgets the points that it has read
            self._write_windows(learner)
            for path in earlier:
                path.unlink(missing_ok=True)

    def on_window(self, learner: "Learner") -> None:
        """Write the points of the latest window."""
        with self._errors():
            self._write_windows(learner)

    def on_end(self, learner: "Learner") -> None:
        """Close the file."""
        if self._writer is not None:
            with self._errors():
                self._writer.close()

    def _write_windows(self, learner: "Learner") -> None:
        """Write what is not told yet, through to the system: what a checkpoint knows must not get lost."""
        for row in window_rows(learner, self.every or learner.window, self._told):
            points = {"return": row.mean_return, "steps": row.mean_steps, "alpha": row.alpha, "epsilon": row.epsilon}
            if learner.tensor_step is not None:
                points |= {f"weights/{action}": weight for action, weight in enumerate(row.weights)}
            self._write(row.episode, summary={"value": [{"tag": t, "simple_value": v} for t, v in points.items()]})
            self._told = row.episode
        self._writer.flush()

    def _write(self, step: int, **content: Any) -> None:
        self._writer.write_event(self._library.event_pb2.Event(wall_time=time.time(), step=step, **content))

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            reason = error.strerror or str(error)
            advice = "make room there" if error.errno in FULL else "choose another folder"
            raise OutputError(f"cannot write into {self.folder}: {reason}; {advice}") from error


def _library() -> Any:
    # Its SummaryWriter would write from another thread, for whose queue its own flush() does not wait.
    try:
        from tensorboardX import event_file_writer
    except ImportError as error:
        raise MissingExtraError(
            'TensorBoard needs tensorboardX, which is not installed: pip install "tuckerl[tensorboard]"'
        ) from error
    return event_file_writer
