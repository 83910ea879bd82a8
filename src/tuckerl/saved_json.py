"""The text of a file, which may come from a stranger: JSON that is what its reader expects, by types.

What is expected is said by Python's own types: ``int | None``, ``list[str]``, ``tuple[str, int]`` for a list of two,
``dict[str, Any]``, or a ``TypedDict``, whose names must be there, but for those that are ``NotRequired``, and no more.
"""

import json
import math
import types
from typing import Any, NotRequired, TypeVar, Union, get_args, get_origin, get_type_hints, is_typeddict

from tuckerl.checks import shown
from tuckerl.errors import SavedFileError

_Form = TypeVar("_Form")

MOST_TEXT = 2**24
"""Bytes of JSON that a file may hold."""


def parse_json(text: bytes) -> Any:
    """Return what a JSON text says.

    Raises
    ------
    SavedFileError
        If it is no JSON, too deep, has a number that is not finite, or a name twice.
    """
    try:
        value = json.loads(
            text.decode(), object_pairs_hook=_object, parse_constant=_refuse_constant, parse_float=_finite
        )
        json.dumps(value, ensure_ascii=False).encode()  # half characters can be read, but not be written
    except (ValueError, RecursionError, MemoryError) as error:
        raise SavedFileError(f"its text is no JSON that can be read ({error})") from error
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    named = dict(pairs)
    if len(named) < len(pairs):
        raise ValueError("a name is there twice")
    return named


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is too large")
    return number


def checked_json(value: Any, form: type[_Form], what: str) -> _Form:
    """Return a value if it has the form that is expected.

    Parameters
    ----------
    value
        What `parse_json` returned, or a part of it.
    form : type
    what : str
        What to call it.

    Raises
    ------
    SavedFileError
        If it has another form.
    """
    problem = _problem(value, form, what)
    if problem is not None:
        raise SavedFileError(problem)
    return value  # type: ignore[no-any-return]  # that is what was checked


def _problem(value: Any, form: Any, what: str) -> str | None:
    """Return what is wrong with a value, None if nothing is."""
    origin, arguments = get_origin(form), get_args(form)
    if form is Any:
        return None
    if origin is NotRequired:
        return _problem(value, arguments[0], what)
    if origin in (Union, types.UnionType):
        problems = [_problem(value, one, what) for one in arguments]
        return None if None in problems else problems[0]
    if is_typeddict(form):
        return _problem_of_names(value, form, what)
    if origin is list and isinstance(value, list):
        return next(filter(None, (_problem(one, arguments[0], f"an entry of {what}") for one in value)), None)
    if origin is tuple and isinstance(value, list) and len(value) == len(arguments):
        pairs = zip(value, arguments, strict=True)
        return next(filter(None, (_problem(one, own, f"an entry of {what}") for one, own in pairs)), None)
    if origin is dict and isinstance(value, dict):
        return next(
            filter(None, (_problem(one, arguments[1], f"{what}[{shown(name)}]") for name, one in value.items())), None
        )
    if form is float and type(value) is int:
        return None
    if origin is None and type(value) is form:  # True is no int here
        return None
    return f"{what} must be {getattr(form, '__name__', form)}; got {shown(value)}"


def _problem_of_names(value: Any, form: Any, what: str) -> str | None:
    if not isinstance(value, dict):
        return f"{what} must have names; got {shown(value)}"
    forms = get_type_hints(form, include_extras=True)
    unknown = [name for name in value if name not in forms]
    missing = [name for name in sorted(form.__required_keys__) if name not in value]
    if unknown or missing:
        return f"{what} has an unknown {shown(unknown[0])}" if unknown else f"{what} lacks {shown(missing[0])}"
    problems = (_problem(value[name], own, f"{shown(name)} of {what}") for name, own in forms.items() if name in value)
    return next(filter(None, problems), None)
