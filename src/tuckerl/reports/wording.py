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


def percent(difference: Difference) -> str:
    """Return a difference in percent."""
    return NOTHING if math.isnan(difference.mean) else _minus(f"{100 * difference.mean:+.1f} %")


def percent_interval(difference: Difference) -> str:
    """Return its 95 % interval."""
    if math.isnan(difference.mean):
        return ""
    if math.isnan(difference.low) or math.isnan(difference.high):
        return "no interval"
    return _minus(f"[{100 * difference.low:.1f}, {100 * difference.high:.1f}]")


def reading(claim: Claim, comparison: Comparison | None, scenario: Scenario | None) -> str:
    """Return what a claim's two intervals say together, in plain words."""
    if comparison is None or scenario is None or math.isnan(claim.difference.mean):
        return ""
    agents = {variant.name: variant.n_agents for variant in scenario.variants}
    several = agents.get(comparison.candidate, 1) > 1
    cause = "the smaller learning rate and the sharing among agents" if several else "the smaller learning rate"
    first = {
        "holds": "The whole interval is on the claim's side.",
        "does not hold": "The claim does not hold: the whole interval is on the other side.",
    }.get(claim.verdict, "These runs do not decide: the interval covers 0 or cannot be told.")
    control = claim.control
    if math.isnan(control.low) or math.isnan(control.high):
        return f"{first} The comparison with the control has no interval."
    if control.low > 0:
        second = f"Against the control it is better too: {cause} alone does not explain it."
        return f"{first} {second}" if claim.verdict == "holds" else f"{first} It is better than the control, though."
    side = "No better than the control" if control.high >= 0 else "Worse than the control"
    explained = (
        f": the gain is explained by {cause}, without the tensor's weights." if claim.verdict == "holds" else "."
    )
    return f"{first} {side}{explained}"


def described(variant: Variant) -> str:
    """Return what a variant is."""
    step = variant.tensor_step
    if step is None:
        return "the algorithm without the tensor step"
    weights = {
        "paper": "tensor step as printed",
        "constant": "control: every weight 1/√|A|",
        "permuted": "control: the paper's weights dealt to random actions",
    }.get(str(step.weights), f"weights: {step.weights if isinstance(step.weights, str) else 'own function'}")
    share = step.share if isinstance(step.share, str) else "own function"
    if variant.n_agents == 1:
        return weights
    return f"{weights}; {'no sharing' if share == 'none' else f'share: {share}'}"


def _minus(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")
