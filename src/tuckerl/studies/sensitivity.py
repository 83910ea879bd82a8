"""The claims under other readings of a scenario's source, one changed at a time.

Each of a scenario's *alternatives* is played by the variants that its claims compare, on the same seeds as the reading
that is the default. Nothing here is tuned: the alternatives are those that stand beside the defaults in the project's
reading of the paper.
"""

from dataclasses import replace
from typing import NamedTuple

import polars as pl

from tuckerl.studies.claims import Claim, compared_claims
from tuckerl.studies.study import Alternative, Scenario, Study, variants

N_INSTANCES = 3
DEFAULT = "as read"


class Cell(NamedTuple):
    """A claim under one alternative."""

    scenario: str  # its title
    alternative: str
    claim: Claim


class Sensitivity(NamedTuple):
    """All claims under all alternatives."""

    cells: tuple[Cell, ...] = ()

    @property
    def by_claim(self) -> list[Cell]:
        """The cells by scenario and claim."""
        scenarios = list(dict.fromkeys(cell.scenario for cell in self.cells))
        claims = list(dict.fromkeys(cell.claim.id for cell in self.cells))
        return sorted(self.cells, key=lambda cell: (scenarios.index(cell.scenario), claims.index(cell.claim.id)))

    def is_changed(self, cell: Cell) -> bool:
        """Return whether a claim's verdict differs from that of the default reading of the same runs.

        Pairs that all diverged have no verdict either, which is a change; pairs that were never run say nothing.
        """
        was_run = cell.claim.difference.n_pairs + cell.claim.difference.n_diverged > 0
        return was_run and any(
            other.claim.verdict != cell.claim.verdict
            for other in self.cells
            if (other.scenario, other.claim.id, other.alternative) == (cell.scenario, cell.claim.id, DEFAULT)
        )


def sensitivity_study(study: Study, runs: int | None = None) -> Study:
    """Return the study of all alternatives to the scenarios of `study` that have any, with `runs` runs each."""
    made = [
        _scenario(scenario, alternative, runs)
        for scenario in study.scenarios
        if scenario.alternatives
        for alternative in (Alternative(DEFAULT), *scenario.alternatives)
    ]
    return Study(tuple(made), study.seed)


def summarise_sensitivity(study: Study, runs: pl.DataFrame) -> Sensitivity:
    """Return every claim under every alternative from the runs of a study that `sensitivity_study` made."""
    return Sensitivity(
        tuple(
            Cell(scenario.title, scenario.name.split(": ", 1)[1], claim)
            for scenario in study.scenarios
            for claim in compared_claims(study, scenario, runs)
        )
    )


def estimated_seconds(study: Study, times: pl.DataFrame, workers: int) -> float:
    """Return about how long the study of all alternatives takes, from the times of the study it varies."""
    means = times.group_by("scenario", "variant").agg(pl.col("seconds").mean())
    known = {(scenario, variant): seconds for scenario, variant, seconds in means.iter_rows()}
    total = 0.0
    for scenario in study.scenarios:
        name = scenario.name.split(": ", 1)[0]
        longest = max(seconds for (where, _), seconds in known.items() if where == name)
        played = sum(known.get((name, variant.name), longest) for variant in scenario.variants)
        total += played * scenario.n_instances * scenario.n_runs
    return total / workers


def _scenario(scenario: Scenario, alternative: Alternative, runs: int | None) -> Scenario:
    algorithm = replace(
        scenario.algorithm,
        parameters={**scenario.algorithm.parameters, **alternative.parameters},
        step=replace(scenario.algorithm.step, **alternative.step),
    )
    comparisons = scenario.comparisons if alternative.comparisons is None else alternative.comparisons
    compared = [name for one in comparisons for name in (one.base, one.candidate)]
    controls = [one.control for one in comparisons if one.control]
    n_runs = min(scenario.n_runs, scenario.n_alternative_runs) if runs is None else runs
    return replace(
        scenario.resized(min(scenario.n_instances, N_INSTANCES), n_runs),
        name=f"{scenario.name}: {alternative.label}",
        algorithm=algorithm,
        problem=alternative.problem or scenario.problem,
        comparisons=comparisons,
        variants=variants(algorithm, *compared, *controls),
        record_paths_of=(),
    )
