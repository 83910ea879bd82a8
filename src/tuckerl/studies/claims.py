"""The claims of a study's scenarios, each with two verdicts: does it hold, and is the gain owed to the tensor."""

import math
import re
import zlib
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.statistics import (
    MEASURES,
    NO_DIFFERENCE,
    Difference,
    compare,
    compare_with_control,
    json_number,
    json_numbers,
)
from tuckerl.studies.study import Comparison, Scenario, Study
from tuckerl.studies.tables import StudyTables

MOST_TIME = 1.5  # times the base's processor time is no big computational load

IS_IT_THE_TENSOR = "is it the tensor?"
"""What the control answers of a claim that compares the tensor step with the algorithm without it."""

IS_BETTER_THAN_CONSTANT = "are the weights better than a constant rate?"
"""What it answers of a claim about copying, whose base has the tensor step as well."""

_CONSTANT_STREAM = 2  # of the interval among the constant controls; 0 and 1 are those of the claim and its control
_ANSWERS = {"holds": "yes", "does not hold": "no", "not decided": "not decided"}


class Claim(NamedTuple):
    """A claim and its verdicts."""

    id: str
    claim: str
    scenario: str  # "all" where it is about several
    verdict: str  # "holds", "does not hold" or "not decided"
    runs: int
    detail: str  # what was compared, in words
    difference: Difference = NO_DIFFERENCE  # NaN where the claim is not a comparison
    control: Difference = NO_DIFFERENCE
    ratio: float | None = None  # of a claim about one; NaN where it cannot be told
    tensor_question: str = ""  # what `tensor` answers; none where nothing is compared with a control
    constant: Difference = NO_DIFFERENCE  # of a claim about copying: the same comparison among the constant controls

    @property
    def tensor(self) -> str | None:
        """Say "yes", "no" or "not decided" to `tensor_question`, by the interval against the control."""
        return _ANSWERS[self.control.verdict] if self.tensor_question else None

    def to_dict(self) -> dict[str, Any]:
        """Return the claim's entry in ``claims.json``."""
        entry = {
            "id": self.id,
            "claim": self.claim,
            "scenario": self.scenario,
            "verdict": self.verdict,
            **json_numbers(self.difference, "difference", "low", "high"),
            **json_numbers(self.control, "control_difference", "control_low", "control_high"),
            "tensor": self.tensor,
            "tensor_question": self.tensor_question or None,
            **json_numbers(self.constant, "constant_difference", "constant_low", "constant_high"),
            "detail": self.detail,
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
    return [_compared_claim(study, scenario, comparison, own) for comparison in scenario.comparisons]


def _compared_claim(study: Study, scenario: Scenario, comparison: Comparison, runs: pl.DataFrame) -> Claim:
    # Each interval has its own stream, so that no claim's numbers depend on which others are tested.
    entropy = [study.seed, scenario.number, zlib.crc32(comparison.id.encode())]
    difference, control = compare_with_control(runs, comparison, entropy)
    detail = f"{comparison.candidate} against {comparison.base}"
    detail += f"; control {comparison.control}" if comparison.control else ""
    question, constant = IS_IT_THE_TENSOR if comparison.control else "", NO_DIFFERENCE
    if comparison.control_base:
        question = IS_BETTER_THAN_CONSTANT
        names, measure = (comparison.control_base, comparison.control), MEASURES[comparison.measure]
        rng = np.random.default_rng([*entropy, _CONSTANT_STREAM])
        constant = compare(runs, *names, measure, rng, relative=difference.relative)
    return Claim(
        id=comparison.id,
        claim=comparison.claim,
        scenario=scenario.name,
        verdict=difference.verdict,
        runs=difference.n_pairs,
        detail=detail,
        difference=difference,
        control=control,
        tensor_question=question,
        constant=constant,
    )


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
    return Claim("C9", "omega is in (0, 1], and so is alpha times omega", "all", verdict, runs, detail)
