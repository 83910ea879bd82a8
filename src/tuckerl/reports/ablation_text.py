"""Which ingredient does the work, in words."""

import math

from tuckerl.reports.text import amount, amount_interval, counted
from tuckerl.studies.ablation import Ablation, AblationStep


def what_works(ablation: Ablation) -> str:
    """Say which steps add a gain, by the intervals of what each adds to the variant that it is added to."""
    steps = [one for one in ablation.steps if ablation.variant_of(one).tensor_step is not None]
    steps = sorted(steps, key=lambda one: -one.added.mean)
    known = [one for one in steps if not math.isnan(one.added.low)]
    helping = [_with_number(one) + _beside_the_base(ablation, one) for one in known if one.added.low > 0]
    harming = [_with_number(one) for one in reversed(known) if one.added.high < 0]
    if not known:
        return "Which ingredient does the work cannot be told: no step has enough pairs for an interval."
    text = "No ingredient adds a gain whose whole interval lies above 0"
    if helping:
        text = f"By the intervals of each step over the one before it, the work is done by: {_listed(helping)}"
    if harming:
        text += f". Worse than the step before: {_listed(harming)}"
    open_ones, unknown = len(known) - len(helping) - len(harming), len(steps) - len(known)
    if open_ones:
        text += f". The interval covers 0 for {counted(open_ones, 'other step')}"
    if unknown:
        text += f". Too few pairs are left for {counted(unknown, 'step')}"
    return text + "."


def without_the_step(ablation: Ablation) -> str:
    """Say what the smaller learning rate does on its own, where that was run."""
    slow = next((one for one in ablation.steps if ablation.variant_of(one).tensor_step is None), None)
    if slow is None or math.isnan(slow.difference.low):
        return ""
    rate = f"{amount(slow.difference)} {amount_interval(slow.difference)}"
    return f"The smaller learning rate alone, from the first episode on and without any tensor step: {rate}."


def _with_number(one: AblationStep) -> str:
    label = one.label.removeprefix("+ ")
    return f"{label} ({amount(one.added)} {amount_interval(one.added)} over {one.before})"


def _beside_the_base(ablation: Ablation, one: AblationStep) -> str:
    """Say so where a gain over the step before only makes good what that step has spoilt."""
    base = ablation.scenario.algorithm.base
    if one.difference.high < 0:
        return f", though still worse than {base}"
    return "" if one.difference.low > 0 else f", though not better than {base} as far as these runs can tell"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{'; '.join(parts[:-1])}; and {parts[-1]}"
