"""What both versions play: some hundred small cases, each a name and a function that returns what came of it."""

from benchmarks.versions.cases import plain, saving, stepped, tensor_steps
from benchmarks.versions.cases.case import Case


def all_cases() -> list[Case]:
    """Return all cases, those that write files before those that read them."""
    return [*plain.cases(), *stepped.cases(), *tensor_steps.cases(), *saving.cases()]
