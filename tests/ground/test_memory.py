"""What is free, and what does not fit."""

import os
from pathlib import Path

import pytest

from tuckerl import memory
from tuckerl.errors import ProblemError, TableSizeError
from tuckerl.memory import Part, available_memory, check_memory, in_bytes

GIB = 2**30


def test_something_is_free() -> None:
    assert 2**20 < available_memory() < 2**60


@pytest.mark.parametrize(
    ("n", "text"),
    [
        (1023, "1,023 bytes"),
        (3 * GIB, "3,221,225,472 bytes (3.0 GiB)"),
        (10**15, "about 10^15 bytes"),
        (2**10_000, "about 10^3010 bytes"),  # no float holds it
    ],
)
def test_sizes_are_said_in_bytes(n: int, text: str) -> None:
    assert in_bytes(n) == text


def test_what_fits_is_let_pass_and_what_does_not_is_told_by_its_largest_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 2**20 + 100)
    check_memory("this", [Part("one", 2**20, "less of one"), Part("two", 100, "less of two")])
    expected = (
        r"^this would take 1,048,677 bytes \(0.0 GiB\) of memory \(two 1,048,637 bytes \(0.0 GiB\), one 40 bytes\), "
        r"and 1,048,676 bytes \(0.0 GiB\) are free: less of two$"
    )
    with pytest.raises(TableSizeError, match=expected) as caught:
        check_memory("this", [Part("one", 40, "less of one"), Part("two", 2**20 + 61, "less of two")])
    assert isinstance(caught.value, MemoryError)
    assert isinstance(caught.value, ProblemError)


def test_of_little_nobody_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 0)
    check_memory("this", [Part("one", 2**19, ""), Part("two", 2**19, "")])
    with pytest.raises(TableSizeError):
        check_memory("this", [Part("one", 2**20 + 1, "")])


def write(folder: Path, **files: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(f"{text}\n")


def left(root: Path, own: str) -> list[int]:
    (root / "own").write_text(f"{own}\n")
    return list(memory._of_containers(root, root / "own"))


def test_control_groups_of_version_2_and_all_around_them(tmp_path: Path) -> None:
    write(tmp_path / "job", memory__max=str(8 * GIB), memory__current=str(3 * GIB))
    write(tmp_path / "job" / "step", memory__max="max", memory__current=str(GIB))
    assert left(tmp_path, "0::/job/step") == [5 * GIB]
    write(tmp_path / "job" / "step", memory__max=str(2 * GIB))
    write(tmp_path / "job" / "step", memory__stat=f"anon 5\ninactive_file {GIB // 2}")
    assert left(tmp_path, "0::/job/step") == [GIB + GIB // 2, 5 * GIB]


def test_control_groups_of_version_1_where_a_container_sees_its_own_at_the_root(tmp_path: Path) -> None:
    write(tmp_path / "memory", memory__limit_in_bytes=str(4 * GIB), memory__usage_in_bytes=str(GIB))
    assert left(tmp_path, "4:memory:/docker/abc\n3:cpu:/docker/abc") == [3 * GIB]
    write(tmp_path / "memory", memory__usage_in_bytes=str(5 * GIB))
    assert left(tmp_path, "4:memory:/docker/abc") == [0], "never below nothing"


def test_without_control_groups_there_is_no_limit(tmp_path: Path) -> None:
    assert left(tmp_path, "0::/") == []
    assert list(memory._of_containers(tmp_path, tmp_path / "no file")) == []


def test_a_limit_of_the_process_leaves_what_it_has_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    resource = pytest.importorskip("resource")  # Windows has no such limits
    monkeypatch.setattr(resource, "getrlimit", lambda what: (4 * GIB, 4 * GIB))
    monkeypatch.setattr(memory, "_lines", lambda path: ["10 5 3"])
    assert list(memory._of_process()) == [4 * GIB - 10 * os.sysconf("SC_PAGE_SIZE")]
    monkeypatch.setattr(memory, "_lines", lambda path: [])  # nobody says what it has taken
    assert list(memory._of_process()) == [4 * GIB]
    monkeypatch.setattr(resource, "getrlimit", lambda what: (resource.RLIM_INFINITY,) * 2)
    assert list(memory._of_process()) == []
