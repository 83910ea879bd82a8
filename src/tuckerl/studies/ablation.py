"""Which step does the work: from the base to the whole method, one thing more at a time.

base -> + a constant smaller rate -> + the weights on random actions -> + on their own actions -> + sharing, by each
of the scenario's rules; and beside it the base that has the smaller rate from the first episode on, alpha / sqrt(A).
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.statistics import MEASURES, Difference, are_relative, compare
from tuckerl.studies.study import Scenario, Study, Variant, variant

N_INSTANCES, N_RUNS = 3, 20
SEVERAL = 3


class AblationStep(NamedTuple):
    """One step of the way from the base to the whole method."""

    label: str
    variant: str
    difference: Difference  # to the base, in favour of the method
    before: str  # the variant that the step starts from
    added: Difference  # to that one: what the step itself does


class Ablation(NamedTuple):
    """The way of one scenario."""

    scenario: Scenario
    steps: tuple[AblationStep, ...]

    def variant_of(self, step: AblationStep) -> Variant:
        """Return the variant that a step leads to."""
        return next(variant for variant in self.scenario.variants if variant.name == step.variant)


def ablation_study(study: Study, n_runs: int = N_RUNS) -> Study:
    """Return the small study behind the ablations of `study`, on the same seeds."""
    return Study(tuple(_scenario(scenario, n_runs) for scenario in study.scenarios), study.seed)


def ablations(study: Study, runs: pl.DataFrame) -> list[Ablation]:
    """Return every scenario's ablation from the runs of a study that `ablation_study` made."""
    return [_ablation(study, scenario, runs.filter(scenario=scenario.name)) for scenario in study.scenarios]


def _scenario(scenario: Scenario, n_runs: int) -> Scenario:
    small = scenario.resized(min(scenario.n_instances, N_INSTANCES), min(scenario.n_runs, n_runs))
    return replace(small, variants=tuple(made for _, made in _labelled(scenario)), comparisons=(), record_paths_of=())


def _labelled(scenario: Scenario) -> list[tuple[str, Variant]]:
    """Return each step's label and variant, the base first."""
    algorithm = scenario.algorithm
    t = algorithm.t_version
    named = [
        ("the base", algorithm.base),
        ("+ constant rate", "constant-1"),
        ("+ weights on random actions", "permuted-1"),
        ("+ weights on their actions", f"{t}-1"),
        *((f"+ {SEVERAL} agents sharing by {share}", f"{t}-{SEVERAL}-{share}") for share in scenario.shares),
    ]
    steps = [(label, variant(algorithm, name)) for label, name in named]
    alpha = algorithm.parameters.get("alpha")
    if isinstance(alpha, (int, float)):  # a schedule has no rate to be compared with from the first episode on
        slower = {**algorithm.parameters, "alpha": alpha / math.sqrt(algorithm.n_actions)}
        steps.append(("the base at alpha/√|A|", replace(steps[0][1], name=f"{algorithm.base}-slow", parameters=slower)))
    return steps


def _ablation(study: Study, scenario: Scenario, runs: pl.DataFrame) -> Ablation:
    measure = MEASURES[scenario.measure]
    (_, base), *others = _labelled(scenario)
    relative = are_relative(runs, [base.name, *(made.name for _, made in others)], measure)
    steps = []
    last = base.name  # of the way so far; every sharing rule is added to its end, and the slow base to the base
    for place, (label, made) in enumerate(others):
        before = base.name if made.tensor_step is None else last
        # What is added has a stream of its own, so that the difference to the base is what it was without it.
        entropy = [study.seed, scenario.number, place]
        difference, added = (
            compare(runs, other, made.name, measure, np.random.default_rng(stream), relative=relative)
            for other, stream in ((base.name, entropy), (before, [*entropy, 1]))
        )
        steps.append(AblationStep(label, made.name, difference, before, added))
        last = made.name if made.n_agents == 1 and made.tensor_step is not None else last
    return Ablation(scenario, tuple(steps))
