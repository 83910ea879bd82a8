"""A folder of results: the specification of a study, and the tables of all its tasks that are finished.

``study.json`` says which study the folder holds; ``runs.parquet`` and its sisters hold the finished tasks. Each file is
written whole or not at all, ``runs.parquet`` last: a task is finished when it stands there, so a kill at any moment
costs no more than the tasks since the last write. ``digests.json`` is written before them, and has of each file the
digests of what stands there and of what is to come: what is neither is damaged, and is not believed.
"""

import hashlib
import io
import json
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import polars as pl

import tuckerl
from tuckerl._version import __version__
from tuckerl.errors import OutputConflictError, OutputError, SavedFileError, TuckerlError
from tuckerl.files import make_folder, write_whole
from tuckerl.studies.runner import SCHEMAS, StudyTables, Task
from tuckerl.studies.study import Study

_FORMAT = 1
_WRITE_ORDER = ("weights", "paths", "times", "runs")
_DIGESTS = "digests.json"
_SHOWN = ("claims.json", "compare.json", "report.html")  # what reports make of the tables


class Store:
    """The results of one study in one folder.

    Parameters
    ----------
    folder : Path
        Made if it is missing.
    study : Study
    overwrite : bool
        Whether the results of another study in the folder may be deleted.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    OutputConflictError
        If it holds another study's results and `overwrite` is False.
    """

    def __init__(self, folder: Path, study: Study, *, overwrite: bool = False) -> None:
        self.folder, self.study = folder, study
        self._specification = _specification(study)
        self._tables = _empty_tables()
        self._digests: dict[str, str] = {}  # of the files that stand there, by table
        make_folder(folder)
        try:
            self._open(overwrite)
        except OSError as error:
            if isinstance(error, TuckerlError):
                raise
            raise OutputError(f"cannot use the folder {folder}: {error}; choose another with --out") from error

    def _open(self, overwrite: bool) -> None:
        folder, difference = self.folder, self._difference()
        if difference is None:
            try:
                self._tables = self._read()
                return
            except SavedFileError:
                if not overwrite:
                    raise
        if difference and not overwrite:
            raise OutputConflictError(
                f"{folder} holds the results of another study ({difference}): choose another folder with --out, or "
                "replace them with --overwrite"
            )
        shown = (*(folder / name for name in _SHOWN), *(folder / "figures").glob("*.*"))
        # Nothing of the other study may stand beside this one's.
        for path in (*self._paths().values(), folder / _DIGESTS, *shown):
            path.unlink(missing_ok=True)
        write_whole(folder / "study.json", json.dumps(self._specification, indent=1).encode())

    @property
    def tables(self) -> StudyTables:
        """All finished tasks' tables, in the order of the study whatever the order in which they ended."""
        return StudyTables(*(self._sorted(frame) for frame in self._tables))

    def finished(self) -> set[Task]:
        """Return the finished tasks."""
        places = {scenario.name: place for place, scenario in enumerate(self.study.scenarios)}
        keys = self._tables.runs.select("scenario", "instance", "run").unique()
        return {Task(places[name], instance, run) for name, instance, run in keys.iter_rows()}

    def add(self, tables: list[StudyTables]) -> None:
        """Add the tables of finished tasks and write all to the folder."""
        self._tables = StudyTables(*(pl.concat(frames) for frames in zip(self._tables, *tables, strict=True)))
        paths, contents = self._paths(), {}
        for name, frame in self.tables._asdict().items():
            buffer = io.BytesIO()
            frame.write_parquet(buffer, statistics=False)
            contents[name] = buffer.getvalue()
        digests = {name: _digest(content) for name, content in contents.items()}
        listed = {name: [self._digests.get(name), digest] for name, digest in digests.items()}
        write_whole(self.folder / _DIGESTS, json.dumps(listed, indent=1).encode())
        for name in _WRITE_ORDER:
            write_whole(paths[name], contents[name])
        self._digests = digests

    def _paths(self) -> dict[str, Path]:
        return {name: self.folder / f"{name}.parquet" for name in SCHEMAS}

    def _difference(self) -> str | None:
        """Return what differs from the study that the folder holds: None for nothing, "" where it holds none."""
        path = self.folder / "study.json"
        if not path.exists():
            held = self._paths()["runs"]
            return f"{held.name} without study.json" if held.exists() else ""
        try:
            there = json.loads(path.read_bytes())
        except (OSError, ValueError):
            return "its study.json cannot be read"
        return next(differences(there, self._specification, ""), None)

    def _read(self) -> StudyTables:
        if not all(path.exists() for path in self._paths().values()):
            return _empty_tables()
        frames: dict[str, pl.DataFrame] = {}
        listed = self._listed()
        for name, path in self._paths().items():
            content = path.read_bytes()
            self._digests[name] = _digest(content)
            if self._digests[name] not in listed.get(name, []):
                raise SavedFileError(f"{path} is damaged: delete it, or replace all with --overwrite")
            frames[name] = pl.read_parquet(content).cast(SCHEMAS[name])
        # A kill between two files can leave tasks in the others that are not in runs.parquet; they are played again.
        key = ["scenario", "variant", "instance", "run"]
        finished = frames["runs"].select(key).unique()
        return StudyTables(**{name: frame.join(finished, on=key, how="semi") for name, frame in frames.items()})

    def _listed(self) -> dict[str, list[Any]]:
        """Return the digests that each table's file may have."""
        try:
            listed = json.loads((self.folder / _DIGESTS).read_bytes())
            return {name: list(digests) for name, digests in listed.items()}
        except (OSError, ValueError, AttributeError, TypeError):
            return {}

    def _sorted(self, frame: pl.DataFrame) -> pl.DataFrame:
        order = [(s.name, v.name) for s in self.study.scenarios for v in s.variants]
        schema = {"scenario": pl.String, "variant": pl.String}
        places = pl.DataFrame(order, schema, orient="row").with_row_index("place")
        within = [c for c in ("instance", "run", "agent", "episode", "step", "action") if c in frame.columns]
        return frame.join(places, on=["scenario", "variant"], how="left").sort("place", *within).drop("place")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _empty_tables() -> StudyTables:
    return StudyTables(**{name: pl.DataFrame(schema=schema) for name, schema in SCHEMAS.items()})


def _specification(study: Study) -> dict[str, Any]:
    """Return what must be equal for results to be the same bits: the study, and the code that plays it."""
    sources = hashlib.sha256()
    package = Path(tuckerl.__file__).parent
    for source in sorted(package.rglob("*.py")):
        if source.relative_to(package).parts[0] not in ("cli", "reports"):  # they show results, they decide none
            sources.update(source.read_bytes())
    versions = {name: version(name) for name in ("numpy", "scipy", "numba")}
    code = {"tuckerl": __version__, "sources": sources.hexdigest()[:16], **versions}
    specification = {"format": _FORMAT, **study.specification(), "versions": code}
    normal: dict[str, Any] = json.loads(json.dumps(specification))
    return normal


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
