"""Reading ``name=value`` from the command line."""

import ast
import json
import re
from collections.abc import Sequence
from inspect import Parameter, signature
from typing import Any

from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.training.policies import POLICIES, policy_class
from tuckerl.training.schedules import SCHEDULES

_CONSTANTS = {"true": True, "false": False, "none": None, "null": None}
_CALL = re.compile(r"([A-Za-z_]\w*)\s*\((.*)\)", re.DOTALL)
_COMMA = re.compile(r",(?![^()]*\))")  # outside of inner brackets
_ARGUMENT = re.compile(r"\s*(?:([^=(]*?)\s*=)?\s*(.*?)\s*", re.DOTALL)


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
    """Return what `parse_settings` does, but schedules and policies for texts that name them.

    ``epsilon=Linear(0.2, 0, episodes=400)`` is a schedule, ``policy=Softmax(0.5)`` or
    ``policy=Softmax(Linear(5, 0.1, 400))`` a policy. Nothing is evaluated: each is a name and, between brackets,
    numbers or ``name=number`` with commas; for a number of a policy, a schedule may stand.

    Raises
    ------
    ParameterError
        If a text is not ``name=value``, a name comes twice, or the numbers are not what is taken.
    UnknownNameError
        If there is no such schedule or policy.
    """
    settings = parse_settings(texts)
    calls = {name: _CALL.fullmatch(value) for name, value in settings.items() if isinstance(value, str)}
    return settings | {name: _called(name, _what(name), *call.groups()) for name, call in calls.items() if call}


def _what(name: str) -> str:
    return "policy" if name.rpartition(".")[2] == "policy" else "schedule"


def _called(name: str, what: str, kind: str, inside: str) -> Any:
    """Return the schedule or policy `kind` of what stands `inside` its brackets, for the parameter `name`."""
    kinds: dict[str, Any] = dict(SCHEDULES)
    if what == "policy":
        kinds = {known: policy_class(known) for known in POLICIES if known != "OwnDistribution"}
    forms = {
        known: f"{known}({', '.join(map(_argument, signature(kinds[known]).parameters.values()))})"
        for known in sorted(kinds)
    }
    try:
        check_name(what, kind, kinds)
    except UnknownNameError as error:
        known = f"{'schedules' if what == 'schedule' else 'policies'} are {', '.join(forms.values())}"
        raise UnknownNameError(f"{name}: {error}; {known}") from error
    try:
        numbers, named = _arguments(name, inside, schedules=what == "policy")
        bound = signature(kinds[kind]).bind(*numbers, **named)
        return kinds[kind](*bound.args, **bound.kwargs)
    except (ValueError, TypeError) as error:  # the errors of what is called are such, too
        given = f"{kind}({inside})"
        raise ParameterError(f"{name} must be given {forms[kind]} with numbers in it; got {given}: {error}") from error


def _arguments(name: str, inside: str, *, schedules: bool) -> tuple[list[Any], dict[str, Any]]:
    """Return the numbers in brackets, without and with names, each of which may be a schedule where these are allowed.

    Raises
    ------
    ValueError
        If there is something else.
    """
    numbers: list[Any] = []
    named: dict[str, Any] = {}
    for part in _COMMA.split(inside) if inside.strip() else ():
        key, text = _ARGUMENT.fullmatch(part).groups()  # type: ignore[union-attr]  # it matches every text
        call = _CALL.fullmatch(text) if schedules else None
        value = _number(text) if call is None else _called(name, "schedule", *call.groups())
        if key is None and named:
            raise ValueError(f"{text} comes after {next(iter(named))}")
        if key is None:
            numbers.append(value)
        elif not key or key in named:
            raise ValueError(f"{shown(part.strip())} is out of place")  # as Python would say
        else:
            named[key] = value
    return numbers, named


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
