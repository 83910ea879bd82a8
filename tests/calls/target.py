"""What a call is: something with right values of each argument, and what holds when it has worked."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tests.calls.values import Make, sound, these

__all__ = ["ONLY_WRONG", "Make", "Target", "these"]

ONLY_WRONG = "only wrong"
"""A right value for which a wrong one always stands: the call would take too long, or do too much."""


class Target(NamedTuple):
    """Something that is called with keyword arguments, on a subject or on None."""

    name: str
    call: Callable[..., Any]
    arguments: Mapping[str, Sequence[Make]]  # right values
    required: int = 0  # arguments that are always given, the first ones
    subject: Make = lambda: None
    check: Callable[[Any], None] = sound
    after: Callable[[Any], None] = lambda subject: None  # what holds of the subject afterwards
    may_last: bool = False  # whether right values may ask for hours of work
