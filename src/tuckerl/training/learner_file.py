"""The file of a saved learner: a header of JSON and NumPy arrays, never pickled objects.

Line 1 names the format and its version, line 2 is the SHA-256 of line 1 and of all that follows line 2: an ``.npz``
archive whose member ``manifest.json`` holds the header, and of every array its type, its shape and, of whole numbers,
the least and the largest. A file of a newer version is refused, and so is one that is cut short or damaged.

A right checksum says nothing about who wrote a file. So nothing is unpacked before its size is known to be what the
reader expects (`SavedArrays`), and no more than was declared. Formats 1 and 2 are read by the same rules: see
`old_formats`.
"""

import hashlib
import io
import json
import math
import stat
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, NotRequired, TypedDict

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import SavedFileError, SavedFileMissingError, TuckerlError
from tuckerl.files import write_whole
from tuckerl.memory import Part, check_memory
from tuckerl.saved_arrays import SavedArrays, StoredArray
from tuckerl.saved_json import MOST_TEXT, checked_json, parse_json

FORMAT_VERSION = 3
_MAGIC = b"tuckerl learner, format "
_MANIFEST = "manifest.json"
_OLD_HEADER = "header.npy"
_CHUNK = 2**20

Header = dict[str, Any]
Arrays = dict[str, np.ndarray]


class Content(NamedTuple):
    """What a file holds; its arrays are not read yet."""

    header: Header
    arrays: SavedArrays
    version: int


class _Form(TypedDict):
    """What the manifest says of an array."""

    dtype: Any
    shape: list[int]
    bounds: NotRequired[list[int]]


class _Manifest(TypedDict):
    header: dict[str, Any]
    arrays: dict[str, Any]


def write(path: Path, header: Header, arrays: Mapping[str, np.ndarray]) -> None:
    """Write a header and arrays to `path`, whole or not at all.

    Raises
    ------
    SavedFileError
        If the header is too long to be read again.
    OutputError
        If it cannot be written.
    """
    forms = {name: _form_of(array) for name, array in arrays.items()}
    text = json.dumps({"header": header, "arrays": forms}, sort_keys=True, allow_nan=False).encode()
    if len(text) > MOST_TEXT:
        raise SavedFileError(
            f"a file holds at most {MOST_TEXT:,} bytes of text beside its arrays; this learner has {len(text):,}: "
            "shorten the names of its actions, or give large parameters as arrays"
        )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(_MANIFEST), text, zipfile.ZIP_DEFLATED)  # without the time of day
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asarray(array, order="C"), (1, 0), allow_pickle=False)
    first, body = _MAGIC + str(FORMAT_VERSION).encode() + b"\n", buffer.getvalue()
    digest = hashlib.sha256(first)
    digest.update(body)
    write_whole(path, first + digest.hexdigest().encode() + b"\n" + body)


def read(path: Path) -> Content:
    """Return the header and the arrays of a file that `write` wrote, or did in an earlier version.

    Raises
    ------
    SavedFileError
        If the file cannot be read, is of another kind, of a newer version, truncated or damaged.
    SavedFileMissingError
        If there is none.
    """
    content = _bytes_of(path)
    if not content.startswith(_MAGIC):
        raise SavedFileError(f"{path} is not a saved learner: expected a file that a learner's save() wrote")
    first, _, rest = content.partition(b"\n")
    digest, _, body = rest.partition(b"\n")
    version = _version_of(first[len(_MAGIC) :])
    if version is not None and version > FORMAT_VERSION:
        raise SavedFileError(
            f"{path} has format {version}, and this version of tuckerl reads up to format {FORMAT_VERSION}: "
            "update tuckerl"
        )
    signed = hashlib.sha256(b"" if version in (1, 2) else first + b"\n")
    signed.update(body)
    if version is None or signed.hexdigest().encode() != digest:
        raise SavedFileError(f"{path} is truncated or damaged (its checksum differs): save it again")
    with reading(path):
        header, arrays = _unpacked(body) if version == FORMAT_VERSION else _unpacked_old(body)
    return Content(header, arrays, version)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever is found wrong with a file's content into one error that names the file.

    Raises
    ------
    SavedFileError
        If anything is raised.
    """
    try:
        yield
    except Exception as error:  # whatever a stranger's file leads to, in NumPy, zipfile, or a constructor
        if isinstance(error, SavedFileError) and str(path) in str(error):
            raise
        reason = str(error) if isinstance(error, TuckerlError) else f"{type(error).__name__}: {error}"
        short = reason if len(reason) <= _LONGEST else f"{reason[:_LONGEST]}..."
        raise SavedFileError(f"{path} holds no sound learner: {short}") from error


_LONGEST = 400


def _bytes_of(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            if not stat.S_ISREG(path.stat().st_mode):
                raise SavedFileError(f"{path} is no file: name one that a learner's save() wrote")
            return file.read()
    except FileNotFoundError as error:
        raise SavedFileMissingError(f"there is no file {path}: name one that a learner's save() wrote") from error
    except (OSError, MemoryError) as error:
        reason = getattr(error, "strerror", None) or "it is larger than the memory that is free"
        raise SavedFileError(f"{path} cannot be read ({reason}): name one that a learner's save() wrote") from error


_DIGITS = 9


def _version_of(text: bytes) -> int | None:
    """Return the version that line 1 names; None where it names none in the way that `write` does."""
    return int(text) if text.isdigit() and len(text) <= _DIGITS and not text.startswith(b"0") else None


def _form_of(array: np.ndarray) -> Header:
    form: Header = {"dtype": np.lib.format.dtype_to_descr(array.dtype), "shape": list(array.shape)}
    if array.dtype.kind in "iu" and array.size:
        form["bounds"] = [int(array.min()), int(array.max())]
    return form


def _unpacked(body: bytes) -> tuple[Header, SavedArrays]:
    archive, members = _members(body)
    if _MANIFEST not in members:
        raise SavedFileError("it lacks its manifest")
    info = _of_text(members.pop(_MANIFEST))
    with archive.open(info) as member:  # read(n) unpacks no more than n bytes, read() all that there is
        manifest = checked_json(parse_json(member.read(info.file_size)), _Manifest, "the manifest")
    stored = _stored_arrays(archive, members)
    if stored.keys() != manifest["arrays"].keys():
        other = min(stored.keys() ^ manifest["arrays"].keys())
        raise SavedFileError(f"its manifest and its arrays differ: {shown(other)} is in one of them only")
    return manifest["header"], SavedArrays(
        {name: _as_declared(name, array, manifest["arrays"][name]) for name, array in stored.items()}
    )


def _unpacked_old(body: bytes) -> tuple[Header, SavedArrays]:
    archive, members = _members(body)
    if _OLD_HEADER not in members:
        raise SavedFileError("it lacks its header")
    text = _stored_array(archive, _of_text(members.pop(_OLD_HEADER)))
    if text.dtype != np.uint8 or len(text.shape) != 1:
        raise SavedFileError("its header is no text")
    header = checked_json(parse_json(text.read().tobytes()), dict[str, Any], "the header")
    return header, SavedArrays(_stored_arrays(archive, members))


def _members(body: bytes) -> tuple[zipfile.ZipFile, dict[str, zipfile.ZipInfo]]:
    """Return an archive and its members by name, which are not larger together than the memory that is free."""
    archive = zipfile.ZipFile(io.BytesIO(body))
    members: dict[str, zipfile.ZipInfo] = {}
    for info in archive.infolist():
        if info.filename in members:
            raise SavedFileError(f"its member {shown(info.filename)} is there twice")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or info.flag_bits & 1:
            raise SavedFileError(f"its member {shown(info.filename)} is packed in another way than save() does")
        members[info.filename] = info
    size = sum(info.file_size for info in members.values())
    check_memory("it", [Part("its arrays", size, "load it where more is free, if you trust it")])
    return archive, members


def _of_text(info: zipfile.ZipInfo) -> zipfile.ZipInfo:
    if info.file_size > MOST_TEXT:
        raise SavedFileError(f"its text must have at most {MOST_TEXT:,} bytes; it has {info.file_size:,}")
    return info


def _stored_arrays(archive: zipfile.ZipFile, members: Mapping[str, zipfile.ZipInfo]) -> dict[str, StoredArray]:
    other = [name for name in members if not name.endswith(".npy")]
    if other:
        raise SavedFileError(f"its member {shown(other[0])} is no array")
    return {name.removesuffix(".npy"): _stored_array(archive, info) for name, info in members.items()}


def _stored_array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredArray:
    """Return an array of which only the description was read."""
    with archive.open(info) as member:
        if np.lib.format.read_magic(member) != (1, 0):
            raise SavedFileError(f"its member {shown(info.filename)} is no array of NumPy's format 1.0")
        shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(member)
        start = member.tell()
    sizes = all(type(size) is int and size >= 0 for size in shape)
    if dtype.hasobject or dtype.itemsize == 0 or not sizes:
        raise SavedFileError(f"its member {shown(info.filename)} is no array of numbers")
    if info.file_size != start + math.prod(shape) * dtype.itemsize:
        raise SavedFileError(f"its member {shown(info.filename)} has another size than its shape says")

    def unpack() -> np.ndarray:
        array = np.empty(shape, dtype, order="F" if is_fortran else "C")
        content = memoryview(array.reshape(-1, order="A").view(np.uint8).data)
        with archive.open(info) as member:
            member.read(start)
            for place in range(0, len(content), _CHUNK):
                part = content[place : place + _CHUNK]
                part[:] = member.read(len(part))
            member.read(1)  # at the end, zipfile compares its own checksum
        _check_booleans(info.filename, array)
        return array

    return StoredArray(dtype, tuple(shape), unpack)


def _check_booleans(name: str, array: np.ndarray) -> None:
    """Refuse bytes that are neither False nor True: compiled code takes a boolean for 0 or 1."""
    for field in array.dtype.names or ():
        _check_booleans(name, array[field])
    if array.dtype.kind == "b" and array.size and array.view(np.uint8).max() > 1:
        raise SavedFileError(f"its member {shown(name)} must hold booleans")


def _as_declared(name: str, array: StoredArray, declared: Any) -> StoredArray:
    """Return an array that is refused when it is read and is not what the manifest says."""
    form = checked_json(declared, _Form, f"what the manifest says of {shown(name)}")
    descr = json.loads(json.dumps(np.lib.format.dtype_to_descr(array.dtype)))
    if (descr, list(array.shape)) != (form["dtype"], form["shape"]):
        raise SavedFileError(f"its manifest and the array {shown(name)} differ")

    def read() -> np.ndarray:
        held = array.read()
        if _form_of(held).get("bounds") != form.get("bounds"):
            raise SavedFileError(f"its manifest has other bounds than the array {shown(name)}")
        return held

    return StoredArray(array.dtype, array.shape, read)
