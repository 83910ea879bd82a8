"""A folder of results: which study it holds, and what its finished runs have left.

``study.json`` says which study was last asked for. ``parts/`` has what all runs have left that were ever finished here,
each once: it only grows, so that a kill at any moment, a study that grows and one that shrinks lose nothing. From it
``runs.parquet`` and its sisters are made, sorted: the same bytes whatever the order in which runs ended.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from tuckerl.errors import OutputConflictError, OutputError, ParameterError, TuckerlError
from tuckerl.files import make_folder, write_whole
from tuckerl.studies.checkpoints import forget
from tuckerl.studies.executed_code import changes
from tuckerl.studies.folder_lock import FolderLock
from tuckerl.studies.parts import Fresh, Parts, parquet
from tuckerl.studies.runs import Run, all_runs, run_code, run_identities
from tuckerl.studies.study import Study
from tuckerl.studies.tables import KEY, StudyTables
from tuckerl.studies.workers import Played

_FORMAT = 2
_SHOWN = ("claims.json", "compare.json", "report.html")  # what reports make of the tables
_MADE = "made.json"
_FREE = ("runs", "instances")  # numbers of a scenario that may grow and shrink
_FAILURES = "failures"


class Store:
    """The results of one study in one folder, which nobody else may use until `close`.

    Parameters
    ----------
    folder : Path
        Made if it is missing.
    study : Study
    overwrite : bool
        Whether the results of another study in the folder may be deleted, and runs that other code has played be
        played again.
    accept_code : bool
        Whether runs that other code has played count as finished.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    OutputConflictError
        If it holds another study's results, or runs that other code has played, and nothing says what to do with them;
        or if another process uses it.
    """

    def __init__(self, folder: Path, study: Study, *, overwrite: bool = False, accept_code: bool = False) -> None:
        if overwrite and accept_code:
            raise ParameterError(
                "runs of other code are either kept (--accept-code) or played again (--overwrite): give one of the two"
            )
        self.folder, self.study = folder, study
        self._identities = run_identities(study)
        self._codes = {(s.name, v.name): run_code(s, v) for s in study.scenarios for v in s.variants}
        make_folder(folder)
        self._lock = FolderLock(folder)
        try:
            self._open(overwrite=overwrite, accept_code=accept_code)
        except BaseException as error:
            self.close()
            if isinstance(error, OSError) and not isinstance(error, TuckerlError):
                raise OutputError(f"cannot use the folder {folder}: {error}; choose another with --out") from error
            raise

    def _open(self, *, overwrite: bool, accept_code: bool) -> None:
        difference = self._difference()
        if difference and not overwrite:
            raise OutputConflictError(
                f"{self.folder} holds the results of another study ({difference}): choose another folder with --out, "
                "or replace them with --overwrite"
            )
        self._parts = Parts(self.folder / "parts")
        if difference is not None:
            self._parts.delete()
            self._forget_shown()
        self._old = set() if accept_code else set(self._played_by_other_code())
        if self._old and not overwrite:
            raise OutputConflictError(self._other_code())
        write_whole(self.folder / "study.json", json.dumps(_specification(self.study), indent=1).encode())

    def _forget_shown(self) -> None:
        """Delete what was shown of another study: nothing of it may stand beside this one's."""
        shown = (*(self.folder / name for name in _SHOWN), *(self.folder / "figures").glob("*.*"))
        for path in (*self._outputs().values(), self.folder / _MADE, *shown):
            path.unlink(missing_ok=True)

    def close(self) -> None:
        """Let others use the folder."""
        self._lock.release()

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _played_by_other_code(self) -> Iterator[str]:
        """Give the identities of the study's stored runs that not this code has played."""
        for run, identity in self._identities.items():
            stored = self._parts.stored.get(identity)
            if stored is not None and stored.code != self._codes[run.scenario, run.variant]:
                yield identity

    def _other_code(self) -> str:
        of_run = {identity: run for run, identity in self._identities.items()}
        identity = min(self._old)
        run = of_run[identity]
        what = "; ".join(changes(self._parts.stored[identity].code, self._codes[run.scenario, run.variant]))
        return (
            f"{self.folder} holds {len(self._old)} of the study's runs as other code has played them ({what}): keep "
            "them with --accept-code, or play them again with --overwrite"
        )

    def finished(self) -> set[Run]:
        """Return the study's finished runs."""
        stored = self._parts.stored
        return {run for run, one in self._identities.items() if one in stored and one not in self._old}

    def missing(self) -> list[Run]:
        """Return the study's runs that are to be played, in order; of those that are the same, one."""
        finished = self.finished()
        missing = {self._identities[run]: run for run in reversed(all_runs(self.study)) if run not in finished}
        return list(reversed(missing.values()))

    def checkpoints(self, runs: Iterable[Run]) -> dict[Run, Path]:
        """Return where runs may keep what they have, if they take long: known by their code, too."""
        folder = self.folder / "checkpoints"
        make_folder(folder)
        for unfinished in folder.glob(".*"):
            unfinished.unlink(missing_ok=True)
        return {run: folder / f"{self._identities[run]}-{self._code_digest(run)}.tuckerl" for run in runs}

    def _code_digest(self, run: Run) -> str:
        code = self._codes[run.scenario, run.variant]
        return hashlib.sha256(json.dumps(code, sort_keys=True).encode()).hexdigest()[:16]

    def add(self, played: Sequence[Played]) -> None:
        """Store what runs have left, or why they failed: when this returns, it is on the disk."""
        fresh = [
            Fresh(self._identities[one.run], one.run, self._codes[one.run.scenario, one.run.variant], one.tables)
            for one in played
            if one.tables is not None
        ]
        if fresh:
            self._parts.add(fresh)
        self._old -= {one.identity for one in fresh}
        for one in played:
            failure = self._failure(one.run)
            if one.tables is None:
                make_folder(failure.parent)
                write_whole(failure, one.error.encode())
            else:
                failure.unlink(missing_ok=True)
                forget(
                    self.folder / "checkpoints" / f"{self._identities[one.run]}-{self._code_digest(one.run)}.tuckerl"
                )

    def _failure(self, run: Run) -> Path:
        return self.folder / _FAILURES / f"{self._identities[run]}.txt"

    def failures(self) -> dict[Run, Path]:
        """Return the tracebacks of the study's runs that failed when they were last played."""
        failed = {path.stem for path in (self.folder / _FAILURES).glob("*.txt")}
        return {run: self._failure(run) for run, one in self._identities.items() if one in failed}

    @property
    def tables(self) -> StudyTables:
        """All finished runs' tables, in the order of the study whatever the order in which they ended."""
        finished = self.finished()
        rows = [(*run, self._identities[run]) for run in all_runs(self.study) if run in finished]
        return self._parts.read(pl.DataFrame(rows, KEY | {"identity": pl.String}, orient="row"))

    def write_tables(self) -> StudyTables:
        """Write ``runs.parquet`` and its sisters, where they are not what they should be, and return the tables."""
        self._parts.bring_together()
        tables, state = self.tables, self._state()
        made = self._made()
        if made.get("of") != state or any(made.get(n) != _digest_of(path) for n, path in self._outputs().items()):
            contents = {name: parquet(frame) for name, frame in tables._asdict().items()}
            for name, path in self._outputs().items():
                write_whole(path, contents[name])
            digests = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
            write_whole(self.folder / _MADE, json.dumps({"of": state, **digests}, indent=1).encode())
        return tables

    def _outputs(self) -> dict[str, Path]:
        return {name: self.folder / f"{name}.parquet" for name in StudyTables._fields}

    def _state(self) -> str:
        """Return a digest of what the tables are made of."""
        finished = self.finished()
        runs = [[*run, one] for run, one in self._identities.items() if run in finished]
        return hashlib.sha256(json.dumps(runs).encode()).hexdigest()

    def _made(self) -> dict[str, Any]:
        try:
            return dict(json.loads((self.folder / _MADE).read_bytes()))
        except (OSError, ValueError, TypeError):
            return {}

    def _difference(self) -> str | None:
        """Return what differs from the study that the folder holds: None for nothing, "" where it holds none."""
        path = self.folder / "study.json"
        if not path.exists():
            held = self._outputs()["runs"]
            return f"{held.name} without study.json" if held.exists() else ""
        try:
            there = json.loads(path.read_bytes())
            return next(_changes_of_study(there, _specification(self.study)), None)
        except (OSError, ValueError, AttributeError, TypeError, KeyError):
            return "its study.json cannot be read"


def _digest_of(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None


def _specification(study: Study) -> dict[str, Any]:
    """Return which study it is, as JSON."""
    normal: dict[str, Any] = json.loads(json.dumps({"format": _FORMAT, **study.specification()}))
    return normal


def _changes_of_study(there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    """Give in words what makes one study another, and not a larger or a smaller one of the same."""
    if there["format"] != here["format"]:
        yield f"written by an older or newer tuckerl, in format {there['format']} and not {here['format']}"
        return
    yield from differences(there["seed"], here["seed"], "seed")
    for name in there["scenarios"].keys() & here["scenarios"].keys():
        old, new = there["scenarios"][name], here["scenarios"][name]
        place = f"scenarios.{name}"
        yield from differences(_fixed(old), _fixed(new), place)
        for variant in old["variants"].keys() & new["variants"].keys():
            yield from differences(old["variants"][variant], new["variants"][variant], f"{place}.variants.{variant}")


def _fixed(scenario: dict[str, Any]) -> dict[str, Any]:
    """Return what of a scenario must not change, but for its variants."""
    return {key: value for key, value in scenario.items() if key not in (*_FREE, "variants")}


def differences(there: Any, here: Any, place: str) -> Iterator[str]:
    """Give in words what differs between two values of JSON, `place` being where they stand."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(n for n in there if n not in here)]:
            inside = f"{place}.{name}" if place else name
            if name in there and name in here:
                yield from differences(there[name], here[name], inside)
            else:
                yield f"{inside} is {'there and not in' if name in there else 'not there and in'} this one"
    elif there != here:
        yield f"{place} is {json.dumps(there)} there and {json.dumps(here)} now"
