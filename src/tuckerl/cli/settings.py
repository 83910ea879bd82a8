"""Reading ``name=value`` from the command line."""

import ast
import json
import re
from collections.abc import Sequence
from typing import Any

from tuckerl.checks import shown
from tuckerl.errors import ParameterError
from tuckerl.studies.named_values import named_value
from tuckerl.studies.search_space import Choices, Range, Searched

_COMMAS = re.compile(r",(?![^()\[\]]*[)\]])")  # outside of brackets
_CONSTANTS = {"true": True, "false": False, "none": None, "null": None}
_NAMED_NONE = ("share", "weights")  # of which "none" is one of the names that they take


def parse_settings(texts: Sequence[str], option: str = "--set") -> dict[str, Any]:
    """Return the values of ``name=value`` texts by name.

    A value is read as a Python literal (``0.2``, ``15,3,9,1``, ``"text"``), true, false, none or null in any case as
    what they say, and anything else as text.

    Raises
    ------
    ParameterError
        If a text is not ``name=value``, or a name comes twice.
    """
    settings: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not name or not equals or not value:
            raise ParameterError(f"{option} must be given NAME=VALUE, such as alpha=0.2; got {shown(text)}")
        if name in settings:
            raise ParameterError(
                f"{option} must be given {name} once; got {name}={shown(settings[name])} and {shown(text)}"
            )
        settings[name] = parse_value(value)
    return settings


def parse_parameters(texts: Sequence[str]) -> dict[str, Any]:
    """Return what `parse_settings` does, but schedules and policies for texts that name them.

    ``epsilon=Linear(0.2, 0, episodes=400)`` is a schedule, ``policy=Softmax(0.5)`` a policy, as
    :func:`tuckerl.studies.named_values.named_value` reads them.

    Raises
    ------
    ParameterError
        If a text is not ``name=value``, a name comes twice, or the numbers are not what is taken.
    UnknownNameError
        If there is no such schedule or policy.
    """
    return {name: _parameter(name, value) for name, value in parse_settings(texts).items()}


def parse_searches(texts: Sequence[str]) -> dict[str, Searched]:
    """Return the ranges and choices of ``name=low:high``, ``name=low:high:log`` or ``name=a,b,c`` texts by name.

    Raises
    ------
    ParameterError
        If a text is none of these, or a name comes twice.
    """
    searches: dict[str, Searched] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not name or not equals or not value:
            raise ParameterError(
                f"--search must be given NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C, such as alpha=0.01:1:log; got "
                f"{shown(text)}"
            )
        if name in searches:
            raise ParameterError(f"--search must be given {name} once; the second is {shown(text)}")
        searches[name] = _range(name, value) if ":" in value else _choices(name, value)
    return searches


def _range(name: str, text: str) -> Range:
    low, high, *scale = (part.strip() for part in text.split(":"))
    ends = parse_value(low), parse_value(high)
    if scale not in ([], ["log"]) or any(isinstance(end, bool) or not isinstance(end, (int, float)) for end in ends):
        raise ParameterError(
            f"--search of a range must be {name}=LOW:HIGH or {name}=LOW:HIGH:log with two numbers; got {shown(text)}"
        )
    return Range(*ends, log=bool(scale))


def _choices(name: str, text: str) -> Choices:
    parts = [part.strip() for part in _COMMAS.split(text)]
    if not all(parts) or len(set(parts)) < len(parts):
        raise ParameterError(f"--search must be given values with commas between them, each once; got {shown(text)}")
    return Choices(tuple(_parameter(name, parse_value(part)) for part in parts))


def parse_numbers(text: str, option: str, count: int | None = None) -> Any:
    """Return the tuple of whole numbers of a text such as ``4,4``, of `count` of them where that is given.

    Raises
    ------
    ParameterError
        If it is something else.
    """
    try:
        numbers = tuple(int(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or count not in (None, len(numbers)):
        wanted = "whole numbers" if count is None else f"{count} whole numbers"
        raise ParameterError(f"{option} must be {wanted} with commas between them; got {shown(text)}")
    return numbers


def _parameter(name: str, value: Any) -> Any:
    return "none" if value is None and name.rpartition(".")[2] in _NAMED_NONE else named_value(name, value)


def parse_value(text: str) -> Any:
    """Return the value that a text says, as `parse_settings` reads it."""
    if text.lower() in _CONSTANTS:
        return _CONSTANTS[text.lower()]
    try:
        value = ast.literal_eval(text)
        json.dumps(value, allow_nan=False)  # what a study cannot write down is not a number, and so is text
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return text
    return value
