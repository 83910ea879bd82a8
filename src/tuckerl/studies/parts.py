"""What runs have left, in files that are written once and never changed: each has its own digest as its name.

A part is a zip file without compression: ``index.json``, which says which runs are in it, by identity, and what code
played them, the latest of it with the highest number, and a Parquet file for each table, whose rows say of which of
these runs they are. A part that does not have the digest that its name says is damaged: it is set aside, and what it
may have held has not been played.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.errors import DamagedResultsWarning, warn
from tuckerl.files import make_folder, write_whole
from tuckerl.studies.runs import Run
from tuckerl.studies.tables import ROWS, StudyTables
from tuckerl.types import IntArray

_SUFFIX, _ASIDE = ".part", ".damaged"
_OF = "of"  # the column that says of which of a part's runs a row is
LOCATION: dict[str, Any] = {"part": pl.String, _OF: pl.UInt32}
"""Where a run is stored."""
_MANY, _SMALL = 32, 4_000_000  # so many parts of less than so many bytes are brought together


class Stored(NamedTuple):
    """A run that is stored: as what, played by which code, and where."""

    run: Run  # as the study called it that played it
    code: str  # the digest of the code that played it
    part: str  # the part's name
    place: int  # among the part's runs


class Fresh(NamedTuple):
    """A run that is to be stored."""

    identity: str
    run: Run
    code: str  # the digest of one of `Parts.codes`
    tables: StudyTables


class Parts:
    """The parts in a folder, which need not be there as long as nothing is added.

    Raises
    ------
    FileNotFoundError
        If whoever writes there has just put some of them into another one: looking again helps.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.codes: dict[str, dict[str, str]] = {}
        """What code has played them, by its digest."""
        self.stored: dict[str, list[Stored]] = {}
        """All runs that are stored, by identity; several times where other code has played them, too."""
        self._order: dict[str, int] = {}  # of codes, by when they first played here: parts' names have none
        self._sizes: dict[str, int] = {}
        self._damaged: list[tuple[Path, str]] = []  # with the digests that they have
        for path in sorted(folder.glob(f"*{_SUFFIX}")):
            self._open(path)

    def tidy(self) -> None:
        """Set aside what is damaged, and delete what a killed process left half written: nobody else may write now."""
        for unfinished in self.folder.glob(f".*{_SUFFIX}.*"):
            unfinished.unlink(missing_ok=True)
        for path, digest in self._damaged:
            path.replace(path.with_suffix(_ASIDE))
            what = "is damaged and was set aside as {}: the runs in it are played again"
            if digest in self._sizes:
                what = f"has what {digest}{_SUFFIX} has, and was set aside as {{}}: "
                is_of_part = len(path.stem) == len(digest)  # it is one's name, in whose place it stands
                what += "the runs that it had are played again" if is_of_part else "nothing is lost"
            warn(f"{path} {what.format(path.stem + _ASIDE)}", DamagedResultsWarning)
        self._damaged.clear()

    def _open(self, path: Path) -> None:
        content = path.read_bytes()
        if (digest := _digest(content)) != path.stem:
            self._damaged.append((path, digest))
            return
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            index = json.loads(archive.read("index.json"))
        self._add_index(path.stem, index)
        self._sizes[path.stem] = len(content)

    def latest(self, several: Sequence[Stored]) -> Stored:
        """Return what the latest code has played, of the same run."""
        return max(several, key=lambda stored: self._order[stored.code])

    def _add_index(self, part: str, index: dict[str, Any]) -> None:
        self.codes |= index["codes"]
        for code in index["codes"]:
            self._order[code] = max(self._order.get(code, 0), index.get("order", {}).get(code, 0))
        for place, (identity, code, *run) in enumerate(index["runs"]):
            self.stored.setdefault(identity, []).append(Stored(Run(*run), code, part, place))

    def add(self, fresh: Sequence[Fresh]) -> dict[str, Stored]:
        """Store runs, and return where they are, by identity: they are on the disk then."""
        make_folder(self.folder)
        tables = StudyTables(*(_marked([getattr(one.tables, name) for one in fresh]) for name in StudyTables._fields))
        self._write([(one.identity, one.run, one.code) for one in fresh], tables)
        return {one.identity: self.stored[one.identity][-1] for one in fresh}

    def _write(self, runs: Sequence[tuple[str, Run, str]], tables: StudyTables) -> None:
        entries = [[identity, code, *run] for identity, run, code in runs]
        codes = {code: self.codes[code] for code in sorted({code for _, _, code in runs})}
        new = max(self._order.values(), default=0) + 1
        order = {code: self._order.get(code, new) for code in codes}
        index = {"runs": entries, "codes": codes, "order": order}
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as archive:
            _put(archive, "index.json", json.dumps(index).encode())
            for name, frame in tables._asdict().items():
                _put(archive, f"{name}.parquet", parquet(frame))
        content = buffer.getvalue()
        part = _digest(content)
        write_whole(self.folder / f"{part}{_SUFFIX}", content)
        self._add_index(part, index)
        self._sizes[part] = len(content)

    def read(self, wanted: pl.DataFrame) -> StudyTables:
        """Return the tables of the stored runs that are wanted.

        Parameters
        ----------
        wanted : DataFrame
            A row for each run: in which `part` and at which place `of` it it is, and whatever else is to stand in front
            of its rows, in this order.
        """
        labels = wanted.drop(list(LOCATION))
        found: dict[str, list[tuple[IntArray, pl.DataFrame]]] = {name: [] for name in StudyTables._fields}
        for (part,), own in wanted.with_row_index("order").group_by("part", maintain_order=True):
            order, places = own["order"].to_numpy(), own[_OF].to_numpy()
            for name, frame in self._tables(str(part))._asdict().items():
                run, row = _rows_of(frame[_OF].to_numpy(), places)
                found[name].append((order[run], frame.drop(_OF)[row]))
        return StudyTables(*(_ordered(labels, found[name], ROWS[name]) for name in StudyTables._fields))

    def _tables(self, part: str) -> StudyTables:
        with zipfile.ZipFile(self.folder / f"{part}{_SUFFIX}") as archive:
            frames = {name: pl.read_parquet(archive.read(f"{name}.parquet")) for name in StudyTables._fields}
        return StudyTables(**{name: _completed(own, {_OF: pl.UInt32} | ROWS[name]) for name, own in frames.items()})

    def bring_together(self) -> bool:
        """Make one part of the small ones, where these are many; return whether that was so."""
        small = sorted(name for name, size in self._sizes.items() if size < _SMALL)
        if len(small) < _MANY:
            return False
        held: dict[str, list[tuple[int, str, Run, str]]] = {part: [] for part in small}
        for identity, several in self.stored.items():
            for stored in several:
                if stored.part in held:
                    held[stored.part].append((stored.place, identity, stored.run, stored.code))
        runs: list[tuple[str, Run, str]] = []
        frames = []
        for part, own in held.items():
            frames.append([frame.with_columns(pl.col(_OF) + len(runs)) for frame in self._tables(part)])
            runs += [(identity, run, code) for _, identity, run, code in sorted(own, key=itemgetter(0))]
        self._write(runs, StudyTables(*(pl.concat(each) for each in zip(*frames, strict=True))))
        for part in small:  # now that all of it stands elsewhere, too
            del self._sizes[part]
            (self.folder / f"{part}{_SUFFIX}").unlink(missing_ok=True)
        for identity, several in self.stored.items():
            self.stored[identity] = [stored for stored in several if stored.part not in held]
        return True


def _rows_of(of: IntArray, places: IntArray) -> tuple[IntArray, IntArray]:
    """Return the rows of chosen runs, run after run.

    Parameters
    ----------
    of : (R,) int
        Of which of a part's runs each row is, rising.
    places : (n,) int
        The chosen ones.

    Returns
    -------
    run, row : (m,) int64
        Which of the chosen runs each row is of, and the row.
    """
    first, beyond = np.searchsorted(of, places, "left"), np.searchsorted(of, places, "right")
    counts = beyond - first
    run = np.repeat(np.arange(places.size), counts)
    skipped = np.cumsum(counts) - counts
    return run, np.arange(run.size) + np.repeat(first - skipped, counts)


def _ordered(labels: pl.DataFrame, found: list[tuple[IntArray, pl.DataFrame]], columns: dict[str, Any]) -> pl.DataFrame:
    """Return the rows that were found in the order of the runs that they are of, behind these runs' labels."""
    if not found:
        return pl.DataFrame(schema=labels.schema | columns)
    order = np.concatenate([order for order, _ in found])
    rows = pl.concat([frame for _, frame in found]).select(*columns)
    if len(found) > 1:
        sorting = np.argsort(order, kind="stable")
        order, rows = order[sorting], rows[sorting]
    return pl.concat([labels[order], rows], how="horizontal")


def _completed(frame: pl.DataFrame, columns: dict[str, Any]) -> pl.DataFrame:
    """Return a table with all of its columns: one that older code did not write is null."""
    missing = [pl.lit(None, dtype=kind).alias(name) for name, kind in columns.items() if name not in frame.columns]
    return frame.with_columns(*missing).select(*columns)


def _marked(frames: list[pl.DataFrame]) -> pl.DataFrame:
    """Return the rows of all, each behind the place of the frame that it is from."""
    places = np.repeat(np.arange(len(frames), dtype=np.uint32), [frame.height for frame in frames])
    return pl.concat(frames).select(pl.Series(_OF, places), pl.all())


def _put(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    archive.writestr(zipfile.ZipInfo(name), content)  # with a fixed date: the same content has the same digest


def parquet(frame: pl.DataFrame) -> bytes:
    """Return a table as the bytes of a Parquet file."""
    buffer = io.BytesIO()
    frame.write_parquet(buffer, statistics=False)
    return buffer.getvalue()


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
