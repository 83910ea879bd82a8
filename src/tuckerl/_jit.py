"""The one door to Numba: how kernels are compiled, and where compiled code is kept.

Kernels release the GIL, keep the order of floating-point operations (no ``fastmath``: the slow twins in the tests
must agree to the last bits) and are cached on disk. Numba's cache notices a change in a kernel's own file but not in
the kernels that it calls, so the cache folder's name carries a hash of all the package's sources: an edit anywhere
starts a fresh folder.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numba
from numba.core import config

_Function = TypeVar("_Function", bound=Callable[..., object])


def _source_hash(package: Path) -> str:
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0")
        digest.update(source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _cache_folder() -> str | None:
    """Return a writable folder for compiled kernels: Numba's own setting first, then beside the sources."""
    package = Path(__file__).parent
    name = f"kernels-{_source_hash(package)}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    for folder in [Path(chosen)] if chosen else [package / "__pycache__", home / "tuckerl"]:
        try:
            (folder / name).mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder / name):
                return str(folder / name)
        except OSError:
            continue
    return None


_CACHE_FOLDER = _cache_folder()


def kernel(function: _Function) -> _Function:
    """Compile `function` on its first call for each kind of arguments."""
    # Numba reads the folder when caching is switched on; other packages' kernels must not move with ours.
    before = config.CACHE_DIR
    config.CACHE_DIR = _CACHE_FOLDER or before
    try:
        compiled: _Function = numba.njit(
            cache=_CACHE_FOLDER is not None, nogil=True, _nrt=False, error_model="numpy", forceinline=True
        )(function)
    finally:
        config.CACHE_DIR = before
    return compiled
