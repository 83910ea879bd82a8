"""What came out of a study, problem by problem: estimates of all variants, curves of some, every comparison."""

import math
import zlib
from typing import Any, NamedTuple

import numpy as np

from tuckerl.studies.comparison_result import Compared
from tuckerl.studies.estimates import Estimate, LearningCurves, Reached
from tuckerl.studies.statistics import MEASURES, Measure, WorkOut, compare_pairs_with_control, seeded_difference
from tuckerl.studies.study import Scenario, Study

MOST_CURVES = 9  # in one figure


class ProblemResult(NamedTuple):
    """What came out on one problem."""

    place: int  # in the study
    scenario: Scenario
    estimates: tuple[Estimate, ...]  # in the order of the variants, of the scenario's measure
    curves: LearningCurves
    comparisons: tuple[Compared, ...]
    n_problems: int = 1  # of the study

    @property
    def measure(self) -> Measure:
        """What is measured."""
        return MEASURES[self.scenario.measure]

    def to_dict(self) -> dict[str, Any]:
        """Return the problem's entry in ``comparisons.json``."""
        return {
            "problem": self.scenario.name,
            "measure": self.scenario.measure,
            "variants": [estimate.to_dict() for estimate in self.estimates],
            "comparisons": [compared.to_dict() for compared in self.comparisons],
        }


def summarise_study(study: Study, reached: list[Reached], work_out: WorkOut = seeded_difference) -> list[ProblemResult]:
    """Return what came out on each problem.

    Parameters
    ----------
    study : Study
    reached : list of Reached
        As :func:`~tuckerl.studies.estimates.reached_of` gives them, of all runs that there are.
    work_out : callable
        What works out differences; it may remember them.
    """
    return [
        _problem_result(study, place, scenario, reached[place], work_out)
        for place, scenario in enumerate(study.scenarios)
    ]


def _problem_result(study: Study, place: int, scenario: Scenario, reached: Reached, work_out: WorkOut) -> ProblemResult:
    estimates = tuple(reached.estimate(variant.name) for variant in scenario.variants)
    curves = reached.learning_curves(_with_curves(scenario, estimates), scenario.n_episodes)
    variants = {variant.name: variant for variant in scenario.variants}
    comparisons = []
    for one in scenario.comparisons:
        # Each interval has its own stream, so that no comparison's numbers depend on which others there are.
        entropy = [study.seed, scenario.number, zlib.crc32(one.id.encode())]
        differences = compare_pairs_with_control(reached.pairs(one.measure), one, entropy, work_out)
        names = [name for name in (one.base, one.candidate, one.control) if name]
        of_each = tuple(reached.estimate(name, one.measure) for name in names)
        comparisons.append(Compared(one, variants[one.base], variants[one.candidate], *differences, of_each))
    return ProblemResult(place, scenario, estimates, curves, tuple(comparisons), len(study.scenarios))


def _with_curves(scenario: Scenario, estimates: tuple[Estimate, ...]) -> list[str]:
    """Return the variants whose curves are shown: all, or where they are too many the first base and the best."""
    names = [variant.name for variant in scenario.variants]
    if len(names) <= MOST_CURVES:
        return names
    base = scenario.comparisons[0].base if scenario.comparisons else names[0]
    sign = -1 if MEASURES[scenario.measure].larger_is_better else 1
    means = [math.inf if math.isnan(one.mean) else sign * one.mean for one in estimates]
    best = [names[at] for at in np.argsort(means, kind="stable") if names[at] != base]
    shown = {base, *best[: MOST_CURVES - 1]}
    return [base, *(name for name in names if name in shown and name != base)]
