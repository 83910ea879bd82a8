"""Scenarios that come with the package: a study file beside the module that says what is claimed and drawn of it.

The file has the problem, the variants, the numbers and the comparisons. It is read without making an environment or a
learner, so that listing scenarios is quick.
"""

from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from typing import Any

from tuckerl.checks import check_name
from tuckerl.studies.algorithms import parameters_of
from tuckerl.studies.study import Comparison, Scenario
from tuckerl.studies.study_file import AlgorithmEntry, ProblemEntry, parse_study_file
from tuckerl.studies.study_making import Comparisons
from tuckerl.studies.variants import MadeVariant, control_of, unmade_variant

FILES = ("cart-pole", "dyna-maze", "robot-rescue")
"""The scenarios that are study files."""


def file_of(scenario: str) -> str:
    """Return the study file of a scenario that comes with the package.

    Raises
    ------
    UnknownNameError
        If there is none.
    """
    name = check_name("scenario", scenario, FILES).replace("-", "_")
    return files("tuckerl.studies").joinpath(f"{name}.toml").read_text("utf-8")


def planned(name: str, n_actions: int, **own: Any) -> Scenario:
    """Return the scenario of a study file, with all that the file does not say in `own`, by the scenario's fields."""
    file = parse_study_file(file_of(name), f"{name}.toml")
    (problem,) = file.problems
    made = {entry.name: _variant(entry, problem, n_actions) for entry in file.algorithms}
    compared = Comparisons(made, {})
    for entry in file.comparisons:
        compared.add(entry)
    config = next(one.algorithm for one in made.values() if one.variant.tensor_step)
    return Scenario(
        name=name,
        title=file.title,
        description="",
        number=problem.seed_number,
        n_instances=problem.n_instances,
        n_runs=problem.n_runs,
        n_episodes=problem.n_episodes,
        algorithm=replace(config, base=file.algorithms[0].name),
        variants=tuple(one.variant for one in made.values()),
        measure=file.measure,
        comparisons=tuple(_with_control_of_base(one, made, compared) for one in compared.comparisons.values()),
        **own,
    )


def _with_control_of_base(one: Comparison, made: Mapping[str, MadeVariant], compared: Comparisons) -> Comparison:
    """Return a comparison with its base's own control, where the base has a tensor step, too."""
    base = made[one.base]
    control = control_of(base, base) if base.variant.tensor_step else None
    return one if control is None else replace(one, control_base=compared.name_of(control))


def _variant(entry: AlgorithmEntry, problem: ProblemEntry, n_actions: int) -> MadeVariant:
    shared = {name: value for name, value in problem.settings.items() if name in parameters_of(entry.algorithm)}
    made = unmade_variant(entry.algorithm, shared | entry.settings, entry.n_agents, (1, n_actions))
    return made.named(entry.name)
