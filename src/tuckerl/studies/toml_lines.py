"""On which line of a TOML text each key and each entry of a list stands.

`tomllib` gives lines for errors of syntax only. What it has read without error is walked through here once more, by its
tokens, to say where in it a value is that means nothing.
"""

import re
import tomllib
from collections.abc import Iterator
from typing import NamedTuple

Path = tuple[str | int, ...]
"""Keys and places in lists that lead to a value: ``("problem", 0, "env")``."""

_TOKEN = re.compile(
    r'''(?P<text>"""(?:[^\\]|\\.)*?"{3,5}|\'{3}.*?\'{3,5}|"(?:[^"\\]|\\.)*"|'[^']*')'''
    r"|(?P<comment>\#[^\n]*)|(?P<line>\n)|(?P<mark>[\[\]{}=,])|(?P<bare>[^\s\[\]{}=,#\"']+)",
    re.DOTALL,
)


class _Token(NamedTuple):
    kind: str
    text: str
    line: int


def lines_of(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, of every key and list entry of a TOML text that `tomllib` reads."""
    return _Walk(text).lines


def _tokens(text: str) -> Iterator[_Token]:
    line, at = 1, 0
    for match in _TOKEN.finditer(text):
        line += text.count("\n", at, match.start())
        at = match.start()
        if match.lastgroup != "comment":
            yield _Token(match.lastgroup or "", match[0], line)
    yield _Token("line", "\n", line)


class _Walk:
    """One walk through the tokens: `lines` is what it has found."""

    def __init__(self, text: str) -> None:
        self.lines: dict[Path, int] = {}
        self._tokens = list(_tokens(text))
        self._at = 0
        self._lengths: dict[Path, int] = {}  # of lists of tables so far
        table: Path = ()
        while self._at < len(self._tokens):
            if self._next.kind == "line":
                self._at += 1
            elif self._next.text == "[" and self._next.kind == "mark":
                table = self._header()
            else:
                self._pair(table)

    @property
    def _next(self) -> _Token:
        return self._tokens[self._at]

    def _is(self, mark: str) -> bool:
        return self._next.kind == "mark" and self._next.text == mark

    def _header(self) -> Path:
        """Read [a.b] or [[a.b]] and return where what follows belongs."""
        line, opened = self._next.line, self._at
        while self._is("["):
            self._at += 1
        is_list = self._at - opened == 2
        *parents, last = self._keys()
        while self._is("]"):
            self._at += 1
        path: Path = ()
        for key in parents:
            path = self._latest((*path, key), line)
        path = (*path, last)
        if is_list:
            self.lines.setdefault(path, line)
            self._lengths[path] = self._lengths.get(path, 0) + 1
        path = self._latest(path, line)
        self.lines[path] = line
        return path

    def _latest(self, path: Path, line: int) -> Path:
        """Return the path, or where it is a list of tables that of its latest one."""
        self.lines.setdefault(path, line)
        return (*path, self._lengths[path] - 1) if path in self._lengths else path

    def _keys(self) -> list[str]:
        """Read a key and return its parts: those of a.'b c'.d are three."""
        parts: list[str] = []
        while self._next.kind in ("text", "bare"):
            token = self._next
            if token.kind == "text":
                parts.append(tomllib.loads(f"key = {token.text}")["key"])
            else:  # numbers such as 1.5 are two parts here
                parts += [part for part in token.text.split(".") if part]
            self._at += 1
        return parts

    def _pair(self, table: Path) -> None:
        line, path = self._next.line, table
        for key in self._keys():
            path = (*path, key)
            self.lines.setdefault(path, line)
        self._at += 1  # the sign between key and value
        self._value(path)

    def _value(self, path: Path) -> None:
        if self._is("["):
            self._list(path)
        elif self._is("{"):
            self._inline_table(path)
        else:  # of a date and a time there are two tokens
            while self._next.kind in ("text", "bare"):
                self._at += 1

    def _list(self, path: Path) -> None:
        self._at += 1
        place = 0
        while not self._is("]"):
            if self._next.kind == "line" or self._is(","):
                self._at += 1
                continue
            self.lines[(*path, place)] = self._next.line
            self._value((*path, place))
            place += 1
        self._at += 1

    def _inline_table(self, path: Path) -> None:
        self._at += 1
        while not self._is("}"):
            if self._next.kind == "line" or self._is(","):
                self._at += 1
            else:
                self._pair(path)
        self._at += 1
