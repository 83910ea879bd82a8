"""What registers have in common: an entry names what it registers, and it is imported when it is first needed."""

from importlib import import_module
from typing import Any


def load(home: str) -> Any:
    """Return what ``"module:name"`` names, such as ``"tuckerl.learners.sarsa:Sarsa"``."""
    module, _, name = home.partition(":")
    return getattr(import_module(module), name)
