"""What a report says of its claims and variants, in sentences."""

import math
from collections.abc import Sequence

from tuckerl.reports.text import all_pairs, counted
from tuckerl.studies.assumptions import INFERRED, INVENTED, OVERRULED, Assumption
from tuckerl.studies.claims import Claim
from tuckerl.studies.statistics import Difference
from tuckerl.studies.study import Comparison, Scenario, Study, Variant

MARKS = {
    INVENTED: "ours: invented, and declared here",
    INFERRED: "inferred from the paper",
    OVERRULED: "printed in the paper, and overruled here by a public source behind the scenario",
}
_VERDICTS = {
    "holds": ("holds", "hold"),
    "does not hold": ("does not hold", "do not hold"),
    "not decided": ("is not decided", "are not decided"),
}


def outcome(claims: Sequence[Claim]) -> str:
    """Return what became of all claims in two sentences."""
    counts = [(sum(claim.verdict == verdict for claim in claims), words) for verdict, words in _VERDICTS.items()]
    parts = [f"{count} {one if count == 1 else many}" for count, (one, many) in counts if count]
    compared = [claim for claim in claims if not math.isnan(claim.control.mean)]
    text = f"Of {counted(len(claims), 'claim')}, {', '.join(parts)}." if claims else "No claim was tested."
    if not compared:
        return text
    better = sum(claim.control.low > 0 for claim in compared)
    return (
        f"{text} In {better} of {counted(len(compared), 'comparison')} the whole interval of the difference "
        "from the constant control, which lowers the learning rate as much without the tensor, is above 0."
    )


def reading(study: Study, claim: Claim) -> str:
    """Return what a claim's two intervals say together, in plain words; nothing of a claim that compares nothing."""
    found = [(s, c) for s in study.scenarios if s.name == claim.scenario for c in s.comparisons if c.id == claim.id]
    if not found:
        return ""
    ((scenario, comparison),) = found
    if math.isnan(claim.difference.mean):
        lost = claim.difference.n_diverged
        return f"Nothing is left to compare: in {all_pairs(lost)} a run diverged." if lost else "No pair was run."
    if claim.verdict == "holds":
        return _reading_of_gain(claim.control, _causes(comparison, scenario))
    first = "The opposite is the case: the whole interval lies below 0."
    if claim.verdict == "not decided":
        missing = math.isnan(claim.difference.low)
        first = "Too few pairs for an interval." if missing else "The interval covers 0: these runs decide nothing."
    return f"{first} {_against_control(claim.control)}."


def _causes(comparison: Comparison, scenario: Scenario) -> tuple[str, str]:
    """Return what the control shares with the candidate but not with the base, and the ending of its verb.

    With several agents the control shares among them as the candidate does, so that it accounts for that as well; the
    smaller learning rate, the base can have itself.
    """
    agents = {variant.name: variant.n_agents for variant in scenario.variants}
    candidate, base = agents.get(comparison.candidate, 1), agents.get(comparison.base, 1)
    if candidate > 1 and base == candidate:
        return "constant weights and the same sharing", ""
    return ("the smaller learning rate and the sharing", "") if candidate > 1 else ("the smaller learning rate", "s")


def _reading_of_gain(control: Difference, causes: tuple[str, str]) -> str:
    """Say whether a gain over the base is one over the control too."""
    against = _against_control(control)
    if math.isnan(control.low) or math.isnan(control.high):
        return f"{against}."
    cause, s = causes
    if control.low > 0:
        return f"{against}: {cause} alone do{'es' if s else ''} not explain it."
    if control.high < 0:
        return f"{against}: {cause} explain{s} the gain, and the tensor's weights lessen it."
    return f"{against}: {cause} explain{s} the gain, as far as these runs can tell."


def _against_control(control: Difference) -> str:
    if control.n_pairs == 0 and control.n_diverged == 0:
        return "There is no run of the control to compare it with"
    if math.isnan(control.low) or math.isnan(control.high):
        return "Too few pairs to compare it with the control"
    if control.low > 0:
        return "Better than the control"
    return "Worse than the control" if control.high < 0 else "No better than the control"


def assumed(study: Study) -> list[tuple[Assumption, str]]:
    """Return what the scenarios assume, and which of them do; what all of them assume comes first and once."""
    homes: dict[Assumption, list[str]] = {}
    for scenario in study.scenarios:
        for assumption in scenario.assumptions:
            homes.setdefault(assumption, []).append(scenario.title)
    n = len(study.scenarios)
    ordered = sorted(homes.items(), key=lambda item: len(item[1]) < n)
    return [(one, "all" if len(titles) == n > 1 else ", ".join(titles)) for one, titles in ordered]


def described(variant: Variant) -> str:
    """Return what a variant is."""
    step = variant.tensor_step
    if step is None:
        return "without the tensor step"
    weights = {
        "paper": "tensor step as printed",
        "constant": "control: constant weights",
        "permuted": "control: permuted weights",
    }.get(str(step.weights), f"weights: {step.weights if isinstance(step.weights, str) else 'own function'}")
    share = step.share if isinstance(step.share, str) else "own function"
    if variant.n_agents == 1:
        return weights
    return f"{weights}; {'no sharing' if share == 'none' else f'share: {share}'}"
