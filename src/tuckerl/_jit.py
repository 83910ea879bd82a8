"""The one door to Numba: how kernels are compiled, and where compiled code is kept.

Kernels release the GIL, keep the order of floating-point operations (no ``fastmath``: the slow twins in the tests
must agree to the last bits) and are cached on disk. Numba's cache notices a change in a kernel's own file but not in
the kernels that it calls, so the cache folder's name carries a hash of all the package's sources: an edit anywhere
starts a fresh folder.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import types as numba_types
from numba.core import config as numba_config
from numba.extending import overload

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
# Without reference counting (_nrt), which takes most of the time where arrays are passed on in NamedTuples.
_OPTIONS: dict[str, Any] = {
    "cache": _CACHE_FOLDER is not None,
    "nogil": True,
    "_nrt": False,
    "error_model": "numpy",
    "forceinline": True,
}


@contextmanager
def _our_cache_folder() -> Iterator[None]:
    # Numba reads the folder when caching is switched on; other packages' kernels must not move with ours.
    config: Any = numba_config
    before = config.CACHE_DIR
    config.CACHE_DIR = _CACHE_FOLDER or before
    try:
        yield
    finally:
        config.CACHE_DIR = before


def kernel(function: _Function) -> _Function:
    """Compile `function` on its first call for each kind of arguments."""
    with _our_cache_folder():
        compiled: _Function = numba.njit(**_OPTIONS)(function)
    return compiled


def by_kind(kernels: dict[type, Callable[..., Any]]) -> Callable[..., Any]:
    """Return a function for kernels to call: the kernel that `kernels` has for the kind of its first argument.

    The choice is made when the caller is compiled, so one body serves all kinds and pays nothing for it.
    """

    def chosen(world: Any, *others: Any) -> Any:
        return kernels[type(world)](world, *others)

    def choose(world: Any, *others: Any) -> Callable[..., Any]:
        compiled = kernels[world.instance_class]

        def call(world: Any, *others: Any) -> Any:
            return compiled(world, *others)

        return call

    overload(chosen, jit_options={"forceinline": True})(choose)
    return chosen


types: Any = numba_types
_ARRAY = types.float64[::1]
_STREAM = types.uint64[::1]
_SIGNATURES = {
    "reset": types.void(_ARRAY, _ARRAY, _STREAM),
    "step": types.Tuple((types.float64, types.boolean))(_ARRAY, _ARRAY, types.int64, _STREAM),
    "index": types.int64(_ARRAY, _ARRAY),
}


def compiled_function(function: Callable[..., object], role: str) -> Any:
    """Compile one of a simulator's functions to the fixed signature of its role.

    Kernels take it as data: they are not compiled again for every simulator.
    """
    ours = (function.__module__ or "").startswith("tuckerl.")  # others' sources are not in our folder's hash
    with _our_cache_folder():
        return numba.cfunc(_SIGNATURES[role], cache=ours and _CACHE_FOLDER is not None)(function)
