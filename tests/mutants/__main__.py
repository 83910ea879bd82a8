"""Make small wrong changes, one at a time, in a copy of the repository, and say which of them the tests notice.

The tests of the changed folder come first, the others only if those notice nothing, fewest seconds first. Kernels are
interpreted, as every change would have them compiled anew, unless ``--compiled`` says otherwise; tests that need a
compiler are left out then. A survivor that is listed in equivalent.toml counts neither way. Exit status 1: something
survived. A hundred changes take an hour or two on two cores.
"""

import argparse
import difflib
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from tests.mutants.changes import Change, all_kinds, changes

ROOT = Path(__file__).parents[2]
PACKAGE = Path("src/tuckerl")
GROUND = "ground"
_COPIED = ("src", "tests", "docs", "benchmarks", "pyproject.toml", "CHANGELOG.md", "CONTRIBUTING.md", "README.md")
_NOT_RUN = ("structure", "docs", "mutants", "reference")  # tests of the text of sources, not of what they do
_FLAGS = ("-x", "-q", "-p", "no:cacheprovider", "--no-header", "-W", "ignore:overflow encountered:RuntimeWarning")


class Mutant(NamedTuple):
    """A change of a file of the package."""

    file: Path  # from the root
    text: str
    change: Change

    @property
    def folder(self) -> str:
        """The folder of tests that belong to the file."""
        inner = self.file.relative_to(PACKAGE)
        return inner.parts[0] if len(inner.parts) > 1 else GROUND

    def lines(self) -> tuple[str, str]:
        """Return the changed lines before and after, without what stands before and behind them."""
        old, new = self.text.splitlines(), self.change.applied(self.text).splitlines()
        marks = [line for line in difflib.unified_diff(old, new, n=0, lineterm="") if line[:3] not in ("---", "+++")]
        before, after = ([line[1:].strip() for line in marks if line[0] == sign] for sign in "-+")
        return "\n".join(before), "\n".join(after)


def main() -> int:
    """Play a sample and report; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--sample", type=int, default=20, help="how many changes (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="which ones")
    parser.add_argument("--folder", action="append", help="only of this folder of the package; may be repeated")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds for one run of tests; beyond is noticed")
    parser.add_argument("--own-tests-only", action="store_true", help="ask the changed folder's own tests only")
    parser.add_argument("--compiled", action="store_true", help="compile kernels instead of interpreting them")
    parser.add_argument("--list", action="store_true", help="show the sample and run nothing")
    chosen = parser.parse_args()
    mutants = sampled(chosen.sample, chosen.seed, chosen.folder)
    if chosen.list:
        for mutant in mutants:
            print(_described(mutant))
        return 0
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        return _report([(mutant, outcome) for mutant, outcome in _played(mutants, Path(folder), chosen)])


def sampled(n: int, seed: int, only: list[str] | None = None) -> list[Mutant]:
    """Return changes by chance: folders in turn, and within a folder every kind of change as often as another."""
    rng, by_folder = random.Random(seed), _by_folder()  # noqa: S311  # nothing is secret
    folders = [name for name in by_folder if not only or name in only]
    rng.shuffle(folders)
    drawn: list[Mutant] = []
    while len(drawn) < n and any(by_folder[folder] for folder in folders):
        for folder in folders:
            left = by_folder[folder]
            if left and len(drawn) < n:
                kind = rng.choice(list(all_kinds([mutant.change for mutant in left])))
                drawn.append(rng.choice([mutant for mutant in left if mutant.change.kind == kind]))
                left.remove(drawn[-1])
    return drawn


def _by_folder() -> dict[str, list[Mutant]]:
    found: dict[str, list[Mutant]] = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        file, text = path.relative_to(ROOT), path.read_text(encoding="utf-8")
        for change in changes(text):
            mutant = Mutant(file, text, change)
            found.setdefault(mutant.folder, []).append(mutant)
    return found


def _described(mutant: Mutant) -> str:
    before, after = mutant.lines()
    return f"{mutant.file}:{mutant.change.line} ({mutant.change.kind})\n    - {before}\n    + {after}"


def equivalents() -> list[dict[str, str]]:
    """Return the changes that are known to make no difference: `file`, `before`, `after` and `reason` of each."""
    listed: Any = tomllib.loads((ROOT / "tests/mutants/equivalent.toml").read_text(encoding="utf-8"))
    return list(listed.get("equivalent", []))


def _played(mutants: list[Mutant], folder: Path, chosen: argparse.Namespace) -> Any:
    """Yield each change with "noticed", "survived" or why it is equivalent."""
    for name in _COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_build"))
        else:
            shutil.copy(source, folder / name)
    known = {(one["file"], one["before"], one["after"]): one["reason"] for one in equivalents()}
    unsound = {name for name in {mutant.folder for mutant in mutants} if not _passes([name], folder, chosen)}
    if unsound:
        raise SystemExit(f"tests fail without any change, in {', '.join(sorted(unsound))}: put them right first")
    others = sorted(path.name for path in (ROOT / "tests").iterdir() if any(path.glob("test_*.py")))
    for number, mutant in enumerate(mutants):
        began, reason = time.monotonic(), known.get((mutant.file.as_posix(), *mutant.lines()))
        if reason is None:
            (folder / mutant.file).write_text(mutant.change.applied(mutant.text), encoding="utf-8")
            survives = _passes([mutant.folder], folder, chosen)
            if survives and not chosen.own_tests_only:
                rest = [name for name in others if name not in (*_NOT_RUN, mutant.folder)]
                survives = _passes(rest, folder, chosen)
            (folder / mutant.file).write_text(mutant.text, encoding="utf-8")
            reason = "survived" if survives else "noticed"
        took = time.monotonic() - began
        print(f"{number + 1:4} {reason.split()[0]:9} {took:4.0f} s  {_described(mutant)}", flush=True)
        yield mutant, reason


def _passes(names: list[str], folder: Path, chosen: argparse.Namespace) -> bool:
    """Return whether these folders' tests pass within the time limit."""
    places = [f"tests/{name}" for name in names if (folder / "tests" / name).is_dir()]
    own = {"PYTHONPATH": str(folder / "src"), "NUMBA_DISABLE_JIT": "0" if chosen.compiled else "1"}
    command = [sys.executable, "-m", "pytest", *_FLAGS, *places]
    process = subprocess.Popen(
        command, cwd=folder, env=os.environ | own, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        return process.wait(chosen.limit) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        process.kill()
        process.wait()


def _report(outcomes: list[tuple[Mutant, str]]) -> int:
    survivors = [mutant for mutant, outcome in outcomes if outcome == "survived"]
    noticed = sum(outcome == "noticed" for _, outcome in outcomes)
    judged = noticed + len(survivors)
    print(f"\nnoticed {noticed} of {judged}; equivalent: {len(outcomes) - judged}")
    for mutant in survivors:
        print(f"survived: {_described(mutant)}")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
