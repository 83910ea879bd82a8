"""Schedules and policies as text: ``Linear(0.2, 0, 400)``, as commands and study files name them."""

import re
from inspect import Parameter, signature
from typing import Any

from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.training.policies import POLICIES, policy_class
from tuckerl.training.schedules import SCHEDULES

_CALL = re.compile(r"([A-Za-z_]\w*)\s*\((.*)\)", re.DOTALL)
_COMMA = re.compile(r",(?![^()]*\))")  # outside of inner brackets
_ARGUMENT = re.compile(r"\s*(?:([^=(]*?)\s*=)?\s*(.*?)\s*", re.DOTALL)


def named_value(name: str, value: Any) -> Any:
    """Return the schedule or policy that a text names, and anything else as it is.

    ``Linear(0.2, 0, episodes=400)`` is a schedule, ``Softmax(0.5)`` or ``Softmax(Linear(5, 0.1, 400))`` a policy.
    Nothing is evaluated: each is a name and, between brackets, numbers or ``name=number`` with commas; for a number of
    a policy, a schedule may stand.

    Parameters
    ----------
    name : str
        The parameter's: of ``policy``, the text names a policy, of every other one a schedule.
    value

    Raises
    ------
    ParameterError
        If the numbers are not what is taken.
    UnknownNameError
        If there is no such schedule or policy.
    """
    call = _CALL.fullmatch(value) if isinstance(value, str) else None
    return value if call is None else _called(name, _what(name), *call.groups())


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
