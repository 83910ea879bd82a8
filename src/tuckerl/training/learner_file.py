"""The file of a saved learner: a header of JSON and NumPy arrays, never pickled objects.

Line 1 names the format and its version, line 2 is the SHA-256 of all that follows: an ``.npz`` archive whose member
``header`` is the JSON text. A file of a newer version is refused, and so is one that is cut short or damaged.
Format 1 knew no environments that Python steps, no masks and no schedules; it is read as ever.
"""

import hashlib
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import SavedFileError, SavedFileMissingError
from tuckerl.files import write_whole

FORMAT_VERSION = 2
_MAGIC = b"tuckerl learner, format "

Header = dict[str, Any]
Arrays = dict[str, np.ndarray]


def write(path: Path, header: Header, arrays: Arrays) -> None:
    """Write a header and arrays to `path`, whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    text = np.frombuffer(json.dumps(header, sort_keys=True).encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, header=text, **arrays)  # type: ignore[arg-type]  # its stub takes allow_pickle by name
    body = buffer.getvalue()
    digest = hashlib.sha256(body).hexdigest().encode()
    write_whole(path, _MAGIC + str(FORMAT_VERSION).encode() + b"\n" + digest + b"\n" + body)


def read(path: Path) -> tuple[Header, Arrays]:
    """Return the header and the arrays of a file that `write` wrote.

    Raises
    ------
    SavedFileError
        If the file cannot be read, is of another kind, of a newer version, truncated or damaged.
    SavedFileMissingError
        If there is none.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise SavedFileMissingError(f"there is no file {path}: name one that a learner's save() wrote") from error
    except OSError as error:
        raise SavedFileError(
            f"{path} cannot be read ({error.strerror}): name one that a learner's save() wrote"
        ) from error
    if not content.startswith(_MAGIC):
        raise SavedFileError(f"{path} is not a saved learner: expected a file that a learner's save() wrote")
    first, _, rest = content.partition(b"\n")
    digest, _, body = rest.partition(b"\n")
    version = first[len(_MAGIC) :]
    if version.isdigit() and int(version) > FORMAT_VERSION:
        raise SavedFileError(
            f"{path} has format {int(version)}, and this version of tuckerl reads up to format {FORMAT_VERSION}: "
            "update tuckerl"
        )
    if not version.isdigit() or hashlib.sha256(body).hexdigest().encode() != digest:
        raise SavedFileError(f"{path} is truncated or damaged (its checksum differs): save it again")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return json.loads(arrays.pop("header").tobytes()), arrays
    except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise SavedFileError(f"{path} holds no readable learner ({error}): save it again") from error


def with_prefix(prefix: str, arrays: Arrays) -> Arrays:
    """Return `arrays` under the names ``prefix.name``."""
    return {f"{prefix}.{name}": array for name, array in arrays.items()}


def of_prefix(prefix: str, arrays: Arrays) -> Arrays:
    """Return those of the `arrays` that `with_prefix` named, under their own names."""
    start = f"{prefix}."
    return {name.removeprefix(start): array for name, array in arrays.items() if name.startswith(start)}
