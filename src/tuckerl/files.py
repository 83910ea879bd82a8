"""Files that are written whole or not at all."""

import errno
import glob
import os
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from tuckerl.errors import OutputError

FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
"""The numbers of errors that say that there is no room on a disk."""


def write_whole(path: Path, content: bytes) -> None:
    """Write `content` to `path`: to a temporary name beside it, flushed to the disk, then renamed.

    Raises
    ------
    OutputError
        If the folder does not exist or cannot be written.
    """
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes private files; a result is as readable as any other file that the user makes.
        umask = os.umask(0)
        os.umask(umask)
        Path(temporary).chmod(0o666 & ~umask)
        Path(temporary).replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        advice = "make room there" if error.errno in FULL else "choose a folder that you can write to"
        raise OutputError(f"cannot write {path}: {reason}; {advice}") from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def delete_unfinished(path: Path) -> None:
    """Delete what a killed process left of writing `path`, which nobody may be writing now."""
    for temporary in path.parent.glob(f".{glob.escape(path.name)}.*"):
        with suppress(OSError):  # it is only in the way
            temporary.unlink()


def is_file(path: Path) -> bool:
    """Return whether there is such a file; False where the system does not say, as of a name that is too long."""
    with suppress(OSError):
        return path.is_file()
    return False


def check_folder_of(path: Path) -> None:
    """Refuse a path whose folder does not exist, before anything is done that could not be kept.

    Raises
    ------
    OutputError
        If that is so.
    """
    if not path.parent.is_dir():
        raise OutputError(f"cannot write {path}: there is no folder {path.parent}; make it first")


def make_folder(folder: Path, advice: str = "choose another with --out", without: Iterable[str] = ()) -> None:
    """Make a folder and those that it lies in, where they are missing; delete the files `without` in it.

    Raises
    ------
    OutputError
        If that cannot be done; it ends with the `advice`.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in without:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {error.strerror}; {advice}") from error
