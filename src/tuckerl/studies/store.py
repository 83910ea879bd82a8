"""A folder of results: which study it holds, and what its finished runs have left.

``study.json`` says which study was last asked for. ``parts/`` has what all runs have left that were ever finished here,
also those of other studies and other code: it only grows, so that neither a kill nor another study loses anything. From
it ``runs.parquet`` and its sisters are made, sorted: the same bytes whatever the order in which runs ended.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import polars as pl

from tuckerl.errors import OutputConflictError, OutputError, ParameterError, TuckerlError
from tuckerl.files import FULL, make_folder, write_whole
from tuckerl.studies.checkpoints import forget
from tuckerl.studies.executed_code import changes, code_digest, completed
from tuckerl.studies.folder_lock import FolderLock
from tuckerl.studies.parts import LOCATION, Fresh, Parts, Stored, parquet
from tuckerl.studies.runs import Run, all_runs, run_code, run_identities
from tuckerl.studies.study import Study
from tuckerl.studies.study_differences import changes_of_study, seeds_of, study_specification
from tuckerl.studies.tables import KEY, StudyTables
from tuckerl.studies.workers import Played

# What reports make of the tables:
_SHOWN = ("claims.json", "compare.json", "comparisons.json", "tune.json", "request.json", "report.html")
_MADE = "made.json"
_FAILURES = "failures"


class Results:
    """What a folder holds of a study, to be looked at, also while another process adds to it.

    Parameters
    ----------
    folder : Path
    study : Study
    any_code : bool
        Whether runs count as finished that other code has played than there is now.

    Raises
    ------
    OutputError
        If it cannot be read.
    """

    def __init__(self, folder: Path, study: Study, *, any_code: bool = False) -> None:
        self.folder, self.study, self._any_code = folder, study, any_code
        self._identities = run_identities(study)
        self._codes = {(s.name, v.name): run_code(s, v) for s in study.scenarios for v in s.variants}
        self._code = {variant: code_digest(code) for variant, code in self._codes.items()}  # of each variant's runs
        self._held = _read_json(folder / "study.json")
        self._accepted = set(self._held.get("accepted_code", []) if isinstance(self._held, dict) else [])
        self._parts = Parts(folder / "parts")
        self._finished, self._of_then = self._stored()

    def _stored(self) -> tuple[dict[str, Stored], dict[str, Stored]]:
        """Return the stored runs of the study by identity: of this code or an accepted one; of other code alone."""
        of_now, of_then = dict[str, Stored](), dict[str, Stored]()
        digests = {digest: code_digest(completed(code)) for digest, code in self._parts.codes.items()}
        for run, identity in self._identities.items():
            found = self._parts.stored.get(identity, [])
            code = self._code[run.scenario, run.variant]
            of_code = {digests[stored.code]: stored for stored in found}
            accepted = [stored for stored in found if stored.code in self._accepted]
            if code in of_code:
                of_now[identity] = of_code[code]
            elif accepted:
                of_now[identity] = self._parts.latest(accepted)
            elif found and self._any_code:
                of_now[identity] = self._parts.latest(found)
            elif found:
                of_then[identity] = self._parts.latest(found)
        return of_now, of_then

    def finished(self) -> set[Run]:
        """Return the study's finished runs."""
        return {run for run, identity in self._identities.items() if identity in self._finished}

    @property
    def tables(self) -> StudyTables:
        """All finished runs' tables, in the order of the study whatever the order in which they ended."""
        rows = [
            (*run, stored.part, stored.place)
            for run, identity in self._identities.items()
            if (stored := self._finished.get(identity)) is not None
        ]
        return self._parts.read(pl.DataFrame(rows, KEY | LOCATION, orient="row"))

    def failures(self) -> dict[Run, Path]:
        """Return the tracebacks of the study's runs that failed when they were last played."""
        failed = {path.stem for path in (self.folder / _FAILURES).glob("*.txt")}
        return {run: self._failure(run) for run, one in self._identities.items() if one in failed}

    def _failure(self, run: Run) -> Path:
        return self.folder / _FAILURES / f"{self._identities[run]}.txt"


class Store(Results):
    """The results of one study in one folder, into which nobody else may write until `close`.

    Parameters
    ----------
    folder : Path
        Made if it is missing.
    study : Study
    overwrite : bool
        Whether another study may take the place of that in the folder, whose tables and figures are deleted, and runs
        that other code has played be played again.
    accept_code : bool
        Whether runs that other code has played count as finished, from now on.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    OutputConflictError
        If it holds another study's results, and not only a part of this one's, or runs that other code has played,
        and nothing says what to do with them; or if another process uses it.
    """

    def __init__(self, folder: Path, study: Study, *, overwrite: bool = False, accept_code: bool = False) -> None:
        if overwrite and accept_code:
            raise ParameterError(
                "runs of other code are either kept (--accept-code) or played again (--overwrite): give one of the two"
            )
        make_folder(folder)
        self._lock = FolderLock(folder)
        try:
            with _used(folder):
                super().__init__(folder, study)
                self._open(overwrite=overwrite, accept_code=accept_code)
        except BaseException:
            self.close()
            raise

    def _open(self, *, overwrite: bool, accept_code: bool) -> None:
        difference = self._difference()
        if difference and not overwrite:
            raise OutputConflictError(
                f"{self.folder} holds the results of another study ({difference}): choose another folder with --out, "
                "or replace what it shows with --overwrite"
            )
        if self._of_then and not (overwrite or accept_code):
            raise OutputConflictError(self._other_code())
        self._parts.tidy()
        self._parts.codes |= {digest: self._codes[variant] for variant, digest in self._code.items()}
        if accept_code:
            self._accepted |= {stored.code for stored in self._of_then.values()}
        if overwrite:  # what was accepted before, too, is played again
            self._accepted.clear()
        if accept_code or overwrite:
            self._finished, self._of_then = self._stored()
        if difference is not None:
            self._forget_shown()
        held = study_specification(self.study)
        held |= {"accepted_code": sorted(self._accepted), "seeds": seeds_of(self.study)}
        if held != self._held:
            write_whole(self.folder / "study.json", json.dumps(held, indent=1).encode())

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

    def _other_code(self) -> str:
        of_then = self._of_then
        run, identity = next((run, identity) for run, identity in self._identities.items() if identity in of_then)
        there = self._parts.codes[of_then[identity].code]
        what = "; ".join(changes(there, self._codes[run.scenario, run.variant]))
        return (
            f"{self.folder} holds {len(of_then)} of the study's runs as other code has played them ({what}): keep them "
            "with --accept-code, or play them again with --overwrite"
        )

    @property
    def n_rows(self) -> int:
        """Rows of the table of runs, as far as these are finished."""
        rows = {(s.name, v.name): s.episodes_of(v) * v.n_agents for s in self.study.scenarios for v in s.variants}
        return sum(rows[run.scenario, run.variant] for run in self.finished())

    def missing(self) -> list[Run]:
        """Return the study's runs that are to be played, in order; of those that are the same, one."""
        finished = self.finished()
        missing = {self._identities[run]: run for run in reversed(all_runs(self.study)) if run not in finished}
        return list(reversed(missing.values()))

    def checkpoints(self, runs: Iterable[Run]) -> dict[Run, Path]:
        """Return where runs may keep what they have, if they take long: known by their code, too."""
        folder = self.folder / "checkpoints"
        make_folder(folder)
        with _used(self.folder):
            for unfinished in folder.glob(".*"):
                unfinished.unlink(missing_ok=True)
        return {run: self._checkpoint(run) for run in runs}

    def _checkpoint(self, run: Run) -> Path:
        code = self._code[run.scenario, run.variant]
        return self.folder / "checkpoints" / f"{self._identities[run]}-{code}.tuckerl"

    def add(self, played: Sequence[Played]) -> None:
        """Store what runs have left, or why they failed: when this returns, it is on the disk."""
        fresh = [
            Fresh(self._identities[one.run], one.run, self._code[one.run.scenario, one.run.variant], one.tables)
            for one in played
            if one.tables is not None
        ]
        with _used(self.folder):
            if fresh:
                self._finished |= self._parts.add(fresh)
            for one in played:
                self._note(one)

    def _note(self, one: Played) -> None:
        """Keep why a run failed, or delete what is no longer needed of one that is stored."""
        failure = self._failure(one.run)
        if one.tables is None:
            make_folder(failure.parent)
            write_whole(failure, one.error.encode())
        else:
            failure.unlink(missing_ok=True)
            forget(self._checkpoint(one.run))

    def write_tables(self) -> StudyTables:
        """Write ``runs.parquet`` and its sisters, where they are not what they should be, and return the tables."""
        with _used(self.folder):
            return self._written()

    def _written(self) -> StudyTables:
        if self._parts.bring_together():  # they are elsewhere now
            self._finished, self._of_then = self._stored()
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
        finished = self._finished
        runs = [[*run, one, finished[one].code] for run, one in self._identities.items() if one in finished]
        return hashlib.sha256(json.dumps(runs).encode()).hexdigest()

    def _made(self) -> dict[str, Any]:
        try:
            return dict(json.loads((self.folder / _MADE).read_bytes()))
        except (OSError, ValueError, TypeError):
            return {}

    def _difference(self) -> str | None:
        """Return what differs from the study that the folder holds: None for nothing, "" where it holds none."""
        if self._held is None:
            held = self._outputs()["runs"]
            return f"{held.name} without study.json" if held.exists() else ""
        try:
            return next(changes_of_study(self._held, study_specification(self.study)), None)
        except (AttributeError, TypeError, KeyError):
            return "its study.json is not one that tuckerl writes"


@contextmanager
def _used(folder: Path) -> Iterator[None]:
    """Say of whatever the system refuses in the block that the folder cannot be used.

    Raises
    ------
    OutputError
        If that is so.
    """
    try:
        yield
    except OSError as error:
        if isinstance(error, TuckerlError):
            raise
        advice = "make room there" if error.errno in FULL else "choose another with --out"
        raise OutputError(f"cannot use the folder {folder}: {error}; {advice}") from error


def _read_json(path: Path) -> Any:
    """Return what a file holds: None if there is none, "" if it cannot be read."""
    try:
        return json.loads(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        return ""


def _digest_of(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None
