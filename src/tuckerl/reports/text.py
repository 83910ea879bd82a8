"""Numbers and verdicts in words."""

import math

from tuckerl.studies.claims import Claim
from tuckerl.studies.statistics import Difference
from tuckerl.studies.study import Comparison, Scenario, Variant

NOTHING = "\N{EN DASH}"


def counted(number: int, noun: str) -> str:
    """Return "1 run" or "1,200 runs"."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def whole(value: float) -> str:
    """Return a number without decimals, thousands apart; a dash where there is none."""
    return NOTHING if math.isnan(value) else _minus(f"{value:,.0f}")


def tenths(value: float) -> str:
    """Return a number with one decimal; a dash where there is none."""
    return NOTHING if math.isnan(value) else _minus(f"{value:,.1f}")


def interval(low: float, high: float) -> str:
    """Return "[1, 2]", or nothing where there is no interval."""
    return "" if math.isnan(low) or math.isnan(high) else f"[{whole(low)}, {whole(high)}]"


def seconds(value: float) -> str:
    """Return a time with a fitting unit."""
    if math.isnan(value):
        return NOTHING
    return f"{value * 1000:.3g} ms" if value < 1 else f"{value:.3g} s"


def measured(value: float) -> str:
    """Return a measured number of any size with about four figures; a dash where there is none."""
    if math.isnan(value):
        return NOTHING
    size = abs(value)
    decimals = 0 if size >= 1000 else 1 if size >= 100 else 2 if size >= 1 else 4
    return "0" if value == 0 else _minus(f"{value:,.{decimals}f}" if size >= 0.01 else f"{value:.2e}")


def measured_interval(low: float, high: float) -> str:
    """Return "[1.50, 2.00]", or nothing where there is no interval."""
    return "" if math.isnan(low) or math.isnan(high) else f"[{measured(low)}, {measured(high)}]"


def amount(difference: Difference) -> str:
    """Return a difference in percent of the base's mean, or in the unit of what is measured."""
    if difference.relative or math.isnan(difference.mean):
        return percent(difference)
    return ("+" if difference.mean > 0 else "") + measured(difference.mean)


def amount_interval(difference: Difference) -> str:
    """Return the 95 % interval of `amount`."""
    if difference.relative or math.isnan(difference.mean) or math.isnan(difference.low):
        return percent_interval(difference)
    return measured_interval(difference.low, difference.high)


def percent(difference: Difference) -> str:
    """Return a difference in percent."""
    return NOTHING if math.isnan(difference.mean) else _minus(f"{_rounded(difference.mean):+.1f} %")


def percent_interval(difference: Difference) -> str:
    """Return its 95 % interval."""
    if math.isnan(difference.mean):
        return ""
    if math.isnan(difference.low) or math.isnan(difference.high):
        return "no interval"
    return _minus(f"[{_bound(difference.low)}, {_bound(difference.high)}]")


def signed(value: float) -> str:
    """Return a number of a percentage with its sign, without decimals from 10 on."""
    return _minus(f"{value:+.0f}" if abs(value) >= 9.95 else f"{value:+.1f}") if abs(value) >= 0.05 else "0"


def tick(value: float) -> str:
    """Return an axis's number with its sign."""
    return _minus(f"{value:+g}") if value else "0"


def shown(difference: Difference) -> dict[str, str]:
    """Return a difference and its interval for a table's cell."""
    return {"mean": percent(difference), "interval": percent_interval(difference)}


def reading(claim: Claim, comparison: Comparison | None, scenario: Scenario | None) -> str:
    """Return what a claim's two intervals say together, in plain words."""
    if comparison is None or scenario is None:
        return ""
    if math.isnan(claim.difference.mean):
        lost = claim.difference.n_diverged
        return f"Nothing is left to compare: in {_all_of(lost)} a run diverged." if lost else "No pair was run."
    if claim.verdict == "holds":
        return _reading_of_gain(claim.control, _causes(comparison, scenario))
    first = "The opposite is the case: the whole interval lies below 0."
    if claim.verdict == "not decided":
        missing = math.isnan(claim.difference.low)
        first = "Too few pairs for an interval." if missing else "The interval covers 0: these runs decide nothing."
    return f"{first} {_against_control(claim.control)}."


def _all_of(pairs: int) -> str:
    return "the one pair" if pairs == 1 else f"all {pairs:,} pairs"


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


def _rounded(part: float) -> float:
    return round(100 * part, 1) + 0.0  # no minus zero


def _bound(part: float) -> str:
    # A bound's sign decides the verdict beside it, so it is not rounded away.
    value = 100 * part
    return f"{value:.3f}" if 0.0005 <= abs(value) < 0.05 else f"{_rounded(part):.1f}"


def _minus(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")
