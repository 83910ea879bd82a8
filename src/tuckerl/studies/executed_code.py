"""What code decides a run: the modules that it executes, by digest, and the versions of the libraries beneath.

A module decides nothing if the run never comes to it, so an edit of another learner, of a report or of a command leaves
finished runs as they are. Which modules a run comes to is read from their imports, those inside functions included;
registers, which name all that there is, are not followed. BLAS has other kernels for other processors, which round in
another way, so these count as its version.
"""

import hashlib
import json
import platform
import re
import sys
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_info

from tuckerl._version import __version__

_PACKAGE = "tuckerl"
_REGISTERS = {_PACKAGE, "tuckerl.learners", "tuckerl.training.policies", "tuckerl.studies.scenarios"}
_FROM = re.compile(r"^ *from (tuckerl[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
_PLAIN = re.compile(r"^ *import (tuckerl[\w.]*)", re.MULTILINE)
_LATE = re.compile(r'"(tuckerl[\w.]*):\w+"')
_NAME = re.compile(r"\w+")
BLAS = "BLAS"
_LIBRARIES = ("numpy", "scipy", "numba", "gymnasium", "pettingzoo")


def executed_code(roots: Iterable[str]) -> dict[str, str]:
    """Return the digests of the modules that `roots` come to, these included, and the versions beneath, by name.

    Parameters
    ----------
    roots : names of modules
        Of the package's own, those that they import are followed; of a user's own, the file alone counts.
    """
    return {_name(module): _digest(module) for module in _reached(frozenset(roots))} | _versions()


@cache  # of a study's thousand variants, most come to the same modules
def _reached(roots: frozenset[str]) -> tuple[str, ...]:
    """Return the modules that `roots` come to, these included, in order."""
    found: set[str] = set()
    waiting = sorted(roots)
    while waiting:
        module = waiting.pop()
        if module in found or _source(module) is None:
            continue
        found.add(module)
        if module not in _REGISTERS and module.split(".")[0] == _PACKAGE:
            waiting += _imported(module)
    return tuple(sorted(found - _REGISTERS))


def _name(module: str) -> str:
    """Return a module's name; of a user's own the file's, as the program that is started is always "__main__"."""
    source = _source(module)
    return module if source is None or module.split(".")[0] == _PACKAGE else source.name


@cache
def _versions() -> dict[str, str]:
    own = {_PACKAGE: __version__, "python": platform.python_version(), "machine": platform.machine(), BLAS: _blas()}
    return own | {name: version(name) for name in _LIBRARIES}


def _blas() -> str:
    """Return which kernels BLAS and LAPACK have chosen for this processor: others round in another way."""
    import scipy.linalg  # noqa: F401  # its own must be loaded, too, before it is asked for

    found = {
        f"{one['internal_api']} for {one.get('architecture')}" for one in threadpool_info() if one["user_api"] == "blas"
    }
    return ", ".join(sorted(found))


def completed(code: dict[str, str]) -> dict[str, str]:
    """Return code with what older versions of tuckerl did not note, which is taken to be as it is here."""
    return {BLAS: _versions()[BLAS]} | code


@cache
def _source(module: str) -> Path | None:
    """Return a module's file; None for what is no module, or has none."""
    loaded = sys.modules.get(module)
    path = getattr(loaded, "__file__", None)
    if loaded is None:
        try:
            spec = find_spec(module)
        except (ImportError, ValueError):
            return None
        path = None if spec is None else spec.origin
    return Path(path) if path is not None and path.endswith(".py") else None


@cache
def _digest(module: str) -> str:
    source = _source(module)
    return "" if source is None else hashlib.sha256(source.read_bytes()).hexdigest()[:16]


@cache
def _imported(module: str) -> set[str]:
    """Return what of the package a module may import, and what it names as ``"module:name"`` to be imported late."""
    source = _source(module)
    text = "" if source is None else source.read_text("utf-8")
    names = set(_PLAIN.findall(text)) | set(_LATE.findall(text))
    for home, imported in _FROM.findall(text):
        names |= {home, *(f"{home}.{name}" for name in _NAME.findall(imported))}
    return names


def code_digest(code: dict[str, str]) -> str:
    """Return what tells this code from any other, 16 hexadecimal digits."""
    return hashlib.sha256(json.dumps(code, sort_keys=True).encode()).hexdigest()[:16]


def changes(there: dict[str, Any], here: dict[str, Any], now: str = "now") -> list[str]:
    """Return in words what differs between other code, as of finished runs, and that of now, versions first."""
    there = completed(there)
    versions = [
        f"{name} {there[name]} there and {here[name]} {now}" for name in _versions() if there.get(name) != here[name]
    ]
    modules = sorted(name for name in {*there, *here} - set(_versions()) if there.get(name) != here.get(name))
    if modules:
        more = f" and {len(modules) - 3} more" if len(modules) > 3 else ""
        versions.append(f"changed code of {', '.join(modules[:3])}{more}")
    return versions
