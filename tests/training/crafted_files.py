"""Files of learners as a stranger would craft them: anything altered, and the checksum right."""

import hashlib
import io
import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tuckerl.training import learner_file


class Parts(NamedTuple):
    """A file taken apart."""

    version: int
    header: dict[str, Any]
    arrays: dict[str, np.ndarray]


def take_apart(content: bytes) -> Parts:
    """Return what a file holds, of whatever version."""
    first, _, body = content.split(b"\n", 2)
    version = int(first.rpartition(b" ")[2])
    with np.load(io.BytesIO(body), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    if version < 3:
        return Parts(version, json.loads(arrays.pop("header").tobytes()), arrays)
    return Parts(version, json.loads(arrays.pop("manifest.json"))["header"], arrays)


def sign(version: int, body: bytes) -> bytes:
    """Return the file of a body, its checksum right."""
    first = b"tuckerl learner, format %d\n" % version
    return first + hashlib.sha256(body if version < 3 else first + body).hexdigest().encode() + b"\n" + body


def put_together(parts: Parts, header_text: str | None = None, forms: Mapping[str, Any] | None = None) -> bytes:
    """Return the file of such parts; `header_text` and `forms` take the place of what would be written of them."""
    text = json.dumps(parts.header) if header_text is None else header_text
    members = {f"{name}.npy": npy(array) for name, array in parts.arrays.items()}
    if parts.version < 3:
        members["header.npy"] = npy(np.frombuffer(text.encode(), dtype=np.uint8))
    else:
        written = forms if forms is not None else manifest_of(parts.arrays)
        members["manifest.json"] = f'{{"header": {text}, "arrays": {json.dumps(written)}}}'.encode()
    return sign(parts.version, archive_of(members))


def manifest_of(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return what a manifest says of arrays."""
    return {name: learner_file._form_of(array) for name, array in arrays.items()}


def npy(array: np.ndarray) -> bytes:
    """Return an array as NumPy writes it."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, (1, 0), allow_pickle=False)
    return buffer.getvalue()


def archive_of(members: Mapping[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a zip archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content, method)  # without the time of day
    return buffer.getvalue()


def huge_zeros(shape: tuple[int, ...], dtype: str) -> bytes:
    """Return the start of an array of NumPy's of which the zeros that follow are left out."""
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    padded = header + b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded


def rewrite(path: Path, parts: Parts) -> None:
    """Write such parts to a file, its checksum right."""
    path.write_bytes(put_together(parts))
