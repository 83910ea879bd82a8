"""The claims of a study's scenarios, each with its verdict and, where it compares, the same against its control."""

import re
import zlib
from typing import Any, NamedTuple

import polars as pl

from tuckerl.studies.runner import StudyTables
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.statistics import NO_DIFFERENCE, Difference, compare_with_control, json_number
from tuckerl.studies.study import Scenario, Study

MOST_TIME = 1.5  # times the base's processor time is no big computational load


class Claim(NamedTuple):
    """What became of one claim."""

    id: str
    claim: str
    scenario: str  # "all" where it is about several
    verdict: str  # "holds", "does not hold" or "not decided"
    runs: int
    detail: str  # what was compared, in words
    difference: Difference = NO_DIFFERENCE  # NaN where the claim is not a comparison
    control: Difference = NO_DIFFERENCE

    def to_dict(self) -> dict[str, Any]:
        """Return the claim's entry in ``claims.json``."""
        entry = {
            "id": self.id,
            "claim": self.claim,
            "verdict": self.verdict,
            "difference": json_number(self.difference.mean),
            "low": json_number(self.difference.low),
            "high": json_number(self.difference.high),
            "control_difference": json_number(self.control.mean),
            "control_low": json_number(self.control.low),
            "control_high": json_number(self.control.high),
            "runs": self.runs,
        }
        return entry if self.difference.relative else entry | {"relative": False}


def judge_claims(study: Study, tables: StudyTables) -> list[Claim]:
    """Return every claim of the study's scenarios, in the order of their numbers.

    C8, which is about all of the paper's scenarios, is tested where the study has them all.
    """
    claims = [claim for scenario in study.scenarios for claim in compared_claims(study, scenario, tables.runs)]
    claims.append(_weights_in_range(tables.weights))
    of_paper = [scenario for scenario in study.scenarios if scenario.is_of_paper]
    if {scenario.name for scenario in of_paper} == {name for name, known in SCENARIOS.items() if known.is_of_paper}:
        claims.append(_processor_time(of_paper, tables))
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
    """C8: the T-version takes at most 1.5 times the base's processor time per run and agent, in every scenario."""
    key = ["scenario", "variant", "instance", "run"]
    diverged = tables.runs.filter("diverged").select(key).unique()  # they stop early, which is not speed
    finite = tables.times.join(diverged, on=key, how="anti")
    parts, worst, runs = [], 0.0, 0
    for scenario in scenarios:
        algorithm = scenario.algorithm
        names = [v.name for v in scenario.variants if v.name.startswith(f"{algorithm.t_version}-")]
        times = finite.filter(scenario=scenario.name).filter(pl.col("variant").is_in([algorithm.base, *names]))
        means = times.group_by("variant").agg((pl.col("seconds", "tensor_step_seconds") / pl.col("agents")).mean())
        seconds = {variant: (whole, step) for variant, whole, step in means.iter_rows()}
        ratios = [seconds[name][0] / seconds[algorithm.base][0] for name in names]
        shares = [seconds[name][1] / seconds[name][0] for name in names]
        worst, runs = max(worst, *ratios), runs + times.height
        parts.append(f"{scenario.title} {_span(ratios, '.2g')}, the step's share {_span(shares, '.0%')}")
    return Claim(
        "C8",
        "the tensor step does not imply a big computational load",
        "all",
        "holds" if worst <= MOST_TIME else "does not hold",
        runs,
        f"processor time per run and agent, over the base's: {'; '.join(parts)}; allowed {MOST_TIME:g}",
    )


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
