"""Reading ``name=value`` from the command line."""

import ast
import json
import re
from collections.abc import Sequence
from inspect import Parameter, signature
from typing import Any

from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.training.schedules import SCHEDULES, Schedule

_CONSTANTS = {"true": True, "false": False, "none": None, "null": None}
_CALL = re.compile(r"([A-Za-z_]\w*)\s*\((.*)\)", re.DOTALL)


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
        settings[name] = _value(value)
    return settings


def parse_parameters(texts: Sequence[str]) -> dict[str, Any]:
    """Return what `parse_settings` does, with a text such as ``Linear(0.2, 0, episodes=400)`` as the schedule it names.

    Nothing is evaluated: a schedule is a name and, between brackets, numbers or ``name=number`` with commas.

    Raises
    ------
    ParameterError
        If a text is not ``name=value``, a name comes twice, or a schedule's numbers are not what it takes.
    UnknownNameError
        If there is no such schedule.
    """
    settings = parse_settings(texts)
    calls = {name: _CALL.fullmatch(value) for name, value in settings.items() if isinstance(value, str)}
    return settings | {name: _schedule(name, *call.groups()) for name, call in calls.items() if call is not None}


def _schedule(name: str, kind: str, inside: str) -> Schedule:
    """Return the schedule `kind` of the numbers that stand `inside` its brackets, for the parameter `name`."""
    forms = {
        known: f"{known}({', '.join(map(_argument, signature(SCHEDULES[known]).parameters.values()))})"
        for known in sorted(SCHEDULES)
    }
    try:
        check_name("schedule", kind, SCHEDULES)
    except UnknownNameError as error:
        raise UnknownNameError(f"{name}: {error}; schedules are {', '.join(forms.values())}") from error
    numbers: list[float] = []
    named: dict[str, float] = {}
    try:
        for part in inside.split(",") if inside.strip() else ():
            key, equals, number = (piece.strip() for piece in part.rpartition("="))
            if equals and (not key or key in named):
                raise ValueError(f"{shown(part.strip())} is out of place")  # as Python would say
            if equals:
                named[key] = _number(number)
            elif named:
                raise ValueError(f"{number} comes after {next(iter(named))}")
            else:
                numbers.append(_number(number))
        bound = signature(SCHEDULES[kind]).bind(*numbers, **named)
        schedule: Schedule = SCHEDULES[kind](*bound.args, **bound.kwargs)
    except (ValueError, TypeError) as error:  # the schedule's own errors are such, too
        given = f"{kind}({inside})"
        raise ParameterError(f"{name} must be given {forms[kind]} with numbers in it; got {given}: {error}") from error
    return schedule


def _argument(parameter: Parameter) -> str:
    return parameter.name if parameter.default is Parameter.empty else f"{parameter.name}={parameter.default:g}"


def _number(text: str) -> float:
    """Return a number as Python reads it, a whole one as an int."""
    try:
        return int(text)
    except ValueError:
        return float(text)


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


def _value(text: str) -> Any:
    if text.lower() in _CONSTANTS:
        return _CONSTANTS[text.lower()]
    try:
        value = ast.literal_eval(text)
        json.dumps(value, allow_nan=False)  # what a study cannot write down is not a number, and so is text
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return text
    return value
