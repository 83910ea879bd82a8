"""How much memory is free, and whether something fits into it before anything is allocated."""

import ctypes
import math
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tuckerl.errors import TableSizeError


class Part(NamedTuple):
    """A part of what something needs."""

    name: str
    n_bytes: int
    advice: str  # what to change where this is too much


_FEW_BYTES = 2**20  # less is taken without a question: to read what is free takes as long as many a short episode


def check_memory(what: str, parts: Sequence[Part]) -> None:
    """Refuse what needs more memory than is free; about a mebibyte or less nobody asks.

    Parameters
    ----------
    what : str
        What needs it, for the message.
    parts : sequence of Part
        All that it needs.

    Raises
    ------
    TableSizeError
        If that is so: it names the parts, largest first, and what to change about the largest.
    """
    needed = sum(part.n_bytes for part in parts)
    if needed <= _FEW_BYTES or needed <= (free := available_memory()):
        return
    largest = sorted((part for part in parts if part.n_bytes), key=lambda part: -part.n_bytes)
    listed = ", ".join(f"{part.name} {in_bytes(part.n_bytes)}" for part in largest[:4])
    raise TableSizeError(
        f"{what} would take {in_bytes(needed)} of memory ({listed}{', ...' if len(largest) > 4 else ''}), and "
        f"{in_bytes(free)} are free: {largest[0].advice}"
    )


def in_bytes(n: int) -> str:
    """Return a number of bytes as text, in a larger unit besides where it is long.

    Examples
    --------
    >>> in_bytes(800), in_bytes(3 * 2**30), in_bytes(10**30)
    ('800 bytes', '3,221,225,472 bytes (3.0 GiB)', 'about 10^30 bytes')
    """
    if n < 2**20:
        return f"{n:,} bytes"
    return f"{n:,} bytes ({n / 2**30:,.1f} GiB)" if n < 10**15 else f"about 10^{int(math.log10(n))} bytes"


def available_memory() -> int:
    """Return how many bytes this process can still take: what the system, its container and its limits leave.

    Where the system does not say, it is more than any desk has.
    """
    return min((limit for limit in (*_of_system(), *_of_containers(), *_of_process())), default=2**40)


def _of_system() -> Iterator[int]:
    """Yield what the machine has free, with what it can take back from its caches."""
    if sys.platform == "win32":
        yield _of_windows()
        return
    fields = dict(line.split(":", 1) for line in _lines(Path("/proc/meminfo")))
    if "MemAvailable" in fields:
        yield int(fields["MemAvailable"].split()[0]) * 1024
        return
    try:
        yield _of_macos() if sys.platform == "darwin" else os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError, subprocess.SubprocessError):
        return


def _of_macos() -> int:
    """Return the pages that are free or can be, as `vm_stat` counts them."""
    lines = subprocess.run(["/usr/bin/vm_stat"], capture_output=True, text=True, check=True, timeout=5).stdout
    pages = dict(line.split(":", 1) for line in lines.splitlines()[1:] if ":" in line)
    kinds = ("Pages free", "Pages inactive", "Pages speculative", "Pages purgeable")
    return sum(int(pages[kind].strip(" .")) for kind in kinds if kind in pages) * os.sysconf("SC_PAGE_SIZE")


class _WindowsMemory(ctypes.Structure):
    """MEMORYSTATUSEX, as Windows fills it in."""

    _fields_ = (
        ("length", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        *((name, ctypes.c_ulonglong) for name in ("total", "free", "page_total", "page_free", "all", "left", "more")),
    )


def _of_windows() -> int:
    status = _WindowsMemory(length=ctypes.sizeof(_WindowsMemory))
    ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))  # type: ignore[attr-defined,unused-ignore]  # on Windows only
    return int(min(status.free, status.left))


_V2 = ("memory.max", "memory.current", "inactive_file")
_V1 = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")


def _of_containers(root: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> Iterator[int]:
    """Yield what each control group around this process leaves, of version 1 or 2; files that it caches can go."""
    for line in _lines(own):
        _, controllers, path = line.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        names, mounts = (_V1, (root / "memory",)) if controllers else (_V2, (root, root / "unified"))
        for mount in mounts:
            group = mount / path.lstrip("/")
            # In a container, its own group may stand at the mount itself, whatever the path says.
            for folder in (group, *(parent for parent in group.parents if parent.is_relative_to(mount))):
                yield from _of_group(folder, *names)


def _of_group(folder: Path, limit: str, usage: str, cached: str) -> Iterator[int]:
    most, used = "".join(_lines(folder / limit)), "".join(_lines(folder / usage))
    if most.isdigit() and used.isdigit():
        pairs = dict(pair for line in _lines(folder / "memory.stat") if len(pair := line.split()) == 2)
        yield max(0, int(most) - int(used) + int(pairs.get(cached, 0)))


def _of_process() -> Iterator[int]:
    """Yield what `ulimit -v` leaves."""
    try:
        import resource
    except ImportError:  # Windows
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    pages = "".join(_lines(Path("/proc/self/statm"))).split()
    if limit != resource.RLIM_INFINITY:
        yield max(0, limit - (int(pages[0]) * os.sysconf("SC_PAGE_SIZE") if pages else 0))


def _lines(path: Path) -> list[str]:
    """Return a file's lines; none where it cannot be read."""
    try:
        return path.read_text().splitlines()
    except (OSError, UnicodeDecodeError):
        return []
