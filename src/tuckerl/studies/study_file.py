"""A study as data: a TOML file of problems, algorithms with their settings, runs, and what is compared with what.

It is checked whole before anything is played. What stands in it is read here; :mod:`tuckerl.studies.study_making`
makes a :class:`~tuckerl.studies.study.Study` of that, for which every environment and every learner is made once.
"""

import hashlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from tuckerl.checks import check_int, check_name, check_path, check_text, shown
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.studies.algorithms import Algorithm, named_algorithm
from tuckerl.studies.comparison import N_EPISODES, N_RUNS
from tuckerl.studies.grid import Axis, read_axis, size_of
from tuckerl.studies.named_values import named_value
from tuckerl.studies.statistics import MEASURES
from tuckerl.studies.toml_place import Check, Place, check_table, check_tables, check_value, read_toml
from tuckerl.studies.variants import label

AGENTS = "agents"  # the one thing besides settings that a grid varies
_LONGEST_NAME = 100


class ProblemEntry(NamedTuple):
    """A ``[[problem]]``: an environment, and how much is played on it."""

    name: str
    environment: str
    keywords: dict[str, Any]
    settings: dict[str, Any]  # of all algorithms that take them
    n_runs: int  # of each instance
    n_episodes: int
    n_instances: int
    varied: str  # the keyword that has the instance's number; "" for none
    seed_number: int  # in the seeds
    place: Place


class AlgorithmEntry(NamedTuple):
    """An ``[[algorithm]]``: a variant, or one for each combination of its grid."""

    name: str
    algorithm: Algorithm
    n_agents: int
    settings: dict[str, Any]
    grid: tuple[Axis, ...]
    place: Place


class CompareEntry(NamedTuple):
    """A ``[[compare]]``: two variants by their names, by what, and on which problems."""

    base: str
    candidate: str
    measure: str
    problems: tuple[str, ...]
    id: str  # "" for that which follows from the names
    claim: str  # "" likewise
    place: Place


class StudyFile(NamedTuple):
    """What stands in a study file."""

    text: str
    title: str
    seed: int
    measure: str
    problems: tuple[ProblemEntry, ...]
    algorithms: tuple[AlgorithmEntry, ...]
    comparisons: tuple[CompareEntry, ...]
    place: Place

    @property
    def n_variants(self) -> int:
        """Number of variants on each problem, without controls."""
        return sum(size_of(entry.grid) for entry in self.algorithms)

    @property
    def n_runs(self) -> int:
        """Number of runs in all, without those of controls."""
        return self.n_variants * sum(problem.n_runs * problem.n_instances for problem in self.problems)


def read_study_file(path: Path) -> StudyFile:
    """Return what stands in a file.

    Raises
    ------
    ParameterError, UnknownNameError
        If it cannot be read, or something is wrong in it: said with its line.
    """
    path = check_path("file", path)
    try:
        text = path.read_bytes().decode()
    except IsADirectoryError as error:
        raise ParameterError(
            f"{path} is a folder: name a study file, or give `tuckerl study resume {path}` where a study was run "
            "into it"
        ) from error
    except OSError as error:
        raise ParameterError(f"cannot read the study file {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ParameterError(f"{path} must be text in UTF-8, as TOML is; byte {error.start} is not") from error
    return parse_study_file(text, str(path))


def parse_study_file(text: str, name: str = "study file") -> StudyFile:
    """Return what stands in a text.

    Parameters
    ----------
    text : str
    name : str
        What messages call it.

    Raises
    ------
    ParameterError, UnknownNameError
        If something is wrong in it: said with its line.
    """
    document, place = read_toml(check_text("text", text), name)
    found = place.entries(document, _TOP)
    for kind in ("problem", "algorithm"):
        if not found.get(kind):
            raise place.inside(kind).wrong(f"a study has at least one {kind}: a table headed by [[{kind}]]")
    numbers = {key: found.get(key, default) for key, default in (("runs", N_RUNS), ("episodes", N_EPISODES))}
    problems = [_problem(table, numbers, place.inside("problem", at)) for at, table in enumerate(found["problem"])]
    algorithms = [_algorithm(table, place.inside("algorithm", at)) for at, table in enumerate(found["algorithm"])]
    _refuse_doubles("problem", problems)
    _refuse_same_seeds(problems)
    _refuse_doubles("algorithm", algorithms)
    measure, names = found.get("measure", "return"), tuple(problem.name for problem in problems)
    comparisons = [
        _comparison(table, measure, names, place.inside("compare", at))
        for at, table in enumerate(found.get("compare", ()))
    ]
    title = found.get("title", f"Study of {', '.join(names[:3])}{' and others' if len(names) > 3 else ''}")
    parts = tuple(problems), tuple(algorithms), tuple(comparisons)
    return StudyFile(text, title, found.get("seed", 0), measure, *parts, place)


def _problem(table: Mapping[str, Any], numbers: Mapping[str, int], place: Place) -> ProblemEntry:
    found = dict(numbers) | place.entries(table, _PROBLEM, "env")
    keywords = _values(found.get("keywords", {}), place.inside("keywords"), check_value)
    name = found.get("name", label(found["env"], keywords))
    settings = _values(found.get("settings", {}), place.inside("settings"), _setting)
    n_instances, varied = found.get("instances", 1), found.get("instance", "")
    if n_instances > 1 and not varied:
        raise place.inside("instances").wrong(
            f"{n_instances} instances would be the same: name the keyword that has the instance's number, such as "
            'instance = "maze_seed"'
        )
    if varied in keywords:
        raise place.inside("keywords", varied).wrong(f"{varied} is set, and varied by the instances: leave out one")
    number = found.get("number", seed_number(name))
    numbers_of_it = found["runs"], found["episodes"], n_instances, varied, number
    return ProblemEntry(name, found["env"], keywords, settings, *numbers_of_it, place)


def seed_number(name: str) -> int:
    """Return a problem's number in the seeds, which its name alone decides: 64 bits, the first of them 1.

    So it is none of the small numbers that scenarios in code have.
    """
    return 2**63 | int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") >> 1


def _algorithm(table: Mapping[str, Any], place: Place) -> AlgorithmEntry:
    found = place.entries(table, _ALGORITHM, "algorithm")
    settings = _values(found.get("settings", {}), place.inside("settings"), _setting)
    grid = tuple(read_axis(name, value, place.inside("grid", name)) for name, value in found.get("grid", {}).items())
    for axis in grid:
        if axis.name in settings or (axis.name == AGENTS and AGENTS in found):
            raise axis.place.wrong(f"{axis.name} is set and varied by the grid: leave out one of the two")
    algorithm: Algorithm = found["algorithm"]
    return AlgorithmEntry(found.get("name", algorithm.name), algorithm, found.get(AGENTS, 1), settings, grid, place)


def _comparison(table: Mapping[str, Any], measure: str, problems: tuple[str, ...], place: Place) -> CompareEntry:
    found = place.entries(table, _COMPARE, "base")
    if "candidate" not in found:
        raise place.wrong("candidate is missing here")
    for at, name in enumerate(found.get("problems", ())):
        with place.inside("problems", at).blamed():
            check_name("problem", name, problems)
    asked = found.get("measure", measure), found.get("problems", problems)
    return CompareEntry(found["base"], found["candidate"], *asked, found.get("id", ""), found.get("claim", ""), place)


def _values(table: Mapping[str, Any], place: Place, read: Check) -> dict[str, Any]:
    values = {}
    for name, value in table.items():
        with place.inside(name).blamed():
            values[name] = read(name, value)
    return values


def _setting(name: str, value: object) -> Any:
    return named_value(name, check_value(name, value))


def _refuse_doubles(kind: str, entries: list[Any]) -> None:
    lines: dict[str, int] = {}
    for entry in entries:
        if entry.name in lines:
            raise entry.place.inside("name").wrong(
                f"there are two {kind}s called {shown(entry.name)}, the first on line {lines[entry.name]}: give one "
                "of them another name"
            )
        lines[entry.name] = entry.place.line


def _refuse_same_seeds(problems: list[ProblemEntry]) -> None:
    first: dict[int, ProblemEntry] = {}
    for problem in problems:
        other = first.setdefault(problem.seed_number, problem)
        if other is not problem:
            raise problem.place.inside("number").wrong(
                f"{problem.name} has the number {problem.seed_number} in the seeds, as {other.name} has: give each "
                "another, or none"
            )


def _check_label(name: str, value: object) -> str:
    """Return a name that people read and that decides seeds: some printable characters."""
    text = check_text(name, value)
    if not text.strip() or text != text.strip() or not text.isprintable() or len(text) > _LONGEST_NAME:
        raise ParameterError(
            f"{name} must be 1 to {_LONGEST_NAME} printable characters without spaces around them; got {shown(text)}"
        )
    return text


def _check_names(name: str, value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not value:
        raise ParameterTypeError(f"{name} must be a list of names; got {shown(value)}")
    names = tuple(check_text(name, one) for one in value)
    if len(set(names)) < len(names):
        raise ParameterError(f"{name} must name each once; got {', '.join(names)}")
    return names


def _check_grid(name: str, value: object) -> dict[str, Any]:
    table = check_table(name, value)
    if not table:
        raise ParameterError(f"{name} is empty: name a setting and its values, or leave the grid out")
    return table


def _check_measure(name: str, value: object) -> str:
    return check_name(name, value, MEASURES)


_count: Check = partial(check_int, low=1)
_TOP: dict[str, Check] = {
    "title": _check_label,
    "seed": partial(check_int, low=0),
    "runs": _count,
    "episodes": _count,
    "measure": _check_measure,
    "problem": check_tables,
    "algorithm": check_tables,
    "compare": check_tables,
}
_PROBLEM: dict[str, Check] = {
    "name": _check_label,
    "env": check_text,
    "keywords": check_table,
    "settings": check_table,
    "runs": _count,
    "episodes": _count,
    "instances": _count,
    "instance": _check_label,
    "number": partial(check_int, low=0, high=2**63 - 1),
}
_ALGORITHM: dict[str, Check] = {
    "name": _check_label,
    "algorithm": lambda _, value: named_algorithm(value),
    AGENTS: _count,
    "settings": check_table,
    "grid": _check_grid,
}
_COMPARE: dict[str, Check] = {
    "base": check_text,
    "candidate": check_text,
    "id": _check_label,
    "claim": _check_label,
    "measure": _check_measure,
    "problems": _check_names,
}
