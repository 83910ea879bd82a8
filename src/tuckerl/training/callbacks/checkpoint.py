"""Save a learner again and again while it learns."""

from os import PathLike
from typing import TYPE_CHECKING

from tuckerl.checks import check_path
from tuckerl.files import check_folder_of
from tuckerl.training.callbacks.base import Callback

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class Checkpoint(Callback):
    """Save the learner again and again, so that little is lost when the program or the machine stops.

    It is saved after windows and at the end, after Ctrl-C or an error, too. A file is written whole or not at all, and
    going on from it (``type(agent).load(path)``, then `learn`) equals never having stopped, to the last bit. What could
    not promise that is not saved: a learner whose tables are not finite any more, or whose latest episode an error in
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
        self.path = check_path("path", path)
        self._saved_at: int | None = None

    def on_start(self, learner: "Learner") -> None:
        """Find out early whether there is a folder."""
        self._saved_at = None
        check_folder_of(self.path)

    def on_window(self, learner: "Learner") -> None:
        """Save the learner."""
        learner.save(str(self.path).replace("{episode}", str(learner.episodes)))
        self._saved_at = learner.episodes

    def on_end(self, learner: "Learner") -> None:
        """Save it for the last time, if it has gone on."""
        if learner.is_saveable and learner.episodes != self._saved_at:
            self.on_window(learner)
