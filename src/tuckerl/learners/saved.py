"""The file of a saved learner: a header of JSON and NumPy arrays, never pickled objects.

Line 1 names the format and its version, line 2 is the SHA-256 of all that follows: an ``.npz`` archive whose member
``header`` is the JSON text. A file of a newer version is refused, and so is one that is cut short or damaged.
"""

import hashlib
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import SavedFileError
from tuckerl.files import write_whole

FORMAT_VERSION = 1
_MAGIC = b"tuckerl learner, format "

Arrays = dict[str, np.ndarray]


def write_saved(path: Path, header: dict[str, Any], arrays: Arrays) -> None:
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


def read_saved(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Return the header and the arrays of a file that `write_saved` wrote.

    Raises
    ------
    SavedFileError
        If the file is of another kind, of a newer version, truncated or damaged.
    """
    content = path.read_bytes()
    if not content.startswith(_MAGIC):
        raise SavedFileError(f"{path} is not a saved learner: expected a file that a learner's save() wrote")
    first, _, rest = content.partition(b"\n")
    digest, _, body = rest.partition(b"\n")
    version = first[len(_MAGIC) :]
    if not version.isdigit() or int(version) > FORMAT_VERSION:
        raise SavedFileError(
            f"{path} has format {version.decode(errors='replace')}, and this version of tuckerl reads up to "
            f"{FORMAT_VERSION}: update tuckerl"
        )
    if hashlib.sha256(body).hexdigest().encode() != digest:
        raise SavedFileError(f"{path} is truncated or damaged (its checksum differs): save it again")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return json.loads(arrays.pop("header").tobytes()), arrays
    except (ValueError, KeyError, OSError, zipfile.BadZipFile) as error:
        raise SavedFileError(f"{path} holds no readable learner ({error}): save it again") from error
