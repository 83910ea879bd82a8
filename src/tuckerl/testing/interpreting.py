"""Kernels as plain Python, whatever they call."""

from collections.abc import Callable
from types import CellType, FunctionType
from typing import Any

from tuckerl._jit import ByKind, call_interpreted, call_python, is_rare


def interpreted(compiled: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel as plain Python, in which all kernels that it calls are interpreted, too.

    Nothing that was compiled changes: these are copies of the functions, with other names around them.
    """
    python: Callable[..., Any] = _interpreted(compiled, {})
    return python


def _interpreted(compiled: Any, known: dict[Any, Any]) -> Any:
    """Return what stands for a global name or a closure's variable in plain Python."""
    if compiled is call_python:
        return call_interpreted
    if compiled is is_rare:
        return bool
    if isinstance(compiled, ByKind):
        return ByKind({kind: _interpreted(one, known) for kind, one in compiled.kernels.items()})
    python = getattr(compiled, "py_func", compiled)
    if python is compiled:
        return compiled
    if python not in known:
        cells = tuple(CellType() for _ in python.__closure__ or ())
        names = dict(python.__globals__)
        known[python] = FunctionType(python.__code__, names, python.__name__, python.__defaults__, cells)
        for name in python.__code__.co_names:
            if name in names:
                names[name] = _interpreted(names[name], known)
        for cell, own in zip(cells, python.__closure__ or (), strict=True):
            cell.cell_contents = _interpreted(own.cell_contents, known)
    return known[python]
