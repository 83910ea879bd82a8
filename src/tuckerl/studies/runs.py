"""What a run is: one variant that plays one instance of a scenario from one seed, known by all that decides it.

Its *identity* is the hash of its own full specification, and of nothing else: what more a study has, in which order,
and what it calls its variants changes nothing of what is finished.
"""

import hashlib
import json
from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

from tuckerl.studies.executed_code import executed_code
from tuckerl.studies.study import Scenario, Study, Variant

_FORMAT = 2  # of what a run leaves


class Run(NamedTuple):
    """A run by the names and numbers that a study has for it."""

    scenario: str
    variant: str
    instance: int
    run: int


def all_runs(study: Study) -> list[Run]:
    """Return the study's runs in order."""
    return [
        Run(scenario.name, variant.name, instance, run)
        for scenario in study.scenarios
        for variant in scenario.variants
        for instance in range(scenario.n_instances)
        for run in range(scenario.n_runs)
    ]


def run_identities(study: Study) -> dict[Run, str]:
    """Return the identity of each run, 32 hexadecimal digits; runs that are the same under two names have the same."""
    return dict(_identities(study))


def _identities(study: Study) -> Iterator[tuple[Run, str]]:
    for scenario in study.scenarios:
        problem, seed = dict(scenario.environment) or scenario.name, [study.seed, scenario.number]
        for variant in scenario.variants:
            specification = variant.specification()
            decided = decided_alike(problem, scenario.n_episodes, seed, specification, regret=scenario.asks_regret)
            sizes, recorded = (scenario.n_instances, scenario.n_runs), variant.name in scenario.record_paths_of
            yield from identities_alike(scenario.name, variant.name, sizes, decided, recorded=recorded)


def decided_alike(problem: Any, episodes: int, seed: list[int], variant: Any, *, regret: bool) -> dict[str, Any]:
    """Return all that the runs of a variant in a scenario have in common, as JSON.

    Parameters
    ----------
    problem
        The environment as JSON, or the scenario's name, which then decides it.
    episodes : int
    seed : [seed of the study, number of the scenario]
    variant
        Its specification.
    regret : bool
        Whether the regret of what was learned is worked out.
    """
    asked = {"regret": True} if regret else {}
    return asked | {"format": _FORMAT, "problem": problem, "episodes": episodes, "seed": seed, "variant": variant}


def identities_alike(
    scenario: str, variant: str, sizes: tuple[int, int], decided: dict[str, Any], *, recorded: bool
) -> Iterator[tuple[Run, str]]:
    """Give the identity of each run of a variant in a scenario.

    Parameters
    ----------
    scenario, variant : str
    sizes : (instances, runs)
    decided : dict
        As `decided_alike` returns it.
    recorded : bool
        Whether the paths of the first run are kept.
    """
    digest = hashlib.sha256(json.dumps(decided, sort_keys=True).encode())
    for instance in range(sizes[0]):
        for number in range(sizes[1]):
            own = digest.copy()
            own.update(f"/{instance}/{number}/{recorded and (instance, number) == (0, 0):d}".encode())
            yield Run(scenario, variant, instance, number), own.hexdigest()[:32]


def is_recorded(scenario: Scenario, variant: Variant, instance: int, run: int) -> bool:
    """Return whether the paths of a run are kept."""
    return (instance, run) == (0, 0) and variant.name in scenario.record_paths_of


def run_code(scenario: Scenario, variant: Variant) -> dict[str, str]:
    """Return the code that a variant's runs execute, as of :func:`~tuckerl.studies.executed_code.executed_code`."""
    problem: Any = scenario.problem
    makers = [problem.func if isinstance(problem, partial) else problem]
    policy = variant.parameters.get("policy")
    parts = [variant.learner, *variant.learner.__mro__[1:-1], *makers, *([] if policy is None else [type(policy)])]
    environment = [scenario.module] if scenario.module else []
    return executed_code([_PLAYING, *environment, *(part.__module__ for part in parts)])


_PLAYING = "tuckerl.studies.playing"
