"""The arrays that an algorithm or a policy keeps for each agent, declared once.

From the declaration follow how they are allocated, saved, restored, and shared at a tensor step (see `sharing`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import DTypeLike

from tuckerl.checks import check_text, shown
from tuckerl.errors import ImmutableError, ParameterError, SavedFileError
from tuckerl.saved_arrays import SavedArrays, grouped
from tuckerl.types import FloatArray

Arrays = dict[str, np.ndarray]

Sharing = Literal["by_entry", "by_row", "heaviest", "copied", "none"]
SHARING: tuple[Sharing, ...] = ("by_entry", "by_row", "heaviest", "copied", "none")


class Record(Protocol):
    """Arrays that belong together and are saved in a form of their own, such as eligibility traces."""

    def to_arrays(self) -> Arrays:
        """Return copies of what `set_arrays` goes on from, taken between two episodes."""

    def set_arrays(self, arrays: SavedArrays) -> None:
        """Go on from what `to_arrays` returned; what a file holds may have been written by anybody.

        `arrays` is a mapping by name. Its `take` returns an array only if it has the type, shape and entries that are
        asked for; whatever this raises, the file is refused.
        """

    def clear(self) -> None:
        """Begin anew."""


@dataclass(frozen=True)
class DeclaredArray:
    """An array of each agent's.

    Parameters
    ----------
    name : str
        As a keyword of the algorithm's NamedTuple. A dot groups arrays: ``"model.reward"``.
    share : str
        How it travels when agents share their tables: ``"by_entry"``, mixed as the Q-tables are; ``"by_row"``, mixed so
        that each row, a distribution, still sums to 1; ``"heaviest"``, copied from the agent of the largest weight in
        the mixture; ``"copied"``, copied along with an agent's table, and begun anew where tables are mixed;
        ``"none"``, each agent keeps its own.
    shape : tuple
        Whole numbers, ``"states"`` or ``"actions"``. Of an array whose first axis is the states, only rows may change
        that the kernels have recorded by `record_change` before; any other is copied at every call of a kernel.
    dtype
    initial : float
        What it is filled with; None fills it with the learner's `initial_q`, for which the shape must be (S, A).
    bounds : "states", "actions" or (low, high), optional
        What its entries may be: numbers of states or of actions, or numbers from low to high. A file in which they are
        not is refused, so that a kernel may use them as indices. Rows that are shared ``"by_row"`` must be
        distributions, or zero, and tables of values (`initial` None) finite.
    """

    name: str
    share: Sharing
    shape: tuple[int | str, ...] = ("states", "actions")
    dtype: DTypeLike = np.float64
    initial: float | None = 0.0
    bounds: Literal["states", "actions"] | tuple[float, float] | None = None

    def __post_init__(self) -> None:
        _check_declared_name(self.name)
        if isinstance(self.bounds, str) and self.bounds not in ("states", "actions"):
            raise ParameterError(
                f"bounds of {self.name!r} must be 'states', 'actions' or (low, high); got {shown(self.bounds)}"
            )
        if np.dtype(self.dtype).hasobject:
            raise ParameterError(f"no file holds Python objects; {self.name!r} has dtype {np.dtype(self.dtype)}")
        if self.share not in SHARING:
            raise ParameterError(f"share of {self.name!r} must be one of {', '.join(SHARING)}; got {shown(self.share)}")
        unknown = [size for size in self.shape if isinstance(size, str) and size not in ("states", "actions")]
        if unknown or (self.share == "by_row" and len(self.shape) < 2):
            raise ParameterError(
                f"the shape of {self.name!r} must be of whole numbers, 'states' and 'actions', and have rows where "
                f"it is shared by row; got {self.shape}"
            )
        if self.share in ("by_entry", "by_row") and np.dtype(self.dtype).kind != "f":
            raise ParameterError(
                f"only arrays of floats can be mixed; {self.name!r} has dtype {np.dtype(self.dtype)}: declare it with "
                "share='heaviest', 'copied' or 'none'"
            )

    @property
    def form(self) -> tuple[object, ...]:
        """The shape and the type."""
        return (self.shape, np.dtype(self.dtype))

    @property
    def is_by_state(self) -> bool:
        """Whether it has a row for each state, which changes only where the kernels record it."""
        return self.shape[:1] == ("states",)

    @property
    def is_shared_by_rows(self) -> bool:
        """Whether agents share only those rows that were recorded as changed."""
        return self.share in ("by_entry", "by_row") and self.is_by_state

    @property
    def is_of_values(self) -> bool:
        """Whether it is a table of values beside the Q-table, which begins and is shared as that does."""
        return self.initial is None and self.share == "by_entry" and self.shape == ("states", "actions")

    def sizes(self, initial_q: FloatArray) -> tuple[int, ...]:
        """Return its shape; `initial_q` is (S, A)."""
        sizes = {"states": initial_q.shape[0], "actions": initial_q.shape[1]}
        return tuple(sizes[size] if isinstance(size, str) else size for size in self.shape)

    def create(self, initial_q: FloatArray) -> np.ndarray:
        """Return the array of one agent; `initial_q` is (S, A).

        Raises
        ------
        ParameterError
            If rows that are to be distributions begin as none.
        """
        shape = self.sizes(initial_q)
        if self.share == "by_row" and self.initial is not None:
            total = self.initial * shape[-1]
            if min(abs(total), abs(total - 1.0)) > _SUM_TOLERANCE:
                raise ParameterError(
                    f"rows of {self.name!r} are distributions, as they are shared by row: let `initial` be 0 or "
                    f"1 / {shape[-1]}, so that they sum to 1; got {self.initial}"
                )
        array = np.zeros(shape, dtype=self.dtype)  # zeros cost nothing until they are touched
        if self.initial is None:
            array += initial_q
        elif self.initial != 0.0:
            array[...] = self.initial
        return array


@dataclass(frozen=True)
class DeclaredRecord:
    """Arrays of each agent's that are saved in a form of their own; see :class:`DeclaredArray` for `name` and `share`.

    Parameters
    ----------
    create_record : callable
        From (S, A) to a :class:`Record`.
    """

    name: str
    share: Literal["copied", "none"]
    create_record: Callable[[int, int], Record]

    def __post_init__(self) -> None:
        _check_declared_name(self.name)
        if self.share not in ("copied", "none"):
            raise ParameterError(f"share of {self.name!r} must be copied or none; got {self.share!r}")

    @property
    def form(self) -> tuple[object, ...]:
        """Nothing that is known."""
        return ()

    def create(self, initial_q: FloatArray) -> Record:
        """Return the record of one agent; `initial_q` is (S, A)."""
        return self.create_record(initial_q.shape[0], initial_q.shape[1])


Declaration = DeclaredArray | DeclaredRecord


def carried_over(before: Declaration | None, declaration: Declaration, value: Any, initial_q: FloatArray) -> Any:
    """Return what an agent holds under a declaration that takes the place of another one of its name, or of none.

    Parameters
    ----------
    before, declaration : Declaration
    value
        What the agent held under `before`.
    initial_q : (S, A) float64

    Raises
    ------
    ImmutableError
        If arrays of another shape or type would have to take the place of what was learned.
    """
    if before is None or before is declaration:
        return declaration.create(initial_q) if before is None else value
    if isinstance(before, DeclaredRecord) and isinstance(declaration, DeclaredRecord):
        record = declaration.create(initial_q)
        record.set_arrays(SavedArrays.of(value.to_arrays()))
        return record
    if before.form == declaration.form:
        return value
    raise ImmutableError(
        f"this parameter cannot change once a learner is made: it decides the shape of {declaration.name!r}, which has "
        "been learned; make a new learner"
    )


def saved_state(declaration: Declaration, value: Any) -> Arrays:
    """Return what an agent holds under a declaration, by the names that files know."""
    if isinstance(declaration, DeclaredRecord):
        return grouped(f"records/{declaration.name}", value.to_arrays())
    return {f"arrays/{declaration.name}": value}


def restore_state(declaration: Declaration, value: Any, arrays: Arrays) -> None:
    """Set what an agent holds under a declaration, in place, to what `saved_state` returned."""
    if isinstance(declaration, DeclaredRecord):
        group = f"records/{declaration.name}"
        own = {name: array.copy() for name, array in arrays.items() if name.startswith(f"{group}/")}
        value.set_arrays(SavedArrays.of(own).group(group))
    else:
        value[...] = arrays[f"arrays/{declaration.name}"]


def read_state(declaration: Declaration, arrays: SavedArrays, initial_q: FloatArray, *, finite: bool) -> Any:
    """Return what an agent holds under a declaration in a file.

    Parameters
    ----------
    declaration : Declaration
    arrays : SavedArrays
        The agent's, by the names of `saved_state`.
    initial_q : (S, A) float64
    finite : bool
        Whether tables of values must be finite, as no table has diverged.

    Raises
    ------
    SavedFileError
        If that is not what is declared; a record raises what it likes.
    """
    if isinstance(declaration, DeclaredRecord):
        record = declaration.create(initial_q)
        record.set_arrays(arrays.group(f"records/{declaration.name}"))
        return record
    low, high = _limits(declaration, initial_q)
    name, sizes, is_table = f"arrays/{declaration.name}", declaration.sizes(initial_q), declaration.initial is None
    array = arrays.take(name, declaration.dtype, sizes, low, high, finite=finite and is_table)
    if declaration.share == "by_row":
        _check_distributions(declaration.name, array)
    return array


def _limits(declaration: DeclaredArray, initial_q: FloatArray) -> tuple[float | None, float | None]:
    if isinstance(declaration.bounds, str):
        return 0, initial_q.shape[0 if declaration.bounds == "states" else 1] - 1
    return declaration.bounds or (None, None)


_SUM_TOLERANCE = 1e-6  # rounding of many small changes


def _check_distributions(name: str, array: FloatArray) -> None:
    """Refuse rows that are neither distributions nor zero."""
    sums = array.sum(axis=-1)
    # Written so that NaN fails, too.
    if not ((array >= -_SUM_TOLERANCE).all() and ((np.abs(sums - 1.0) <= _SUM_TOLERANCE) | ~array.any(axis=-1)).all()):
        raise SavedFileError(f"the rows of {name!r} must be distributions, at least 0 and with the sum 1")


def _check_declared_name(name: object) -> None:
    """Refuse names that are no keywords, joined by dots: files tell arrays apart by them."""
    name = check_text("the name of a declared array", name)
    if not all(part.isidentifier() for part in name.split(".")):
        raise ParameterError(
            f"the name of a declared array must be a keyword, or keywords joined by dots; got {shown(name)}"
        )
