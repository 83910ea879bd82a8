"""Whether two versions of the library do the same to the last bit."""

import hashlib
import json
import subprocess
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.versions.names import OPTIONAL, Arrays
from benchmarks.versions.record import INDEX
from benchmarks.versions.studies import compare_studies
from benchmarks.versions.trees import Tree, both, command, environment

Index = dict[str, dict[str, Any]]


def compare(old_commit: str, words: str = "", *, studies: bool = False) -> bool:
    """Print a line for each case that holds `words` and return whether all are equal."""
    old, new = both(old_commit)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = _kept_files(old)
        there = _recorded_before(old, kept, words, folder)
        here = _recorded(new, kept, words, folder / "new", there / "saved")
        equal = _compare_records(there, here)
        if studies:
            equal &= compare_studies(old, new, folder / "studies")
    return equal


def _kept_files(old: Tree) -> Path:
    """Return the folder of the files that every version must read."""
    return next((old.folder / "tests").rglob("format1_q_learning.tuckerl")).parent


def _recorded_before(old: Tree, kept: Path, words: str, folder: Path) -> Path:
    """Return the old version's record; what does not change, the whole of it, is kept for the next time."""
    whole = old.folder.parent / f"record-{_cases_hash()}"
    if (whole / INDEX).exists():
        print(f"the old version ({old.commit[:12]}) was recorded before")
        return whole
    out = folder / "old" if words else whole
    return _recorded(old, kept, words, out, out / "saved")


def _cases_hash() -> str:
    """Return a hash of all that decides a version's record but for the version."""
    digest = hashlib.sha256()
    here = Path(__file__).parent
    for source in (here / "names.py", here / "record.py", *sorted((here / "cases").glob("*.py"))):
        digest.update(source.read_bytes())
    for name in ("numpy", "scipy", "numba", "gymnasium", "pettingzoo"):
        digest.update(version(name).encode())
    return digest.hexdigest()[:16]


def _recorded(tree: Tree, kept: Path, words: str, out: Path, handed_over: Path) -> Path:
    """Record a version's cases in the folder `out` and return it."""
    own = out / "saved"
    own.mkdir(parents=True, exist_ok=True)
    before = time.perf_counter()
    arguments = command("benchmarks.versions.record", out, own, handed_over, kept, *([words] if words else []))
    subprocess.run(arguments, check=True, env=environment(tree), cwd=out)
    print(f"recorded the {tree.name} version ({tree.commit[:12]}) in {time.perf_counter() - before:.0f} s", flush=True)
    return out


def _compare_records(there: Path, here: Path) -> bool:
    old, new = _index(there), _index(here)
    differing = 0
    for name in new:
        told = _difference(there, old[name], here, new[name])
        differing += told is not None
        print(f"{name}: {told or 'equal'}")
    print(f"{len(new)} cases, {differing} differ")
    return differing == 0


def _index(folder: Path) -> Index:
    index: Index = json.loads((folder / INDEX).read_text())
    return index


def _difference(there: Path, old: dict[str, Any], here: Path, new: dict[str, Any]) -> str | None:
    """Return in words the first difference between what a case left in two versions; None if there is none."""
    failures = [
        f"{which} FAILED: {entry['error']}" for which, entry in (("old", old), ("new", new)) if "error" in entry
    ]
    if failures:
        return "; ".join(failures)
    with np.load(there / old["archive"]) as a, np.load(here / new["archive"]) as b:
        return first_difference({name: a[name] for name in a.files}, {name: b[name] for name in b.files})


def first_difference(old: Arrays, new: Arrays) -> str | None:
    """Return in words where arrays of the same names first differ in a bit; None if they do not."""
    for name in [*old, *(name for name in new if name not in old)]:
        if name not in old or name not in new:
            if OPTIONAL in name:
                continue
            return f"DIFFERS: {name} is in the {'old' if name in old else 'new'} version only"
        a, b = old[name], new[name]
        if (a.dtype, a.shape) != (b.dtype, b.shape):
            return f"DIFFERS: {name} is {a.dtype} {a.shape} in the old version, {b.dtype} {b.shape} in the new"
        if a.tobytes() != b.tobytes():
            return f"DIFFERS: {_first_entry(name, a, b)}"
    return None


def _first_entry(name: str, a: np.ndarray, b: np.ndarray) -> str:
    bytes_of_both = (np.frombuffer(array.tobytes(), dtype=np.uint8).reshape(array.size, -1) for array in (a, b))
    old, new = bytes_of_both
    unequal = (old != new).any(axis=1)
    place = int(np.argmax(unequal))
    where = [int(i) for i in np.unravel_index(place, a.shape)]
    values = f"{a.flat[place]!r} in the old version, {b.flat[place]!r} in the new"
    return f"{name}{where or ''} is {values} ({int(unequal.sum())} of {a.size} entries differ)"
