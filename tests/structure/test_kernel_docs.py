"""Kernels say the shapes of their arrays: each array argument in the docstring, each field in a comment."""

import ast
import re
from pathlib import Path
from typing import NamedTuple

import pytest

import tuckerl

pytestmark = pytest.mark.slow

PACKAGE = Path(tuckerl.__file__).parent
LATER = {"problems", "adapters", "environments", "spaces"}
"""Folders whose kernels are documented elsewhere, to be included later."""

ARRAYS = {"FloatArray", "IntArray", "BoolArray", "StateArray", "UInt64Array", "Stream", "NDArray"}
SHAPE = r"\((?:[A-Z]|\d|_N_|E \*)[^()]*\)"  # (S, A), (4,), (E * S, A)


class Kernel(NamedTuple):
    """A kernel as its file has it."""

    source: str
    node: ast.FunctionDef


def trees() -> list[tuple[str, ast.Module]]:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE)
        if place.parts[0] not in LATER:
            found.append((place.as_posix(), ast.parse(path.read_text())))
    return found


def is_kernel(node: ast.AST) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    return any(isinstance(mark, ast.Name) and mark.id in {"kernel", "routine"} for mark in node.decorator_list)


def kernels() -> list[Kernel]:
    return [
        Kernel(source, node)
        for source, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and is_kernel(node)
    ]


def type_names(annotation: ast.expr | None) -> set[str]:
    """Return the names in an annotation: NDArray of NDArray[np.void], for example."""
    if annotation is None:
        return set()
    return {node.id for node in ast.walk(annotation) if isinstance(node, ast.Name)}


def undocumented_arguments(node: ast.FunctionDef) -> list[str]:
    """Return the array arguments whose names no shape follows in the docstring."""
    documentation = ast.get_docstring(node) or ""
    arguments = [argument for argument in node.args.args if type_names(argument.annotation) & ARRAYS]
    return [one.arg for one in arguments if not re.search(rf"\b{one.arg}\b[^.;]*?{SHAPE}", documentation)]


def named_tuples() -> dict[str, tuple[str, ast.ClassDef]]:
    """Return the NamedTuples of the package by name, with the file of each."""
    return {
        node.name: (source, node)
        for source, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and any(isinstance(b, ast.Name) and b.id == "NamedTuple" for b in node.bases)
    }


def read_by_kernels() -> list[str]:
    """Return the NamedTuples that kernels get, and those that stand in their fields."""
    known, found = named_tuples(), set()
    waiting = {name for _, node in kernels() for one in node.args.args for name in type_names(one.annotation)}
    while waiting:
        name = waiting.pop()
        if name in known and name not in found:
            found.add(name)
            fields = [field for field in known[name][1].body if isinstance(field, ast.AnnAssign)]
            waiting |= {inner for field in fields for inner in type_names(field.annotation)}
    return sorted(found)


@pytest.mark.parametrize("kernel", kernels(), ids=lambda kernel: f"{kernel.source}:{kernel.node.name}")
def test_a_kernel_says_the_shape_of_each_array(kernel: Kernel) -> None:
    assert not undocumented_arguments(kernel.node)


@pytest.mark.parametrize("name", read_by_kernels())
def test_what_a_kernel_reads_says_the_shape_of_each_field(name: str) -> None:
    source, node = named_tuples()[name]
    lines = (PACKAGE / source).read_text().splitlines()
    fields = [field for field in node.body if isinstance(field, ast.AnnAssign)]
    arrays = [field for field in fields if type_names(field.annotation) & ARRAYS]
    silent = [ast.unparse(field.target) for field in arrays if not re.search(rf"#.*{SHAPE}", lines[field.lineno - 1])]
    assert not silent


def test_kernels_and_what_they_read_are_found() -> None:
    assert len(kernels()) > 60
    assert {"AgentArrays", "Transition", "EpisodeRecord", "ChangeLog", "Traces", "DynaHState"} <= set(read_by_kernels())


@pytest.mark.parametrize(
    ("documentation", "silent"),
    [
        ("", ["q"]),
        ("Do something to `q`.", ["q"]),
        ("Do something to `sequel` (S, A).", ["q"]),
        ("Do something to `q`. It has (S, A) entries.", ["q"]),
        ("Do something to `q` (of what is known).", ["q"]),
        ("Do something to `q` (S, A).", []),
        ("Do something.\n\n    Parameters\n    ----------\n    q : (S, A) float64\n", []),
    ],
)
def test_a_shape_must_follow_the_name(documentation: str, silent: list[str]) -> None:
    node = ast.parse(f'def f(q: FloatArray, state: int) -> None:\n    """{documentation}"""').body[0]
    assert isinstance(node, ast.FunctionDef)
    assert undocumented_arguments(node) == silent
