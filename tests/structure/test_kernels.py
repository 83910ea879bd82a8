"""Every kernel says what its arrays are: their shape, and what they mean."""

import ast
import re
from pathlib import Path

import pytest

import tuckerl

PACKAGE = Path(tuckerl.__file__).parent
FOLDERS = ("problems", "adapters", "environments")
ARRAYS = {"FloatArray", "IntArray", "BoolArray", "StateArray", "Stream"}


def kernels() -> list[tuple[str, ast.FunctionDef]]:
    """Return the kernels of these folders, and the functions of simulators, which are compiled, too."""
    found = []
    for source in sorted(path for folder in FOLDERS for path in (PACKAGE / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(source.read_text())):
            if not isinstance(node, ast.FunctionDef):
                continue
            is_kernel = any(isinstance(d, ast.Name) and d.id in {"kernel", "routine"} for d in node.decorator_list)
            is_simulators = source.stem == "cart_pole" and node.args.args[:1] and node.args.args[0].arg == "parameters"
            if is_kernel or is_simulators:
                found.append((source.relative_to(PACKAGE).as_posix(), node))
    return found


@pytest.mark.parametrize(("source", "kernel"), kernels(), ids=lambda part: getattr(part, "name", part))
def test_kernels_document_their_arrays(source: str, kernel: ast.FunctionDef) -> None:
    documented = ast.get_docstring(kernel) or ""
    assert documented, f"{kernel.name} in {source} has no docstring"
    for argument in kernel.args.args:
        if isinstance(argument.annotation, ast.Name) and argument.annotation.id in ARRAYS:
            shape = rf"^{argument.arg} : \(.*\) (float64|int64|uint32|uint64|bool)"
            assert re.search(shape, documented, re.MULTILINE), f"{kernel.name} in {source}: {argument.arg}"


def test_there_are_kernels_to_look_at() -> None:
    assert len(kernels()) > 15
