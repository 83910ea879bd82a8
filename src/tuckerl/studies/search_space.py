"""What ``tuckerl tune`` searches: ranges and choices of an algorithm's settings, by default those of one table."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from tuckerl.checks import check_int, check_real
from tuckerl.errors import ParameterError
from tuckerl.studies.algorithms import Algorithm, check_setting, parameters_of
from tuckerl.studies.environments import has_several_agents
from tuckerl.studies.grid import name_of
from tuckerl.studies.parameter_docs import parameter_docs
from tuckerl.studies.study_file import AGENTS
from tuckerl.studies.variants import MadeVariant, NamedEnvironment, made_variant

_DIGITS = 3  # that a variant's name says of a number, and that are played


@dataclass(frozen=True)
class Range:
    """Numbers from `low` to `high`, both with it: whole ones, or real ones of three digits."""

    low: float
    high: float
    log: bool = False  # whether each ratio is as likely, instead of each difference


@dataclass(frozen=True)
class Choices:
    """Some values of any kind."""

    values: tuple[Any, ...]


Searched = Range | Choices

DEFAULT_RANGES: dict[str, Range] = {
    "alpha": Range(0.01, 1.0, log=True),
    "epsilon": Range(0.01, 0.5, log=True),
    "lambda_": Range(0.0, 0.99),
    "n": Range(1, 16, log=True),
    "planning_steps": Range(1, 50, log=True),
    "kappa": Range(1e-4, 0.1, log=True),
    "theta": Range(1e-5, 0.1, log=True),
    "beta": Range(1e-3, 0.5, log=True),
    "xi": Range(0.0, 1.0),
    "m": Range(1, 50, log=True),
    "every": Range(2, 50, log=True),
    "state_rank": Range(1, 15, log=True),
    "action_rank": Range(1, 10),
    AGENTS: Range(1, 4),
}
"""What is searched where nothing else is said: of an algorithm, those of these that it has."""

_NUMBERS = ("int", "float")
_RANKS = ("state_rank", "action_rank")  # of a tensor step's ranks; the other two stay as they are by default


class Sampler(Protocol):
    """What proposes values, as a trial of Optuna does."""

    def suggest_float(self, name: str, low: float, high: float, *, log: bool = False) -> float:
        """Return a number."""

    def suggest_int(self, name: str, low: int, high: int, *, log: bool = False) -> int:
        """Return a whole number."""

    def suggest_categorical(self, name: str, choices: list[int]) -> int:
        """Return one of the choices."""


class SearchSpace:
    """An algorithm on an environment, what of its settings is searched, and what is fixed.

    Parameters
    ----------
    algorithm : Algorithm
    environment : NamedEnvironment
    searched : mapping
        Ranges and choices by name, in the place of the default ones or beside them; those that the algorithm has.
    settings : mapping
        What is fixed; those that the algorithm has.
    n_agents : int, optional
        Where it is fixed; of an algorithm without a tensor step it is 1.
    n_episodes : int
        Of a run: no window is longer.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a range is none, or an end of it is impossible.
    ProblemError
        If the algorithm cannot play the environment.
    """

    def __init__(
        self,
        algorithm: Algorithm,
        environment: NamedEnvironment,
        searched: Mapping[str, Searched],
        settings: Mapping[str, Any],
        n_agents: int | None,
        n_episodes: int,
    ) -> None:
        known = searchable(algorithm)
        self.algorithm, self._environment = algorithm, environment
        self.fixed = {name: value for name, value in settings.items() if name in parameters_of(algorithm)}
        self._n_agents = (n_agents or 1) if algorithm.is_t_version else 1
        self._default_ranks: tuple[int, ...] = ()
        made = self.variant({})
        if algorithm.is_t_version:
            ranks = made.algorithm.step.ranks
            self._default_ranks = (
                ranks if isinstance(ranks, tuple) else ()
            )  # of a share of the energy, none is searched
        own = {name: one for name, one in searched.items() if name in known}
        left_out = {*own, *self.fixed}
        if n_agents is not None or has_several_agents(environment.name):
            left_out.add(AGENTS)
        if "policy" in left_out:
            left_out.add("epsilon")
        if "ranks" in left_out:
            left_out |= set(_RANKS)
        most = {"every": n_episodes, **dict(zip(_RANKS, self._default_ranks, strict=False))}
        default = {
            name: Range(one.low, min(one.high, most.get(name, one.high)), one.log)
            for name, one in DEFAULT_RANGES.items()
            if known.get(name) in _NUMBERS and name not in left_out
        }
        self.searched: dict[str, Searched] = {
            name: _checked(name, one, known[name])
            for name, one in sorted({**default, **own}.items(), key=lambda entry: _place(entry[0]))
            if name in own or (isinstance(one, Range) and one.low < one.high)
        }
        for corner in self._corners():
            self.variant(corner)

    def _corners(self) -> list[dict[str, Any]]:
        """Return choices with every end of a range, and every choice, in one of them."""
        values = {
            name: (one.low, one.high) if isinstance(one, Range) else one.values for name, one in self.searched.items()
        }
        n_corners = max(map(len, values.values()), default=0)
        return [{name: own[min(at, len(own) - 1)] for name, own in values.items()} for at in range(n_corners)]

    def choose(self, sampler: Sampler) -> dict[str, Any]:
        """Return a value for each of the settings that are searched."""
        return {name: _chosen(name, one, sampler) for name, one in self.searched.items()}

    def variant(self, choices: Mapping[str, Any]) -> MadeVariant:
        """Return the variant of some choices, whose name says them."""
        settings = {**self.fixed, **choices}
        n_agents = settings.pop(AGENTS, self._n_agents)
        if any(name in settings for name in _RANKS):
            own = (settings.pop(name, default) for name, default in zip(_RANKS, self._default_ranks, strict=False))
            settings["ranks"] = (*own, *self._default_ranks[2:])
        made = made_variant(self.algorithm, settings, n_agents, self._environment)
        return made.named(name_of(self.algorithm.name, choices))


def _place(name: str) -> tuple[int, str]:
    """Return where a setting stands in a variant's name: in the order of the table, all others after those."""
    names = list(DEFAULT_RANGES)
    return (names.index(name) if name in names else len(names), name)


def searchable(algorithm: Algorithm) -> dict[str, str]:
    """Return the kind of each setting that can be searched: "int", "float", or something else, which has no ranges."""
    docs = parameter_docs(algorithm)
    kinds = {name: doc.kind.replace(",", " ").partition(" ")[0] for name, doc in docs.items()}
    if not algorithm.is_t_version:
        return kinds
    # A range of ranks is one of the shares of the energy that they explain; four numbers are choices.
    return kinds | dict.fromkeys((*_RANKS, AGENTS), "int") | {"ranks": "float"}


def check_names(
    algorithms: tuple[Algorithm, ...], searched: Mapping[str, Searched], settings: Mapping[str, Any]
) -> None:
    """Refuse names that none of the algorithms can be set by, and those that are both searched and fixed.

    Raises
    ------
    ParameterError, ParameterTypeError
        If there are such.
    """
    for name in (*settings, *searched):
        own = (*_RANKS, AGENTS)
        if name in own and name in searched:
            if not any(algorithm.is_t_version for algorithm in algorithms):
                raise ParameterError(
                    f"{name} is searched of algorithms with a tensor step, and {algorithms[0].name} has none"
                )
        elif name in own:
            how = (
                "fix the number with --agents"
                if name == AGENTS
                else "set ranks=A,B,C,D, all four, or a share such as ranks=0.95"
            )
            raise ParameterError(f"{name} cannot be set by name: {how}, or search it")
        else:
            check_setting(algorithms, name)
    for name in searched:
        if name in settings:
            raise ParameterError(f"{name} is both set and searched: leave out one of the two")
    if "ranks" in {*settings, *searched} and (both := [name for name in _RANKS if name in searched]):
        raise ParameterError(f"ranks and {both[0]} are both given: leave out one of the two")


def _checked(name: str, one: Searched, kind: str) -> Searched:
    """Return a range whose numbers are of the setting's kind, or the choices.

    Raises
    ------
    ParameterError, ParameterTypeError
        If the range is empty, or the setting is no number.
    """
    if isinstance(one, Choices):
        if not one.values:
            raise ParameterError(f"{name} has no value to try: give some, such as {name}=1,2")
        return one
    if kind not in _NUMBERS:
        raise ParameterError(f"{name} is no number, so it has no range: give values to try, as {name}=VALUE,VALUE")
    check = _whole if kind == "int" else check_real
    low, high = (check(f"the {end} end of {name}", number) for end, number in (("low", one.low), ("high", one.high)))
    if not low < high:
        raise ParameterError(f"{name} must be searched from a low to a higher number; got {one.low} to {one.high}")
    if one.log and low <= 0:
        raise ParameterError(f"{name} must be above 0 where ratios are searched (log); got {one.low} to {one.high}")
    return Range(low, high, one.log)


def _whole(name: str, value: object) -> int:
    return check_int(name, int(value) if isinstance(value, float) and value.is_integer() else value)


def _chosen(name: str, one: Searched, sampler: Sampler) -> Any:
    if isinstance(one, Choices):
        return one.values[sampler.suggest_categorical(name, list(range(len(one.values))))]
    if isinstance(one.low, int) and isinstance(one.high, int):
        return sampler.suggest_int(name, one.low, one.high, log=one.log)
    number = sampler.suggest_float(name, one.low, one.high, log=one.log)
    return min(max(float(f"{number:.{_DIGITS}g}"), one.low), one.high)
