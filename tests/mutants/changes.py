"""One-token changes of a Python file, each a place in its text and what is to stand there."""

import ast
import re
from collections.abc import Iterator
from typing import NamedTuple

_COMPARISONS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "in": "not in", "is": "is not"}
_COMPARISONS |= {"not in": "in", "is not": "is"}
_OPERATORS = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "//"}
_NAMES = {"min": "max", "any": "all", "argmin": "argmax", "zeros": "ones", "minimum": "maximum", "floor": "ceil"}
_NAMES |= {new: old for old, new in _NAMES.items()}


class Change(NamedTuple):
    """A piece of a file's text, and another that takes its place."""

    kind: str
    line: int
    start: int
    end: int
    new: str

    def applied(self, text: str) -> str:
        """Return the changed text of the file."""
        return text[: self.start] + self.new + text[self.end :]

    def is_python(self, text: str) -> bool:
        """Return whether the changed text can be compiled."""
        try:
            compile(self.applied(text), "", "exec")
        except SyntaxError:
            return False
        return True


def changes(text: str) -> list[Change]:
    """Return every change of a file, in order."""
    return _Finder(text).found


class _Finder(ast.NodeVisitor):
    """Walks through a file's syntax tree; annotations and docstrings are passed over, as nobody executes them."""

    def __init__(self, text: str) -> None:
        self.found: list[Change] = []
        self._text = text
        self._lines = [0, *(match.end() for match in re.finditer("\n", text))]
        self.visit(ast.parse(text))

    def _offset(self, line: int, column: int) -> int:
        """Return the place of a node in the text; the tree counts bytes in a line."""
        start = self._lines[line - 1]
        line_text = self._text[start : self._text.find("\n", start)]
        return start + len(line_text.encode()[:column].decode())

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._offset(node.lineno, node.col_offset), self._offset(node.end_lineno, node.end_col_offset)

    def _add(self, kind: str, start: int, end: int, new: str) -> None:
        self.found.append(Change(kind, self._text.count("\n", 0, start) + 1, start, end, new))

    def _between(self, kind: str, left: ast.expr, right: ast.expr, table: dict[str, str]) -> None:
        """Change the operator that stands between two expressions."""
        begin, end = self._span(left)[1], self._span(right)[0]
        match = re.search(r"[<>=!]=?|not\s+in|is\s+not|in|is|//|[-+*/%]|and|or", self._text[begin:end])
        if match and (old := re.sub(r"\s+", " ", match[0])) in table:
            self._add(kind, begin + match.start(), begin + match.end(), table[old])

    def visit_Compare(self, node: ast.Compare) -> None:  # the name is the tree's
        for left, right in zip([node.left, *node.comparators], node.comparators, strict=False):
            self._between("comparison", left, right, _COMPARISONS)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self._between("operator", node.left, node.right, _OPERATORS)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._between("and, or", left, right, {"and": "or", "or": "and"})
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, (ast.Not, ast.USub, ast.Invert)):
            self._add("sign", self._span(node)[0], self._span(node.operand)[0], "")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value, span = node.value, self._span(node)
        if isinstance(value, bool):
            self._add("truth", *span, str(not value))
        elif isinstance(value, (int, float)):
            self._add("one more", *span, str(value + 1))
            if value:
                self._add("double", *span, str(2 * value))

    def visit_Call(self, node: ast.Call) -> None:
        if len(node.args) > 1 and not any(isinstance(one, ast.Starred) for one in node.args[:2]):
            (start, middle), (second, end) = self._span(node.args[0]), self._span(node.args[1])
            text = self._text
            if text[start:middle] != text[second:end]:
                self._add("swapped", start, end, text[second:end] + text[middle:second] + text[start:middle])
        self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> None:
        self._rename(node.id, self._span(node)[1])

    def visit_Attribute(self, node: ast.Attribute) -> None:
        self._rename(node.attr, self._span(node)[1])
        self.generic_visit(node)

    def _rename(self, name: str, end: int) -> None:
        if name in _NAMES:
            self._add("name", end - len(name), end, _NAMES[name])

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._add("dropped", *self._span(node), "pass")
        if not isinstance(node.value, ast.Constant):  # a docstring
            self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if all(isinstance(target, (ast.Subscript, ast.Attribute)) for target in node.targets):
            self._add("dropped", *self._span(node), "pass")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._add("dropped", *self._span(node), "pass")
        self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for default in (*node.args.defaults, *(one for one in node.args.kw_defaults if one is not None)):
            self.visit(default)
        for statement in node.body:
            self.visit(statement)

    def visit_If(self, node: ast.If) -> None:
        if ast.unparse(node.test) != "TYPE_CHECKING":
            self.generic_visit(node)


def all_kinds(found: list[Change]) -> Iterator[str]:
    """Return the kinds of change that there are, each once, in order of their names."""
    return iter(sorted({change.kind for change in found}))
