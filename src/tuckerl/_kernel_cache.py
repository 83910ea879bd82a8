"""Where compiled kernels are kept on disk, so that the next process need not compile them again.

Numba's cache notices a change in a kernel's own file but not in the kernels that it calls, so the cache folder's name
carries a hash of the sources of all layers that have kernels: an edit in any of them starts a fresh folder. What others
wrote is in no hash of ours: their kernels, and ours as compiled for their algorithms, are kept in memory only.

Nothing depends on what is kept: where it cannot be written or read, kernels are compiled, and one warning says so.
"""

import functools
import hashlib
import os
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core import config as numba_config
from numba.core.caching import FunctionCache, NullCache

from tuckerl.errors import KernelCacheWarning, warn

_WITHOUT_KERNELS = ("testing", "studies", "reports", "cli")  # the layers above
_FunctionCache: Any = FunctionCache
_NullCache: Any = NullCache
_lock = threading.RLock()


def kept_code(function: Callable[..., Any]) -> Any:
    """Return Numba's cache for a function of this package; one that keeps nothing where no folder can be written."""
    folder = cache_folder()
    config: Any = numba_config
    if folder is None:
        _warn_once("no folder for them can be written")
        return _NullCache()
    # Numba reads the folder where a cache is made; other packages' kernels must not move with ours.
    with _lock:  # or one thread would take the other's folder for what was there before
        before, config.CACHE_DIR = config.CACHE_DIR, folder
        try:
            return _KernelCache(function)
        except RuntimeError:  # the folder was there when it was looked for
            _warn_once(f"{folder} cannot be written")
            return _NullCache()
        finally:
            config.CACHE_DIR = before


@functools.cache
def cache_folder() -> str | None:
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


def _source_hash(package: Path) -> str:
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        if source.relative_to(package).parts[0] in _WITHOUT_KERNELS:
            continue
        digest.update(source.relative_to(package).as_posix().encode() + b"\0")
        digest.update(source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def is_ours(thing: Any) -> bool:
    """Return whether a function, a kernel or a class was written in this package."""
    return (thing.__module__ or "").startswith("tuckerl.")


def _has_foreign_part(kind: Any) -> bool:
    """Return whether a NamedTuple of somebody else's is in what Numba calls a type."""
    own = getattr(kind, "instance_class", None)
    return (own is not None and not is_ours(own)) or any(map(_has_foreign_part, getattr(kind, "types", ())))


def _types_of(sig: Any) -> tuple[Any, ...]:
    return tuple(getattr(sig, "args", sig))  # a signature, or the types of the arguments


class _KernelCache(_FunctionCache):  # type: ignore[misc]  # Numba has no types
    """A cache on disk that keeps no code compiled for an algorithm that was written elsewhere.

    Its kernels are compiled into our loops, so an edit would go unnoticed; and the cache's own index names the
    algorithm's class, so that every later process would ask for the module that it is in.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for these types; None where nothing is kept, or what is kept is of no use."""
        if any(map(_has_foreign_part, _types_of(sig))):
            return None
        try:
            kept = super().load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001  # a damaged file raises anything
            _warn_once(f"what is kept in {self.cache_path} cannot be read: {error!r}")
            with suppress(OSError):
                self.flush()
            return None
        # Two processes that write at once may give their code the same name: each finds the other's.
        return kept if kept is not None and _types_of(kept.signature) == _types_of(sig) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for these types."""
        if any(map(_has_foreign_part, _types_of(sig))):
            return
        try:
            super().save_overload(sig, data)
        except Exception as error:  # noqa: BLE001  # the index is read again, and may be damaged
            _warn_once(f"{self.cache_path} cannot be written: {getattr(error, 'strerror', None) or repr(error)}")


_warned: list[str] = []


def _warn_once(reason: str) -> None:
    if not _warned:
        _warned.append(reason)
        warn(
            f"compiled kernels are not kept, as {reason}; every process takes some seconds to compile them: make room, "
            "or set NUMBA_CACHE_DIR to a folder that can be written",
            KernelCacheWarning,
        )
