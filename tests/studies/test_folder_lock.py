"""A folder is one process's at a time, and nobody's when that is dead."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tuckerl.errors import OutputConflictError, OutputError
from tuckerl.studies import folder_lock
from tuckerl.studies.folder_lock import FolderLock


def test_a_locked_folder_is_refused_by_name_until_it_is_released(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    with pytest.raises(OutputConflictError, match=f"{tmp_path.name} is in use by process {os.getpid()}: wait"):
        FolderLock(tmp_path)
    lock.release()
    assert list(tmp_path.iterdir()) == []
    again = FolderLock(tmp_path)
    lock.release()  # twice does no harm to the one who has it now
    with pytest.raises(OutputConflictError):
        FolderLock(tmp_path)
    again.release()


def test_a_file_that_a_killed_process_left_locks_nothing(tmp_path: Path) -> None:
    (tmp_path / folder_lock.LOCK).touch()
    FolderLock(tmp_path).release()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_its_holder_deletes_meanwhile_is_no_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = FolderLock(tmp_path)
    lock_file = folder_lock._lock
    tried: list[int] = []

    def release_before(file: int) -> None:
        if not tried:
            first.release()
        tried.append(file)
        lock_file(file)

    monkeypatch.setattr(folder_lock, "_lock", release_before)
    second = FolderLock(tmp_path)
    assert len(tried) == 2, "the file of the first was locked, but was no longer the folder's"
    with pytest.raises(OutputConflictError):
        FolderLock(tmp_path)
    second.release()


def test_a_file_system_without_locks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(file: int) -> None:
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr(folder_lock, "_lock", refuse)
    with pytest.raises(
        OutputError, match=r"cannot lock .*: Function not implemented; choose another folder with --out"
    ):
        FolderLock(tmp_path)


_HOLDER = """
import os, sys, time
from pathlib import Path
from tuckerl.studies.folder_lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
if not os.fork():
    print(os.getpid(), flush=True)  # by the child: it has let go of the lock when this is read
time.sleep(60)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_lock_dies_with_its_holder_though_a_forked_child_lives_on(tmp_path: Path) -> None:
    holder = subprocess.Popen([sys.executable, "-c", _HOLDER, tmp_path], stdout=subprocess.PIPE, text=True)
    child = 0
    try:
        assert holder.stdout is not None
        child = int(holder.stdout.readline())
        with pytest.raises(OutputConflictError):
            FolderLock(tmp_path)
        holder.kill()
        holder.wait()
        os.kill(child, 0)  # it lives
        FolderLock(tmp_path).release()
    finally:
        holder.kill()
        if child:
            os.kill(child, signal.SIGKILL)
        holder.communicate()
