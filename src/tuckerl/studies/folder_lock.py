"""A folder that one process at a time may write into.

The lock is the operating system's, on a file in the folder. It ends with the process that holds it, however that ends:
a file that a killed process leaves behind locks nothing.
"""

import os
import sys
from contextlib import suppress
from errno import EACCES, EAGAIN, EDEADLK
from pathlib import Path

from tuckerl.errors import OutputConflictError, OutputError

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


LOCK = ".lock"
_TAKEN = (EACCES, EAGAIN, EDEADLK)

_held: set["FolderLock"] = set()


class FolderLock:
    """The right to write into a folder, until `release` or the end of the process.

    Parameters
    ----------
    folder : Path
        Which is there.

    Raises
    ------
    OutputConflictError
        If another has it.
    OutputError
        If the folder, or the file system that it is on, does not let itself be locked.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._path = folder, folder / LOCK
        try:
            self._file = self._open()
        except OSError as error:
            if isinstance(error, OutputConflictError):
                raise
            raise OutputError(f"cannot lock {folder}: {error.strerror}; choose another folder with --out") from error
        _held.add(self)

    def _open(self) -> int:
        """Return the locked file, which still is the one in the folder: its last holder may just have deleted it."""
        while True:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                self._lock(file)
                with suppress(FileNotFoundError):
                    if os.path.samestat(os.fstat(file), self._path.stat()):
                        os.truncate(file, 0)
                        os.write(file, str(os.getpid()).encode())
                        return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)

    def _lock(self, file: int) -> None:
        try:
            _lock(file)
        except OSError as error:
            if error.errno not in _TAKEN:
                raise
            holder = os.pread(file, 20, 0).decode(errors="replace") if hasattr(os, "pread") else ""
            who = f"process {holder}" if holder else "another process"
            raise OutputConflictError(
                f"{self._folder} is in use by {who}: wait for its end, or choose another folder with --out"
            ) from error

    def release(self) -> None:
        """Let others have it, and delete the file."""
        if self not in _held:
            return
        _held.remove(self)
        with suppress(OSError):  # where it was deleted already, or (on Windows) is open
            self._path.unlink()
        self.let_go()

    def let_go(self) -> None:
        """Close the file, and no more: who shares it with this process keeps the lock."""
        os.close(self._file)


def _let_go_of_all() -> None:
    """Close the files in a forked child: it holds no lock, and must not keep one when its parent is dead."""
    for lock in _held:
        lock.let_go()
    _held.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go_of_all)
