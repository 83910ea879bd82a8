"""Learning rates and exploration that change from episode to episode: pure functions of the episode's number."""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tuckerl.checks import check_int, check_name, check_real, shown
from tuckerl.errors import ParameterError, ParameterTypeError, SavedFileError
from tuckerl.memory import Part, check_memory
from tuckerl.saved_arrays import SavedArrays
from tuckerl.types import FloatArray


class Schedule(ABC):
    """A number from 0 for every episode; learning rates and probabilities must stay in [0, 1]."""

    @abstractmethod
    def values(self, n_episodes: int) -> FloatArray:
        """Return the numbers of the episodes 0 to `n_episodes` - 1, (n_episodes,) float64.

        Episodes are counted from the learner's first one, also where a schedule is assigned later.
        """

    @property
    def is_positive(self) -> bool:
        """Whether the number stays above 0, however many episodes there are."""
        return False

    @property
    def highest(self) -> float:
        """The largest number of all episodes, as far as is known."""
        return math.inf


class ScheduleValues:
    """The values of several schedules by episode, worked out as far as they are needed.

    Parameters
    ----------
    schedules : dict of Schedule by name
    past : dict of (E,) float64 by name, optional
        What the numbers were in the first E episodes, if other schedules were in force there; NaN where none was.
    """

    def __init__(self, schedules: Mapping[str, Schedule], past: Mapping[str, FloatArray] | None = None) -> None:
        self._schedules, self.past = dict(schedules), dict(past or {})
        self._values: FloatArray = np.zeros((0, self.n))

    @property
    def n(self) -> int:
        """How many schedules there are."""
        return len(self._schedules)

    @property
    def names(self) -> tuple[str, ...]:
        """Their names in the order of the columns."""
        return tuple(self._schedules)

    def values(self, n_episodes: int) -> FloatArray:
        """Return the values of the episodes from 0 to `n_episodes` - 1 at least, (episodes, n); not to be changed."""
        held = self._values
        if len(held) < n_episodes:
            held = np.zeros((max(n_episodes, 2 * len(held)), self.n))
            for column, (name, schedule) in enumerate(self._schedules.items()):
                held[:, column] = schedule.values(len(held))
                past = self.past.get(name, held[:0, column])[: len(held)]
                # An agent that lags behind plays past episodes by a number that there was not then.
                held[: len(past), column] = np.where(np.isnan(past), held[: len(past), column], past)
            self._values = held  # when it is whole: policies are shared between learners, and these between threads
        return held

    def recorded(self, n_episodes: int) -> dict[str, FloatArray]:
        """Return what was in force in the first episodes, (n_episodes,) by name; NaN where nothing of the name was."""
        present = dict(zip(self.names, self.values(n_episodes)[:n_episodes].T.copy(), strict=True))
        for name in present.keys() & self.past.keys():
            past = self.past[name][:n_episodes]
            present[name][: len(past)] = past
        gone = {name: past for name, past in self.past.items() if name not in present}
        unset = np.full(n_episodes, np.nan)
        return present | {name: np.concatenate([past, unset])[:n_episodes] for name, past in gone.items()}

    def followed_by(self, schedules: Mapping[str, Schedule], n_episodes: int) -> "ScheduleValues":
        """Return the values where other schedules are in force from episode `n_episodes` on: the past stays."""
        if dict(schedules) == self._schedules:
            return self
        unset = np.full(n_episodes, np.nan)
        return ScheduleValues(schedules, dict.fromkeys(schedules, unset) | self.recorded(n_episodes))

    def with_past(self, past: Mapping[str, FloatArray]) -> "ScheduleValues":
        """Return the values after such a past, which a file has held."""
        return ScheduleValues(self._schedules, past)


def read_past(arrays: SavedArrays, n_episodes: int) -> dict[str, FloatArray]:
    """Return what scheduled numbers were, by name, from a file whose agents have finished so many episodes at most.

    Raises
    ------
    SavedFileError
        If they are no such numbers.
    """
    past = {name: arrays.take(name, np.float64, (range(n_episodes + 1),)) for name in list(arrays)}
    for name, numbers in past.items():
        if not (np.isnan(numbers) | ((numbers >= 0.0) & (numbers < math.inf))).all():
            raise SavedFileError(f"the past numbers of {name!r:.60} must be finite and at least 0")
    return past


@dataclass(frozen=True)
class Exponential(Schedule):
    """`start`, multiplied by `decay` after each episode, never below `minimum`.

    Examples
    --------
    >>> Exponential(0.5, 0.5, minimum=0.2).values(3)
    array([0.5 , 0.25, 0.2 ])
    """

    start: float
    decay: float = 1.0
    minimum: float = 0.0

    def __post_init__(self) -> None:
        _check_numbers(self)

    def values(self, n_episodes: int) -> FloatArray:
        """Return the running product, rounded after each factor."""
        factors = np.full(_count(n_episodes), self.decay)
        factors[:1] = self.start
        return np.maximum(np.multiply.accumulate(factors), self.minimum)

    @property
    def is_positive(self) -> bool:
        """Whether there is a positive minimum, or rounding keeps the product at the smallest number above 0."""
        return self.minimum > 0.0 or (self.start > 0.0 and self.decay > 0.5)

    @property
    def highest(self) -> float:
        """Its start, or the minimum where that is above it."""
        return max(self.start, self.minimum)


@dataclass(frozen=True)
class Linear(Schedule):
    """From `start` in a straight line to `stop`, which is reached after `episodes` episodes and kept.

    Examples
    --------
    >>> Linear(1.0, 0.0, episodes=4).values(6)
    array([1.  , 0.75, 0.5 , 0.25, 0.  , 0.  ])
    """

    start: float
    stop: float
    episodes: int

    def __post_init__(self) -> None:
        _check_numbers(self)

    def values(self, n_episodes: int) -> FloatArray:
        """Return the numbers of the first episodes."""
        part = np.minimum(np.arange(_count(n_episodes)) / self.episodes, 1.0)
        return self.start * (1.0 - part) + self.stop * part

    @property
    def is_positive(self) -> bool:
        """Whether both ends are above 0."""
        return min(self.start, self.stop) > 0.0

    @property
    def highest(self) -> float:
        """The larger end."""
        return max(self.start, self.stop)


@dataclass(frozen=True)
class Harmonic(Schedule):
    """``start / (1 + episode / half_after)``: half of `start` after `half_after` episodes.

    Its sum is infinite and that of its squares is not, as Q-learning's convergence asks of a learning rate (Watkins and
    Dayan 1992).

    Examples
    --------
    >>> Harmonic(1.0, half_after=1).values(4)
    array([1.        , 0.5       , 0.33333333, 0.25      ])
    """

    start: float
    half_after: float

    def __post_init__(self) -> None:
        _check_numbers(self)

    def values(self, n_episodes: int) -> FloatArray:
        """Return the numbers of the first episodes."""
        with np.errstate(over="ignore"):  # a quotient out of range gives 0, as it should
            values: FloatArray = self.start / (1.0 + np.arange(_count(n_episodes)) / self.half_after)
        return values

    @property
    def is_positive(self) -> bool:
        """Whether it is still above 0, as floats are rounded, after more episodes than can be asked for."""
        return self.start / (1.0 + 2.0**63 / self.half_after) > 0.0

    @property
    def highest(self) -> float:
        """Its start."""
        return self.start


SCHEDULES = {kind.__name__: kind for kind in (Exponential, Linear, Harmonic)}


def _count(n_episodes: int) -> int:
    """Return a number of episodes, of which there are the values in memory."""
    n_episodes = check_int("n_episodes", n_episodes, 0)
    check_memory("a schedule", [Part("values by episode", 24 * n_episodes, "ask for fewer episodes")])
    return n_episodes


def _check_numbers(schedule: Any) -> None:
    for field in dataclasses.fields(schedule):
        value = getattr(schedule, field.name)
        if field.name == "episodes":
            checked: float = check_int(field.name, value, 1, np.iinfo(np.int64).max)
        elif field.name == "half_after":
            checked = check_real(field.name, value, 0.0, low_open=True)
        else:
            checked = check_real(field.name, value, 0.0, 1.0 if field.name == "decay" else math.inf)
        object.__setattr__(schedule, field.name, checked)


def as_schedule(
    name: str, value: object, decay: float = 1.0, *, positive: bool = False, highest: float = 1.0
) -> Schedule:
    """Return a number, which may decay, or a schedule as a schedule.

    Parameters
    ----------
    name : str
        For messages.
    value : float or Schedule
        From 0 to `highest`.
    decay : float
        Multiplies a number after each episode.
    positive : bool
        Whether 0 is impossible, in whichever episode: for numbers that something is divided by.
    highest : float
        The largest number that is possible.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is neither a number in this range nor one of these schedules, a schedule is to decay on top, or one leaves
        the range.
    """
    if not isinstance(value, Schedule):
        return Exponential(check_real(name, value, 0.0, highest, low_open=positive), decay)
    if type(value) not in SCHEDULES.values():  # no file could hold it
        known = ", ".join(f"tuckerl.{kind}" for kind in SCHEDULES)
        raise ParameterTypeError(f"{name} must be a number or one of the schedules {known}; got {shown(value)}")
    if positive and not value.is_positive:
        raise ParameterError(
            f"{name} must stay above 0 in all episodes; {shown(value)} falls to 0: give it an end above 0"
        )
    if value.highest > highest:
        raise ParameterError(f"{name} must stay in [0, {highest:g}] in all episodes; {shown(value)} does not")
    if check_real(f"{name}_decay", decay, 0.0, 1.0) != 1.0:
        raise ParameterError(f"{name} is a schedule already: leave {name}_decay at 1; got {decay}")
    return value


def as_number(value: Any) -> Any:
    """Return a number as a float, which a file can hold, and a schedule as it is."""
    return value if isinstance(value, Schedule) else float(value)


def as_json(value: Any) -> Any:
    """Return a parameter as JSON, a schedule by its name and numbers."""
    if isinstance(value, Schedule):
        return {"schedule": type(value).__name__} | dataclasses.asdict(value)  # type: ignore[call-overload]  # each is
    return value


def from_json(value: Any) -> Any:
    """Return what `as_json` took apart."""
    if not isinstance(value, dict):
        return value
    parts = dict(value)
    return SCHEDULES[check_name("schedule", parts.pop("schedule"), SCHEDULES)](**parts)
