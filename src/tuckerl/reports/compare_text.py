"""What came out of a comparison, in words."""

import math
from collections.abc import Mapping
from typing import Any

from tuckerl.generalization.step import TensorStep
from tuckerl.reports import text as wording
from tuckerl.studies.compared import VERDICTS, ComparisonResult, Estimate
from tuckerl.studies.statistics import Difference

MEASURED = {
    "return": "mean return of an episode",
    "steps": "mean number of steps of an episode",
    "final": "mean return of an episode, over the last tenth of them",
}
QUANTITIES = {"return": "return", "steps": "steps", "final": "return"}
"""What the curves show, by measure."""


def outcome(compared: ComparisonResult) -> str:
    """Return the result in two or three sentences."""
    comparison, difference = compared.contest.comparison, compared.difference
    base, candidate = comparison.base, comparison.candidate
    if math.isnan(difference.mean):
        lost = difference.n_diverged
        return (
            f"Nothing is left to compare: in {'the one pair' if lost == 1 else f'all {lost:,} pairs'} a run diverged."
        )
    pairs = wording.counted(difference.n_pairs, "pair")
    reached = " against ".join(wording.measured(one.mean) for one in _of(compared, candidate, base))
    told = f"{MEASURED[compared.contest.request.measure]} {reached}"
    by = f"{wording.amount(difference)} {wording.amount_interval(difference)}".strip()
    if compared.verdict == "not decided":
        why = "one pair has no interval" if math.isnan(difference.low) else "the interval covers 0"
        first = f"These runs do not decide between {candidate} and {base}: {told}, difference {by} over {pairs}; {why}."
    else:
        first = f"{candidate} does {compared.verdict} than {base}: {told}, difference {by} over {pairs}."
    return f"{first} {against_control(compared)}".rstrip()


def against_control(compared: ComparisonResult) -> str:
    """Return what the control says of the difference, or why there is none."""
    comparison, control = compared.contest.comparison, compared.control
    if not comparison.control:
        return f"No control was played: {compared.contest.no_control}."
    if math.isnan(control.low):
        return f"There are too few pairs to compare it with the control, {comparison.control}."
    by = f"{wording.amount(control)} {wording.amount_interval(control)}"
    how = "better" if control.low > 0 else "worse" if control.high < 0 else "neither better nor worse"
    return f"{comparison.candidate} does {how} than the control, {comparison.control}: {by}. {_meaning(compared)}"


def _meaning(compared: ComparisonResult) -> str:
    """Say what may be concluded of a gain from the comparison with the control."""
    if not compared.contest.algorithm(compared.contest.comparison.candidate).is_t_version:
        return "That control is the base's own: it shows how far the base's weights matter."
    if compared.verdict != "better":
        return ""
    shared = _shared(compared)
    if compared.control.low > 0:
        return f"So what the control has too, {shared}, does not explain all of the gain over the base."
    if compared.control.high < 0:
        return "So the gain over the base is not the tensor's: with equal weights for all actions it is larger."
    return f"So what the control has too, {shared}, explains the gain over the base, as far as these runs can tell."


def _shared(compared: ComparisonResult) -> str:
    """Return what the control shares with the candidate and not with the base."""
    base, candidate, *_ = compared.contest.scenario.variants
    parts = []
    if (base.learner, base.parameters) != (candidate.learner, candidate.parameters):
        parts.append("the algorithm and its parameters")
    if base.tensor_step is None:
        parts.append("the smaller learning rate")
    if candidate.n_agents != base.n_agents:
        parts.append("the sharing among its agents")
    if not parts:
        return "the tensor step with constant weights"
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def difference_rows(compared: ComparisonResult) -> list[dict[str, Any]]:
    """Return one row for the base, and one for the control where there is one."""
    comparison = compared.contest.comparison
    rows = [_difference_row(comparison.base, "the base", compared.difference)]
    if comparison.control:
        rows.append(_difference_row(comparison.control, "the control", compared.control))
    return rows


def _difference_row(name: str, role: str, difference: Difference) -> dict[str, Any]:
    return {
        "name": name,
        "role": role,
        "verdict": VERDICTS[difference.verdict],
        "mark": difference.verdict.replace(" ", "-"),
        "difference": {"mean": wording.amount(difference), "interval": wording.amount_interval(difference)},
        "pairs": f"{difference.n_pairs:,}",
        "diverged": f"{difference.n_diverged:,}",
    }


def variant_rows(compared: ComparisonResult) -> list[dict[str, Any]]:
    """Return one row for each variant."""
    contest = compared.contest
    return [
        {
            "name": made.name,
            "title": contest.algorithm(made.name).title,
            "described": wording.described(made),
            "agents": made.n_agents,
            "mean": wording.measured(one.mean),
            "interval": wording.measured_interval(one.low, one.high),
            "seconds": wording.seconds(one.seconds),
            "runs": f"{one.n_runs:,}",
            "diverged": f"{one.n_diverged:,}",
            "settings": _settings(made.parameters, made.tensor_step),
            "source": contest.algorithm(made.name).source,
        }
        for made, one in zip(contest.scenario.variants, compared.estimates, strict=True)
    ]


def _settings(parameters: Mapping[str, Any], step: TensorStep | None) -> str:
    told = [f"{name} {value}" for name, value in parameters.items()] or ["all parameters as they are by default"]
    if step is not None:
        told.append(
            f"tensor step every {step.every} episodes with ranks {step.ranks}, weights {step.weights}, "
            f"share {step.share}, floor {step.floor:g}"
        )
    return "; ".join(told)


def _of(compared: ComparisonResult, *names: str) -> list[Estimate]:
    by_name = {one.variant: one for one in compared.estimates}
    return [by_name[name] for name in names]
