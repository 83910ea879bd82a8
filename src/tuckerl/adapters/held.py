"""What an environment, its wrappers and their parts hold, found by going from object to object."""

from collections import deque
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import islice
from types import FunctionType, MemberDescriptorType, MethodType, ModuleType
from typing import Any

import numpy as np

MOST_PARTS = 100_000
"""Parts of objects that are looked at."""

_SAMPLE = 1000  # first parts of a larger container: where they are numbers and text, so are all, it is taken
LEAVES = (str, bytes, int, float, complex, bool, np.generic, np.ndarray, type, ModuleType, FunctionType, MethodType)
"""What holds nothing further that is looked at."""


def parts_of(one: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield what an object holds: how the place of a part is written, its name, and the part."""
    is_mapping = isinstance(one, Mapping)
    if is_mapping or isinstance(one, (list, tuple, deque, set, frozenset)):
        first = islice(one.values() if is_mapping else one, _SAMPLE)
        if len(one) <= _SAMPLE or not all(isinstance(part, LEAVES) for part in first):
            template = "[{!r}]" if is_mapping else "<{}>" if isinstance(one, (set, frozenset)) else "[{}]"
            for name, part in one.items() if is_mapping else enumerate(one):
                yield template, name, part
    for name, part in getattr(one, "__dict__", {}).items():
        yield ".{}", name, part
    for name in _slots(type(one)):  # type: ignore[arg-type]  # classes are hashable
        yield ".{}", name, getattr(one, name, None)


@lru_cache(maxsize=256)
def _slots(kind: type) -> tuple[str, ...]:
    """Return the attributes that objects of a class keep outside of their ``__dict__``."""
    classes = (base for base in kind.__mro__ if "__slots__" in vars(base))
    return tuple(
        name for base in classes for name, slot in vars(base).items() if isinstance(slot, MemberDescriptorType)
    )


def bytes_of_arrays(env: Any) -> int:
    """Return how many bytes the arrays take that an environment holds, and so about what a copy of it does."""
    seen: set[int] = set()
    objects, n_bytes, n_parts = [env], 0, 0
    while objects and n_parts < MOST_PARTS:
        for _, _, part in parts_of(objects.pop()):
            n_parts += 1
            if id(part) in seen:
                continue
            seen.add(id(part))
            if isinstance(part, np.ndarray):
                n_bytes += part.nbytes
            elif part is not None and not isinstance(part, LEAVES):
                objects.append(part)
    return n_bytes
