"""The claims of a study's scenarios, each with its verdict and, where it compares, the same against its control."""

import math
import re
import zlib
from typing import Any, NamedTuple

import polars as pl

from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.statistics import NO_DIFFERENCE, Difference, compare_with_control, json_number, json_numbers
from tuckerl.studies.study import Scenario, Study
from tuckerl.studies.tables import StudyTables

MOST_TIME = 1.5  # times the base's processor time is no big computational load


class Claim(NamedTuple):
    """A claim and its verdict."""

    id: str
    claim: str
    scenario: str  # "all" where it is about several
    verdict: str  # "holds", "does not hold" or "not decided"
    runs: int
    detail: str  # what was compared, in words
    difference: Difference = NO_DIFFERENCE  # NaN where the claim is not a comparison
    control: Difference = NO_DIFFERENCE
    ratio: float | None = None  # of a claim about one; NaN where it cannot be told

    def to_dict(self) -> dict[str, Any]:
        """Return the claim's entry in ``claims.json``."""
        entry = {
            "id": self.id,
            "claim": self.claim,
            "verdict": self.verdict,
            **json_numbers(self.difference, "difference", "low", "high"),
            **json_numbers(self.control, "control_difference", "control_low", "control_high"),
            "runs": self.runs,
        }
        if self.ratio is not None:
            entry["ratio"] = json_number(self.ratio)
        return entry if self.difference.relative else entry | {"relative": False}


def judge_claims(study: Study, tables: StudyTables) -> list[Claim]:
    """Return every claim of the study's scenarios, in the order of their numbers.

    Two are about the paper's scenarios together: C9, on those that the study has, and C8, where it has them all.
    """
    claims = [claim for scenario in study.scenarios for claim in compared_claims(study, scenario, tables.runs)]
    of_paper = {scenario.name: scenario for scenario in study.scenarios if scenario.is_of_paper}
    if of_paper:
        claims.append(_weights_in_range(tables.weights.filter(pl.col("scenario").is_in(list(of_paper)))))
    if of_paper.keys() == {name for name, known in SCENARIOS.items() if known.is_of_paper}:
        claims.append(_processor_time(list(of_paper.values()), tables))
    return sorted(claims, key=lambda claim: [int(p) if p.isdigit() else p for p in re.split(r"(\d+)", claim.id)])


def compared_claims(study: Study, scenario: Scenario, runs: pl.DataFrame) -> list[Claim]:
    """Return the claims that compare variants of one scenario."""
    own = runs.filter(pl.col("scenario") == scenario.name)
    claims = []
    for comparison in scenario.comparisons:
        # Each interval has its own stream, so that no claim's numbers depend on which others are tested.
        entropy = [study.seed, scenario.number, zlib.crc32(comparison.id.encode())]
        difference, control = compare_with_control(own, comparison, entropy)
        detail = f"{comparison.candidate} against {comparison.base}"
        detail += f"; control {comparison.control}" if comparison.control else ""
        pairs = difference.n_pairs
        claims.append(
            Claim(
                comparison.id, comparison.claim, scenario.name, difference.verdict, pairs, detail, difference, control
            )
        )
    return claims


def _processor_time(scenarios: list[Scenario], tables: StudyTables) -> Claim:
    """C8: in every scenario the T-version takes at most 1.5 times the base's processor time per environment step."""
    key = ["scenario", "variant", "instance", "run"]
    played = tables.runs.group_by(key).agg(pl.col("steps").sum(), pl.col("diverged").any())
    # Runs that diverged stop early, and are left out.
    finite = tables.times.join(played.filter(~pl.col("diverged")), on=key)
    sums = finite.group_by("scenario", "variant").agg(
        pl.col("seconds").sum() / pl.col("steps").sum(),
        pl.col("tensor_step_seconds").sum() / pl.col("seconds").sum(),
        pl.len(),
    )
    known = {(scenario, variant): numbers for scenario, variant, *numbers in sums.iter_rows()}
    parts, worst, runs, is_complete = [], 0.0, 0, True
    for scenario in scenarios:
        t_version = f"{scenario.algorithm.t_version}-"
        of_t = [v.name for v in scenario.variants if v.name.startswith(t_version)]
        base, *others = (known.get((scenario.name, name)) for name in (scenario.algorithm.base, *of_t))
        versions = [numbers for numbers in others if numbers]
        if base is None or not versions:  # every run of it diverged
            parts.append(f"{scenario.title} no run left")
            is_complete = False
            continue
        ratios, shares = [seconds / base[0] for seconds, *_ in versions], [share for _, share, _ in versions]
        worst, runs = max(worst, *ratios), runs + sum(n for *_, n in (base, *versions))
        parts.append(f"{scenario.title} {_span(ratios, '.2g')}, the step's share {_span(shares, '.0%')}")
    verdict = "does not hold" if worst > MOST_TIME else "holds" if is_complete else "not decided"
    detail = f"processor time per environment step, over the base's: {'; '.join(parts)}; allowed {MOST_TIME:g}"
    claim = "the tensor step does not imply a big computational load"
    return Claim("C8", claim, "all", verdict, runs, detail, ratio=worst or math.nan)


def _span(values: list[float], form: str) -> str:
    return f"{min(values):{form}} to {max(values):{form}}"


def _weights_in_range(weights: pl.DataFrame) -> Claim:
    """C9: every omega recorded is in (0, 1]."""
    outside = weights.filter((pl.col("weight") <= 0) | (pl.col("weight") > 1)).height
    runs = weights.select("scenario", "variant", "instance", "run").unique().height
    verdict = "not decided" if weights.is_empty() else "holds" if outside == 0 else "does not hold"
    span = "none recorded"
    if not weights.is_empty():
        values = weights["weight"].to_numpy()
        span = f"from {values.min():.3g} to {values.max():.3g}"
    detail = f"{weights.height:,} weights, {span}; {outside:,} outside (0, 1]"
    return Claim("C9", "omega is in [0, 1] and alpha times omega in (0, 1]", "all", verdict, runs, detail)
