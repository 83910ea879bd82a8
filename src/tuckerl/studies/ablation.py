"""Which ingredient does the work: from the base to the whole method, one ingredient more at a time.

base -> + a constant smaller rate -> + the weights on random actions -> + on their own actions -> + sharing, by each
rule; and beside it the base that has the smaller rate from the first episode on, alpha / sqrt(A).
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import polars as pl

from tuckerl.generalization.sharing import SHARING_RULES
from tuckerl.studies.statistics import MEASURES, Difference, compare
from tuckerl.studies.study import Scenario, Study, Variant, variant

N_INSTANCES, N_RUNS = 3, 20
SEVERAL = 3


class AblationStep(NamedTuple):
    """One step of the way from the base to the whole method."""

    label: str
    variant: str
    difference: Difference  # to the base, in favour of the method
    before: str  # the variant that the ingredient is added to
    added: Difference  # to that one: what the ingredient itself does


class Ablation(NamedTuple):
    """The way of one scenario."""

    scenario: Scenario
    ingredients: tuple[AblationStep, ...]


def ablation_study(study: Study, n_runs: int = N_RUNS) -> Study:
    """Return the small study that takes the gains of `study` apart, on the same seeds."""
    return Study(tuple(_scenario(scenario, n_runs) for scenario in study.scenarios), study.seed)


def gains(study: Study, runs: pl.DataFrame) -> list[Ablation]:
    """Return every scenario's ingredients from the runs of a study that `ablation_study` made."""
    return [_gain(study, scenario, runs.filter(pl.col("scenario") == scenario.name)) for scenario in study.scenarios]


def _scenario(scenario: Scenario, n_runs: int) -> Scenario:
    variants = tuple(made for _, made in _ways(scenario))
    small = scenario.resized(min(scenario.n_instances, N_INSTANCES), min(scenario.n_runs, n_runs))
    return replace(small, variants=variants, comparisons=(), record_paths_of=())


def _ways(scenario: Scenario) -> list[tuple[str, Variant]]:
    """Return each step's label and variant, the base first."""
    family = scenario.family
    t = family.t_version
    shares = [share for share in SHARING_RULES if share != "none"]
    named = [
        ("the base", family.base),
        ("+ constant rate", "constant-1"),
        ("+ weights on random actions", "permuted-1"),
        ("+ weights on their actions", f"{t}-1"),
        *((f"+ {SEVERAL} agents sharing by {share}", f"{t}-{SEVERAL}-{share}") for share in shares),
    ]
    base = variant(family, family.base)
    alpha = family.parameters["alpha"] / math.sqrt(family.n_actions)
    slow = replace(base, name=f"{family.base}-slow", parameters={**family.parameters, "alpha": alpha})
    return [*((label, variant(family, name)) for label, name in named), ("the base at alpha/√|A|", slow)]


def _gain(study: Study, scenario: Scenario, runs: pl.DataFrame) -> Ablation:
    measure = MEASURES[scenario.measure]
    (_, base), *others = _ways(scenario)
    ingredients = []
    last = base.name  # of the way so far; every sharing rule is added to its end, and the slow base to the base
    for place, (label, made) in enumerate(others):
        before = base.name if made.tensor_step is None else last
        # What is added has a stream of its own, so that the difference to the base is what it was without it.
        entropy = [study.seed, scenario.number, place]
        difference = compare(runs, base.name, made.name, measure, np.random.default_rng(entropy))
        added = compare(runs, before, made.name, measure, np.random.default_rng([*entropy, 1]))
        ingredients.append(AblationStep(label, made.name, difference, before, added))
        last = made.name if made.n_agents == 1 and made.tensor_step is not None else last
    return Ablation(scenario, tuple(ingredients))
