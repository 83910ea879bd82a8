"""The paper's claims, each with its verdict and, where it compares, the same against the constant control."""

import math
import zlib
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.runner import Tables
from tuckerl.studies.statistics import MEASURES, Difference, compare
from tuckerl.studies.study import Comparison, Scenario, Study

N_SCENARIOS = 3  # in the paper
MOST_TIME = 1.5  # times the base's processor time is no big computational load

_NOTHING = Difference(math.nan, math.nan, math.nan, 0, 0)


class Claim(NamedTuple):
    """What became of one claim."""

    id: str
    claim: str
    scenario: str
    verdict: str  # "holds", "does not hold" or "not decided"
    difference: Difference  # NaN where the claim is not a comparison
    control: Difference
    runs: int
    detail: str  # what was compared, in words

    def as_json(self) -> dict[str, Any]:
        """Return the claim's line of ``claims.json``."""
        return {
            "id": self.id,
            "claim": self.claim,
            "verdict": self.verdict,
            "difference": _number(self.difference.mean),
            "low": _number(self.difference.low),
            "high": _number(self.difference.high),
            "control_difference": _number(self.control.mean),
            "control_low": _number(self.control.low),
            "control_high": _number(self.control.high),
            "runs": self.runs,
        }


def test_claims(study: Study, tables: Tables) -> list[Claim]:
    """Return every claim of the study's scenarios, in the order of their numbers.

    C8, which speaks of all of the paper's scenarios, is tested where the study has them all.
    """
    claims = [claim for scenario in study.scenarios for claim in compared_claims(study, scenario, tables.runs)]
    claims.append(_weights_in_range(tables.weights))
    if len(study.scenarios) == N_SCENARIOS:
        claims.append(_processor_time(study, tables))
    return sorted(claims, key=lambda claim: int(claim.id[1:]))


def compared_claims(study: Study, scenario: Scenario, runs: pl.DataFrame) -> list[Claim]:
    """Return the claims that compare variants of one scenario."""
    own = runs.filter(pl.col("scenario") == scenario.name)
    return [_compared(study, scenario, comparison, own) for comparison in scenario.comparisons]


def _compared(study: Study, scenario: Scenario, comparison: Comparison, runs: pl.DataFrame) -> Claim:
    measure = MEASURES[comparison.measure]
    # Each interval has its own stream, so that no claim's numbers depend on which others are tested.
    entropy = [study.seed, scenario.number, zlib.crc32(comparison.id.encode())]
    difference = compare(runs, comparison.base, comparison.candidate, measure, np.random.default_rng([*entropy, 0]))
    control = compare(runs, comparison.control, comparison.candidate, measure, np.random.default_rng([*entropy, 1]))
    return Claim(
        comparison.id,
        comparison.claim,
        scenario.name,
        difference.verdict,
        difference,
        control,
        difference.n_pairs,
        f"{comparison.candidate} against {comparison.base}; control {comparison.control}",
    )


def _processor_time(study: Study, tables: Tables) -> Claim:
    """C8: the T-version takes at most 1.5 times the base's processor time per run and agent, in every scenario."""
    key = ["scenario", "variant", "instance", "run"]
    diverged = tables.runs.filter("diverged").select(key).unique()  # they stop early, which is not speed
    finite = tables.times.join(diverged, on=key, how="anti")
    parts, worst, runs = [], 0.0, 0
    for scenario in study.scenarios:
        family = scenario.family
        names = [v.name for v in scenario.variants if v.name.startswith(f"{family.t_version}-")]
        times = finite.filter(scenario=scenario.name).filter(pl.col("variant").is_in([family.base, *names]))
        means = times.group_by("variant").agg((pl.col("seconds", "tensor_step_seconds") / pl.col("agents")).mean())
        seconds = {variant: (whole, step) for variant, whole, step in means.iter_rows()}
        ratios = [seconds[name][0] / seconds[family.base][0] for name in names]
        shares = [seconds[name][1] / seconds[name][0] for name in names]
        worst, runs = max(worst, *ratios), runs + times.height
        parts.append(f"{scenario.title} {_span(ratios, '.2g')}, the step's share {_span(shares, '.0%')}")
    return Claim(
        "C8",
        "the tensor step does not imply a big computational load",
        "all",
        "holds" if worst <= MOST_TIME else "does not hold",
        _NOTHING,
        _NOTHING,
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
    return Claim(
        "C9",
        "omega is in [0, 1] and alpha times omega in (0, 1]",
        "all",
        verdict,
        _NOTHING,
        _NOTHING,
        runs,
        f"{weights.height:,} weights, {span}; {outside:,} outside (0, 1]",
    )


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
