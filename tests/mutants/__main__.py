"""Make small wrong changes, one at a time, in a copy of the repository, and say which of them the tests notice.

First the tests are run once without any change (half an hour; kept in .mutants/ until a folder of tests changes), to
record which functions each of them calls. A change is then shown to the tests that call its function: the changed
folder's own first, then file by file, fewest seconds first, until one fails. What survives is shown to all tests of the
changed folder, and to those of them that need a compiler; the others run with interpreted kernels, as every change
would have them compiled anew. A survivor that is listed in equivalent.toml counts neither way. Exit status 1:
something survived.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from tests.mutants.changes import Change, all_kinds, changes
from tests.mutants.record import RecordedTest, function_at, recorded_in

ROOT = Path(__file__).parents[2]
PACKAGE = Path("src/tuckerl")
GROUND = "ground"
_RECORDS = ROOT / ".mutants"
_COPIED = ("src", "tests", "docs", "benchmarks", "pyproject.toml", "CHANGELOG.md", "CONTRIBUTING.md", "README.md")
_NOT_RUN = ("structure", "docs", "mutants", "reference")  # tests of the text of sources, not of what they do
_FLAGS = ("-q", "-p", "no:cacheprovider", "--no-header", "--tb=no", "-m", "not long")
_RECORDING = 1800.0  # seconds for a folder of tests
_NO_TESTS = 5  # pytest's exit status: what was chosen is not there any more


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

    @property
    def function(self) -> str:
        """The function that is changed, as records name it."""
        return function_at(self.file.as_posix(), self.text, self.change.line)

    def lines(self) -> tuple[str, str]:
        """Return the whole lines that the change is in, before and after."""
        text, (_, _, start, end, new) = self.text, self.change
        first, last = text.rfind("\n", 0, start) + 1, text.find("\n", end)
        both = text[first:last], text[first:start] + new + text[end:last]
        before, after = ("\n".join(line.strip() for line in lines.splitlines()) for lines in both)
        return before, after


def main() -> int:
    """Play a sample and report; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--sample", type=int, default=20, help="how many changes (default 20)")
    parser.add_argument("--skip", type=int, default=0, help="leave out the first of them, as they were played before")
    parser.add_argument("--seed", type=int, default=0, help="which ones")
    parser.add_argument("--folder", action="append", help="only of this folder of the package; may be repeated")
    parser.add_argument("--seconds", type=float, default=200.0, help="how long the tests that call a function may take")
    parser.add_argument("--jobs", type=int, default=2, help="how many changes at a time (default 2)")
    parser.add_argument("--list", action="store_true", help="show the sample and run nothing")
    chosen = parser.parse_args()
    mutants = sampled(chosen.sample, chosen.seed, chosen.folder)[chosen.skip :]
    if chosen.list:
        for mutant in mutants:
            print(_described(mutant))
        return 0
    tests = _recorded()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        return _report(list(_played(mutants, tests, Path(folder), chosen)))


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
                mutant = rng.choice([mutant for mutant in left if mutant.change.kind == kind])
                left.remove(mutant)
                drawn += [mutant] * mutant.change.is_python(mutant.text)
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


def _recorded() -> list[RecordedTest]:
    """Return all tests that can be run, as they went without any change."""
    _RECORDS.mkdir(exist_ok=True)
    tests: list[RecordedTest] = []
    for folder in sorted({path.parent for path in (ROOT / "tests").glob("*/test_*.py")}):
        if folder.name in _NOT_RUN:
            continue
        record = _RECORDS / f"{folder.name}.jsonl"
        youngest = max(path.stat().st_mtime for path in folder.rglob("*.py"))
        if not record.exists() or record.stat().st_mtime < youngest:
            print(f"recording tests/{folder.name} ...", flush=True)
            record.write_text("")
            _run(ROOT, [f"tests/{folder.name}"], _RECORDING, {"MUTANTS_RECORD": str(record)})
        went = recorded_in(record)
        wrong = [f"{test.outcome}: {test.name}" for test in went if test.outcome in ("failed", "unfinished")]
        if wrong or not went:
            record.unlink()
            reasons = "\n".join(wrong) or f"tests/{folder.name} cannot be collected"
            raise SystemExit(f"put right first what fails without any change, or takes over {_RECORDING} s:\n{reasons}")
        tests += went
    return tests


def _played(
    mutants: list[Mutant], tests: list[RecordedTest], folder: Path, chosen: argparse.Namespace
) -> Iterator[tuple[Mutant, str]]:
    """Yield each change with what became of it: noticed, survived, or why it is equivalent."""
    known = {(one["file"], one["before"], one["after"]): one["reason"] for one in equivalents()}
    copies: SimpleQueue[Path] = SimpleQueue()
    for job in range(chosen.jobs):
        copies.put(_copied(folder / str(job)))

    def play(mutant: Mutant) -> tuple[Mutant, str, float]:
        began, outcome = time.monotonic(), known.get((mutant.file.as_posix(), *mutant.lines()))
        if outcome is None:
            copy = copies.get()
            (copy / mutant.file).write_text(mutant.change.applied(mutant.text), encoding="utf-8")
            outcome = _outcome(mutant, tests, copy, chosen.seconds)
            (copy / mutant.file).write_text(mutant.text, encoding="utf-8")
            copies.put(copy)
        return mutant, outcome, time.monotonic() - began

    with ThreadPoolExecutor(chosen.jobs) as pool:
        for number, (mutant, outcome, took) in enumerate(pool.map(play, mutants), chosen.skip + 1):
            print(f"{number:4} {took:4.0f} s  {outcome}\n    {_described(mutant)}", flush=True)
            yield mutant, outcome


def _copied(folder: Path) -> Path:
    folder.mkdir()
    for name in _COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_build"))
        else:
            shutil.copy(source, folder / name)
    return folder


def _outcome(mutant: Mutant, tests: list[RecordedTest], copy: Path, seconds: float) -> str:
    """Show the change that is made in `copy` to the tests, the likeliest first."""
    first = likeliest(mutant, tests, seconds)
    own = [test for test in tests if test.file.startswith(f"tests/{mutant.folder}/")]
    about = tests if mutant.file.name == "_jit.py" else own  # what compiles matters to all
    stages = [
        (first, "1"),
        ([test for test in own if test.outcome == "passed" and test not in first], "1"),
        ([test for test in about if test.outcome == "skipped"], "0"),
    ]
    for stage, interpreted in stages:
        if stage and (notice := _notice(stage, copy, interpreted)):
            return f"noticed by {notice}"
    return "survived"


def likeliest(mutant: Mutant, tests: list[RecordedTest], seconds: float) -> list[RecordedTest]:
    """Return tests that call the changed function, or else anything of its file, in the order to be run.

    The changed folder's own come first, then file by file those that take fewer seconds, until that many are spent.
    """
    file, function = f"{mutant.file.as_posix()}:", mutant.function
    of_file = [test for test in tests if any(call.startswith(file) for call in test.calls)]
    by_file: dict[str, list[RecordedTest]] = {}
    for test in [test for test in of_file if function in test.calls] or of_file:
        by_file.setdefault(test.file, []).append(test)
    took = {name: sum(test.seconds for test in group) for name, group in by_file.items()}
    chosen: list[RecordedTest] = []
    for name in sorted(by_file, key=lambda name: (not name.startswith(f"tests/{mutant.folder}/"), took[name])):
        if seconds > 0:
            chosen += by_file[name]
        seconds -= took[name]
    return chosen


def _notice(tests: list[RecordedTest], copy: Path, interpreted: str) -> str | None:
    """Return the test that fails, or that time ran out, or nothing."""
    listed = copy / "chosen.txt"
    listed.write_text("\n".join(test.name for test in tests), encoding="utf-8")
    limit = 120.0 + 5.0 * sum(test.seconds for test in tests)
    own = {"MUTANTS_CHOSEN": str(listed), "NUMBA_DISABLE_JIT": interpreted}
    status, words = _run(copy, list(dict.fromkeys(test.file for test in tests)), limit, own, "-x")
    failed = [line for line in words.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if status == 0 or status == _NO_TESTS:
        return None
    return "the time limit" if status is None else failed[0].split(" - ")[0] if failed else "pytest: it cannot start"


def _run(place: Path, names: list[str], limit: float, own: dict[str, str], *flags: str) -> tuple[int | None, str]:
    """Run tests and return pytest's exit status, None if time ran out, and its words."""
    command = [sys.executable, "-m", "pytest", "-p", "tests.mutants.record", *_FLAGS, *flags, *names]
    environment = os.environ | {"PYTHONPATH": str(place / "src"), "NUMBA_DISABLE_JIT": "1"} | own
    process = subprocess.Popen(
        command, cwd=place, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    try:
        words, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        return None, ""
    finally:
        process.kill()
        process.wait()
    return process.returncode, words


def _report(outcomes: list[tuple[Mutant, str]]) -> int:
    survivors = [mutant for mutant, outcome in outcomes if outcome == "survived"]
    noticed = sum(outcome.startswith("noticed") for _, outcome in outcomes)
    judged = noticed + len(survivors)
    print(f"\nnoticed {noticed} of {judged}; equivalent: {len(outcomes) - judged}")
    for mutant in survivors:
        print(f"survived: {_described(mutant)}")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
