"""A TOML file read so that whatever is wrong in it can be said with the file's name and the line."""

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, ParameterTypeError, TuckerlError, UnknownNameError
from tuckerl.studies.toml_lines import Path, lines_of

Check = Callable[[str, Any], Any]
"""From a key and its value to the value in the form that is worked with; it raises what is wrong."""


class Place:
    """Where in a file something stands: a table, a key's value or a list's entry."""

    def __init__(self, file: str, lines: Mapping[Path, int], path: Path = ()) -> None:
        self.file, self._lines, self._path = file, lines, path

    def inside(self, *path: str | int) -> "Place":
        """Return the place of what stands in it."""
        return Place(self.file, self._lines, self._path + path)

    @property
    def line(self) -> int:
        """The line, counted from 1; of what is not there, that of what it should stand in."""
        path = self._path
        while path and path not in self._lines:
            path = path[:-1]
        return self._lines.get(path, 1)

    def wrong(self, reason: object) -> ParameterError | UnknownNameError:
        """Return an error that says the file, the line and the reason, which may be another error."""
        kind = UnknownNameError if isinstance(reason, UnknownNameError) else ParameterError
        return kind(f"{self.file}, line {self.line}: {reason}")

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Say this place of whatever this library finds wrong in the block.

        Raises
        ------
        ParameterError, UnknownNameError
            For every error of this library.
        """
        try:
            yield
        except TuckerlError as error:
            raise self.wrong(error) from error

    def entries(self, table: Mapping[str, Any], checks: Mapping[str, Check], required: str = "") -> dict[str, Any]:
        """Return what stands in a table, checked.

        Parameters
        ----------
        table : mapping
        checks : mapping
            By key; no other key is allowed.
        required : str
            The key that must be there; "" for none.

        Raises
        ------
        ParameterError, UnknownNameError
            If a key or a value is wrong.
        """
        for key in table:
            with self.inside(key).blamed():
                check_name("key", key, checks)
        if required and required not in table:
            raise self.wrong(f"{required} is missing here")
        found = {}
        for key, value in table.items():
            with self.inside(key).blamed():
                found[key] = checks[key](key, value)
        return found


def read_toml(text: str, file: str) -> tuple[dict[str, Any], Place]:
    """Return what stands in a text, and its place.

    Parameters
    ----------
    text : str
    file : str
        What messages call it.

    Raises
    ------
    ParameterError
        If it is no TOML.
    """
    try:
        document = tomllib.loads(text)
        return document, Place(file, lines_of(text))
    except tomllib.TOMLDecodeError as error:
        reason, _, where = str(error).rpartition(" (at ")
        line = where.partition(",")[0] if where.startswith("line ") and reason else "its last line"
        raise ParameterError(f"{file}, {line}: it is no TOML: {reason or error}") from error
    except RecursionError as error:
        raise ParameterError(f"{file}: it has too many brackets within brackets") from error


def check_table(name: str, value: object) -> dict[str, Any]:
    """Return `value` if it is a table.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if isinstance(value, dict):
        return value
    raise ParameterTypeError(f"{name} must be a table, such as {{ key = 1 }}; got {shown(value)}")


def check_tables(name: str, value: object) -> list[dict[str, Any]]:
    """Return `value` if it is a list of tables.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if isinstance(value, list) and all(isinstance(one, dict) for one in value):
        return value
    raise ParameterTypeError(f"{name} must be one or more tables: head each with [[{name}]], in two brackets")


def check_value(name: str, value: Any) -> Any:
    """Return `value` if it is a finite number, a text, true, false, or lists or tables of such.

    Raises
    ------
    ParameterTypeError, ParameterError
        If there is anything else in it.
    """
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for part in parts:
        check_value(name, part)
    if not isinstance(value, (bool, int, float, str, list, dict)):
        raise ParameterTypeError(f"{name} must be a number, text, true, false or a list of these; got {value}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ParameterError(f"{name} must be a finite number; got {value}")
    return value
