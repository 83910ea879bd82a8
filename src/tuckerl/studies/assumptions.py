"""What a scenario's source leaves open, and how it is read."""

from typing import NamedTuple


class Assumption(NamedTuple):
    """A reading of something that a scenario's source leaves open."""

    mark: str  # INVENTED, INFERRED or OVERRULED
    text: str


INVENTED, INFERRED, OVERRULED = "D", "I", "P!"


def invented(text: str) -> Assumption:
    """Return an assumption of our own."""
    return Assumption(INVENTED, text)


def inferred(text: str) -> Assumption:
    """Return an assumption that the paper suggests."""
    return Assumption(INFERRED, text)


def overruled(text: str) -> Assumption:
    """Return what the paper prints otherwise, and a public source behind the scenario overrules."""
    return Assumption(OVERRULED, text)
