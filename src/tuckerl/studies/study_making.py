"""From what stands in a study file to the study: every environment and every learner is made once on the way."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, TuckerlError
from tuckerl.studies.algorithms import check_setting, parameters_of
from tuckerl.studies.comparison import check_differ
from tuckerl.studies.grid import combinations, name_of
from tuckerl.studies.named_values import named_value
from tuckerl.studies.study import Comparison, Scenario, Study, Variant
from tuckerl.studies.study_file import AGENTS, AlgorithmEntry, CompareEntry, ProblemEntry, StudyFile
from tuckerl.studies.toml_place import Place
from tuckerl.studies.variants import MadeVariant, NamedEnvironment, control_of, made_variant, scenario_of

_BINS = (
    "in a study file, settings = { bins = {bins} } of a problem or an algorithm, or a number or edges for each "
    "dimension"
)
_ELSEWHERE = {
    "n_agents": f"write {AGENTS} = 3 in the [[algorithm]], or {AGENTS} = [1, 3] in its grid",
    "seed": "write seed at the top of the file; runs have children of it",
}


def study_of(file: StudyFile) -> Study:
    """Return the study of a file.

    Raises
    ------
    ParameterError, UnknownNameError
        If an environment cannot be made, an algorithm cannot play it or takes no such setting, or a comparison names
        nobody: said with its line.
    """
    for entry in file.algorithms:
        for name, place in _places(entry).items():
            _check_setting_name((entry,), name, place)
    for problem in file.problems:
        for name in problem.settings:
            _check_setting_name(file.algorithms, name, problem.place.inside("settings", name))
    return Study(tuple(_scenario(file, problem) for problem in file.problems), file.seed)


class _Chosen(NamedTuple):
    """A variant before it is made: an algorithm with what its grid chose."""

    name: str
    entry: AlgorithmEntry
    choices: dict[str, Any]


def _scenario(file: StudyFile, problem: ProblemEntry) -> Scenario:
    with problem.place.inside("env").blamed():
        environment = NamedEnvironment(problem.environment, problem.keywords, problem.varied)
    chosen = [
        _Chosen(name_of(entry.name, choices), entry, choices)
        for entry in file.algorithms
        for choices in combinations(entry.grid)
    ]
    made: dict[str, MadeVariant] = {}
    for one in chosen:
        if one.name in made:
            raise one.entry.place.wrong(f"there are two variants called {one.name}: rename one of their algorithms")
        made[one.name] = _made(one, problem, environment)
    groups = {entry.name: [one.name for one in chosen if one.entry is entry] for entry in file.algorithms}
    compared = Comparisons(made, groups)
    for compare in file.comparisons:
        if problem.name in compare.problems:
            compared.add(compare)
    return scenario_of(
        environment,
        list(made.values()),
        list(compared.controls.values()),
        tuple(compared.comparisons.values()),
        name=problem.name,
        title=problem.name,
        number=problem.seed_number,
        n_instances=problem.n_instances,
        n_runs=problem.n_runs,
        n_episodes=problem.n_episodes,
        measure=file.measure,
    )


def _places(entry: AlgorithmEntry) -> dict[str, Place]:
    """Return where each of an algorithm's settings stands."""
    of_grid = {axis.name: axis.place for axis in entry.grid if axis.name != AGENTS}
    return {name: entry.place.inside("settings", name) for name in entry.settings} | of_grid


def _check_setting_name(entries: tuple[AlgorithmEntry, ...], name: str, place: Place) -> None:
    with place.blamed():
        if name in _ELSEWHERE:
            raise ParameterError(f"{name} is no setting: {_ELSEWHERE[name]}")
        check_setting(tuple(entry.algorithm for entry in entries), name)


def _made(chosen: _Chosen, problem: ProblemEntry, environment: NamedEnvironment) -> MadeVariant:
    entry, places = chosen.entry, _places(chosen.entry)
    settings = dict(entry.settings)
    for axis in entry.grid:
        place, value = axis.place_of(chosen.choices[axis.name]), chosen.choices[axis.name]
        with place.blamed():
            settings[axis.name] = named_value(axis.name, value)
        places[axis.name] = place
    n_agents = settings.pop(AGENTS, entry.n_agents)
    for name, value in problem.settings.items():
        if name in settings:
            raise places[name].wrong(
                f"{name} is also set by the problem {shown(problem.name)}, on line "
                f"{problem.place.inside('settings', name).line}: set it in one of the two"
            )
        if name in parameters_of(entry.algorithm):
            settings[name], places[name] = value, problem.place.inside("settings", name)
    try:
        return made_variant(entry.algorithm, settings, n_agents, environment, _BINS).named(chosen.name)
    except TuckerlError as error:
        reason = f"{chosen.name} on {problem.name}: {error}" if entry.grid or not places else error
        raise _guilty(str(error), places, entry.place).wrong(_of_kind(error, str(reason))) from error


def _of_kind(error: TuckerlError, reason: str) -> TuckerlError:
    """Return an error of the same class with another message."""
    return type(error)(reason)


def _guilty(message: str, places: Mapping[str, Place], default: Place) -> Place:
    """Return where the setting stands that a message begins with or names; else the algorithm."""
    named = [(match.start(), name) for name in places if (match := re.search(rf"\b{re.escape(name)}\b", message))]
    return places[min(named)[1]] if named else default


class Comparisons:
    """The comparisons of one problem by their ids, and the controls that they need by their names."""

    def __init__(self, made: Mapping[str, MadeVariant], groups: Mapping[str, list[str]]) -> None:
        self.comparisons: dict[str, Comparison] = {}
        self.controls: dict[str, Variant] = {}
        self._made, self._groups = made, groups
        self._by_content = {_content(one.variant): name for name, one in made.items()}

    def add(self, entry: CompareEntry) -> None:
        """Add what an entry asks for: a comparison of each candidate that it names."""
        with entry.place.inside("base").blamed():
            base = self._one_name(entry.base)
        with entry.place.inside("candidate").blamed():
            named = self._groups.get(entry.candidate)
            for candidate in named or [check_name("variant", entry.candidate, self._made)]:
                self._compare(self._made[base], self._made[candidate], entry)

    def _one_name(self, name: str) -> str:
        """Return the name of the one variant that is meant."""
        group = self._groups.get(name, [name])
        if len(group) > 1:
            raise ParameterError(f"{name} has {len(group)} variants: name one of them, such as {group[0]!r}")
        return check_name("variant", group[0], self._made)

    def _compare(self, base: MadeVariant, candidate: MadeVariant, entry: CompareEntry) -> None:
        names = base.variant.name, candidate.variant.name
        check_differ(base.variant, candidate.variant, "set something of one of them")
        control = control_of(base, candidate)
        name = self.name_of(control) if control else ""
        claim = entry.claim or f"{names[1]} does better than {names[0]}"
        one = Comparison(
            entry.id or f"{names[1]} against {names[0]} by {entry.measure}", claim, entry.measure, *names, name
        )
        if one.id in self.comparisons:
            raise ParameterError(f"{one.id} is compared twice")
        self.comparisons[one.id] = one

    def name_of(self, control: Variant) -> str:
        """Return the name of the variant that does what a control does: one that is there, or a new one."""
        content, name = _content(control), f"{control.name}-constant"
        if content not in self._by_content:
            if name in self._made:
                raise ParameterError(f"the constant control of {control.name} would be called {name}, as a variant is")
            self.controls[name] = replace(control, name=name)
            self._by_content[content] = name
        return self._by_content[content]


def _content(variant: Variant) -> str:
    return json.dumps(variant.specification(), sort_keys=True)
