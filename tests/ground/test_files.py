"""Files are written whole or not at all."""

import os
import stat
import sys
from pathlib import Path

import pytest

from tuckerl import files
from tuckerl.errors import OutputError


def test_a_file_is_written_and_replaced(tmp_path: Path) -> None:
    path = tmp_path / "result.bin"
    for content in (b"first", b"", b"second" * 10_000):
        files.write_whole(path, content)
        assert path.read_bytes() == content
        assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("call", ["fsync", "fdopen"])
def test_a_failure_leaves_the_old_file_and_nothing_else(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "result.bin"
    files.write_whole(path, b"old")

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, call, full)
    with pytest.raises(OutputError, match=r"cannot write .*result\.bin: No space left on device; make room there$"):
        files.write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupt_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "result.bin"
    files.write_whole(path, b"old")

    def interrupted(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        files.write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"cannot write .*a\.bin: No such file or directory; choose a folder"):
        files.write_whole(tmp_path / "nowhere" / "a.bin", b"")


def test_a_path_that_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(OutputError, match=r"cannot write .*folder"):
        files.write_whole(tmp_path / "folder", b"")
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder"]


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # As the call fails for everybody but the superuser.
    def refused(**arguments: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkstemp", refused)
    with pytest.raises(
        OutputError, match=r"cannot write .*a\.bin: Permission denied; choose a folder that you can write"
    ):
        files.write_whole(tmp_path / "a.bin", b"")
    assert list(tmp_path.iterdir()) == []


def test_the_system_has_all_of_it_when_it_is_asked_to_put_it_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fsync = os.fsync
    seen: list[bytes] = []

    def looking(descriptor: int) -> None:
        seen.extend(path.read_bytes() for path in tmp_path.iterdir())
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", looking)
    files.write_whole(tmp_path / "result", b"short")
    assert seen == [b"short"], "one file, under its temporary name"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no umask")
def test_the_umask_is_as_before(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        files.write_whole(tmp_path / "result", b"")
        assert os.umask(0o027) == 0o027
        assert stat.S_IMODE((tmp_path / "result").stat().st_mode) == 0o640
    finally:
        os.umask(before)


def test_only_what_is_unfinished_is_deleted(tmp_path: Path) -> None:
    kept = ["result", "other", ".other.x1", ".result", ".results.x1"]
    for name in (*kept, ".result.x1", ".result.y2"):
        (tmp_path / name).touch()
    files.delete_unfinished(tmp_path / "result")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(kept)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no umask")
def test_a_result_is_as_readable_as_other_files(tmp_path: Path) -> None:
    (tmp_path / "other").touch()
    files.write_whole(tmp_path / "result", b"")
    ours, theirs = (stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("result", "other"))
    assert ours == theirs
