"""What runs have left, in files that are written once and never changed: each has its own digest as its name.

A part is a zip file without compression: ``index.json``, which says which runs are in it, by identity, and what code
played them, and a Parquet file for each table, whose rows say of which of these runs they are. A part that does not
have the digest that its name says is damaged: it is set aside, and what it may have held has not been played.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from tuckerl.errors import DamagedResultsWarning, warn
from tuckerl.files import make_folder, write_whole
from tuckerl.studies.runs import Run
from tuckerl.studies.tables import ROWS, StudyTables

_SUFFIX, _ASIDE = ".part", ".damaged"
_OF = "of"  # the column that says of which of a part's runs a row is
_MANY, _SMALL = 32, 4_000_000  # so many parts of less than so many bytes are brought together


class Stored(NamedTuple):
    """A run that is stored: as what, played by which code, and where."""

    run: Run  # as the study called it that played it
    code: dict[str, str]
    part: str  # the part's name
    place: int  # among the part's runs


class Fresh(NamedTuple):
    """A run that is to be stored."""

    identity: str
    run: Run
    code: dict[str, str]
    tables: StudyTables


class Parts:
    """The parts in a folder.

    Parameters
    ----------
    folder : Path
        Made if it is missing. Nobody else may be writing into it.

    Raises
    ------
    OutputError
        If it cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        make_folder(folder)
        for unfinished in folder.glob(f".*{_SUFFIX}.*"):  # of a process that was killed
            unfinished.unlink(missing_ok=True)
        self.stored: dict[str, Stored] = {}
        """All runs that are stored, by identity."""
        self._sizes: dict[str, int] = {}
        for path in sorted(folder.glob(f"*{_SUFFIX}")):
            self._open(path)

    def _open(self, path: Path) -> None:
        content = path.read_bytes()
        if _digest(content) != path.stem:
            path.replace(path.with_suffix(_ASIDE))
            warn(
                f"{path} is damaged and was set aside as {path.stem}{_ASIDE}: the runs in it are played again",
                DamagedResultsWarning,
            )
            return
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            index = json.loads(archive.read("index.json"))
        self._add_index(path.stem, index)
        self._sizes[path.stem] = len(content)

    def _add_index(self, part: str, index: dict[str, Any]) -> None:
        codes = index["code"]
        for place, (identity, code, *run) in enumerate(index["runs"]):
            self.stored.setdefault(identity, Stored(Run(*run), codes[code], part, place))

    def add(self, fresh: Sequence[Fresh]) -> None:
        """Store runs: when this returns they are on the disk."""
        tables = StudyTables(
            *(
                pl.concat([_marked(getattr(one.tables, name), place) for place, one in enumerate(fresh)])
                for name in StudyTables._fields
            )
        )
        self._write([(one.identity, one.run, one.code) for one in fresh], tables)

    def _write(self, runs: Iterable[tuple[str, Run, dict[str, str]]], tables: StudyTables) -> None:
        codes: list[dict[str, str]] = []
        entries = []
        for identity, run, code in runs:
            if code not in codes:
                codes.append(code)
            entries.append([identity, codes.index(code), *run])
        index = {"runs": entries, "code": codes}
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
            A row for each run: its `identity`, and whatever else is to stand in front of its rows, in this order.
        """
        located = wanted.with_row_index("order").with_columns(
            part=pl.Series([self.stored[identity].part for identity in wanted["identity"]], dtype=pl.String),
            of=pl.Series([self.stored[identity].place for identity in wanted["identity"]], dtype=pl.UInt32),
        )
        labels = [name for name in wanted.columns if name != "identity"]
        found: dict[str, list[pl.DataFrame]] = {name: [] for name in StudyTables._fields}
        for (part,), own in located.group_by("part"):
            for name, frame in self._tables(str(part))._asdict().items():
                found[name].append(own.join(frame, on=_OF, maintain_order="left_right"))
        if not wanted.height:
            schema = {name: wanted.schema[name] for name in labels}
            return StudyTables(*(pl.DataFrame(schema=schema | ROWS[name]) for name in StudyTables._fields))
        return StudyTables(
            **{
                name: pl.concat(frames).sort("order", maintain_order=True).select(*labels, *ROWS[name])
                for name, frames in found.items()
            }
        )

    def _tables(self, part: str) -> StudyTables:
        with zipfile.ZipFile(self.folder / f"{part}{_SUFFIX}") as archive:
            return StudyTables(*(pl.read_parquet(archive.read(f"{name}.parquet")) for name in StudyTables._fields))

    def bring_together(self) -> None:
        """Make one part of the small ones, where these are many."""
        small = sorted(name for name, size in self._sizes.items() if size < _SMALL)
        if len(small) < _MANY:
            return
        runs: list[tuple[str, Run, dict[str, str]]] = []
        frames: list[StudyTables] = []
        chosen = set(small)
        own = {one: stored for one, stored in self.stored.items() if stored.part in chosen}
        for part in small:
            places = {stored.place: len(runs) + i for i, stored in enumerate(s for s in own.values() if s.part == part)}
            runs += [(one, stored.run, stored.code) for one, stored in own.items() if stored.part == part]
            moved = pl.DataFrame({_OF: list(places), "now": list(places.values())}, {_OF: pl.UInt32, "now": pl.UInt32})
            frames.append(
                StudyTables(
                    *(
                        frame.join(moved, on=_OF, maintain_order="left").drop(_OF).rename({"now": _OF})
                        for frame in self._tables(part)
                    )
                )
            )
        for identity in own:
            del self.stored[identity]
        self._write(runs, StudyTables(*(pl.concat(each) for each in zip(*frames, strict=True))))
        for part in small:  # now that all of it stands elsewhere, too
            del self._sizes[part]
            (self.folder / f"{part}{_SUFFIX}").unlink(missing_ok=True)

    def delete(self) -> None:
        """Delete all parts."""
        for path in self.folder.glob(f"*{_SUFFIX}"):
            path.unlink(missing_ok=True)
        self.stored.clear()
        self._sizes.clear()


def _marked(frame: pl.DataFrame, place: int) -> pl.DataFrame:
    return frame.select(pl.lit(place, dtype=pl.UInt32).alias(_OF), pl.all())


def _put(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    archive.writestr(zipfile.ZipInfo(name), content)  # with a fixed date: the same content has the same digest


def parquet(frame: pl.DataFrame) -> bytes:
    """Return a table as the bytes of a Parquet file."""
    buffer = io.BytesIO()
    frame.write_parquet(buffer, statistics=False)
    return buffer.getvalue()


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
