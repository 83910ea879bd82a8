"""Objects that do not change once they are made, as kernels and several learners rely on what they have read of them.

A class derives from :class:`Immutable` and assigns its attributes in its constructor, as any class does; nothing can be
assigned or deleted after that, and arrays are kept as read-only copies.
"""

from abc import ABCMeta
from inspect import Signature, signature
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tuckerl.checks import refuse_mask
from tuckerl.errors import ImmutableError
from tuckerl.memory import Part, check_memory

_MADE = "_is_made"


class _MakesImmutable(ABCMeta):
    """The class of classes whose objects do not change once their constructor has returned."""

    def __call__(cls, *args: Any, **keywords: Any) -> Any:
        return seal(super().__call__(*args, **keywords))

    @property
    def __signature__(cls) -> Signature:
        """What the constructor takes; `inspect` and `help` would show what stands above."""
        kind: Any = cls
        if kind.__init__ is object.__init__:
            return Signature()
        return Signature(list(signature(kind.__init__).parameters.values())[1:])  # without self


class Immutable(metaclass=_MakesImmutable):
    """An object that does not change once its constructor has returned.

    Attributes
    ----------
    instead : dict of str by str
        What to do instead of assigning an attribute, by its name.
    """

    instead: ClassVar[dict[str, str]] = {}

    def __setattr__(self, name: str, value: Any) -> None:
        """Keep an attribute, its arrays read-only.

        Raises
        ------
        ImmutableError
            If the object has been made.
        ParameterTypeError
            If an array has a mask.
        """
        if _MADE in vars(self):
            raise _refusal(self, name, "assigned")
        refuse_mask(name, value)
        super().__setattr__(name, read_only(value))

    def __delattr__(self, name: str) -> None:
        """Delete an attribute while the object is made.

        Raises
        ------
        ImmutableError
            If the object has been made.
        """
        if _MADE in vars(self):
            raise _refusal(self, name, "deleted")
        super().__delattr__(name)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take over what `copy` and `pickle` have kept: they make arrays that can be written to."""
        vars(self).update({name: read_only(value) for name, value in state.items()})


def seal(made: Any) -> Any:
    """Return an :class:`Immutable`, whose attributes are now all there."""
    vars(made)[_MADE] = True
    return made


def read_only(value: Any) -> Any:
    """Return a value with its arrays, also those in tuples, as copies that nobody can make writeable again.

    Arrays that are such copies already are returned as they are.
    """
    if isinstance(value, np.ndarray):
        return _read_only_array(value)
    if isinstance(value, tuple):
        parts = [read_only(part) for part in value]
        if all(new is old for new, old in zip(parts, value, strict=True)):
            return value
        return type(value)(*parts) if hasattr(value, "_fields") else type(value)(parts)
    return value


def _read_only_array(array: NDArray[Any]) -> NDArray[Any]:
    memory: Any = array.base
    if isinstance(memory, bytes) or array.dtype.hasobject:
        return array
    check_memory("an array that stays", [Part(f"its shape {array.shape}", array.nbytes, "give a smaller one")])
    # NumPy refuses to make writeable what lies in bytes; a flag alone could be set again.
    return np.ndarray(array.shape, array.dtype, buffer=array.tobytes())


def _refusal(made: Any, name: str, what: str) -> ImmutableError:
    kind = type(made).__name__
    otherwise = made.instead.get(name, f"make another {kind}")
    return ImmutableError(
        f"{name} cannot be {what}: a {kind} does not change once it is made, as learners have read it; {otherwise}"
    )
