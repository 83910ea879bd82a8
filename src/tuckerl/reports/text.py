"""Numbers in words: the one place where pages, figures and commands have them from."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from tuckerl.tensor.ranks import numbers_or_share
from tuckerl.types import AskedRanks, FloatArray

if TYPE_CHECKING:  # what it imports, commands without statistics do not need
    from tuckerl.generalization.tensor_step import TensorStep
    from tuckerl.studies.statistics import Difference

NOTHING = "\N{EN DASH}"
_LISTED = 6


def counted(number: int, noun: str) -> str:
    """Return "1 run" or "1,200 runs"."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def ranks_of(ranks: AskedRanks | None) -> str:
    """Return "ranks (15, 3, 9, 1)", "ranks for 95 % of the energy" or "no ranks"."""
    if ranks is None:
        return "no ranks"
    known = numbers_or_share(ranks)
    return f"ranks {known}" if isinstance(known, tuple) else f"ranks for {100 * known:.10g} % of the energy"


def share_of(step: "TensorStep") -> str:
    """Return "share visits", with how often and what is shrunk where these are set; a function by its name."""
    rule = step.share if isinstance(step.share, str) else getattr(step.share, "__name__", "own function")
    often = "" if step.share_every is None else f" every {counted(step.share_every, 'episode')}"
    return f"share {rule}{often}" + (f", shrink {step.shrink:g}" if step.shrink else "")


def all_pairs(number: int) -> str:
    """Return "the one pair" or "all 1,200 pairs"."""
    return "the one pair" if number == 1 else f"all {number:,} pairs"


def whole(value: float) -> str:
    """Return a number without decimals, thousands apart; a dash where there is none."""
    return NOTHING if math.isnan(value) else _minus(f"{value:,.0f}")


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


def plus_minus(value: float, half_width: float) -> str:
    """Return "1,234 ± 56", without the second where it is not known."""
    if math.isnan(half_width):
        return measured(value)
    return f"{measured(value)} ± " + _minus(f"{half_width:{',.0f' if half_width >= 10 else '.2g'}}")


def measured_interval(low: float, high: float, column: str = "") -> str:
    """Return "[1.50, 2.00]", of a sum of steps "[1, 2]", or nothing where there is no interval."""
    return "" if math.isnan(low) or math.isnan(high) else f"[{total(low, column)}, {total(high, column)}]"


def amount(difference: "Difference") -> str:
    """Return a difference in percent of the base's mean, or in the unit of what is measured."""
    if math.isnan(difference.mean):
        return NOTHING
    if difference.relative:
        return _minus(f"{_rounded(difference.mean):+.1f} %")
    return ("+" if difference.mean > 0 else "") + measured(difference.mean)


def amount_interval(difference: "Difference") -> str:
    """Return the 95 % interval of `amount`."""
    if math.isnan(difference.mean):
        return ""
    if math.isnan(difference.low) or math.isnan(difference.high):
        return "no interval"
    if difference.relative:
        return _minus(f"[{_bound(difference.low)}, {_bound(difference.high)}]")
    return measured_interval(difference.low, difference.high)


def total(value: float, column: str) -> str:
    """Return a sum of steps without decimals, or one of returns with about four figures."""
    return whole(value) if column == "steps" else measured(value)


def mean_of(value: float, column: str) -> str:
    """Return a mean of steps with one decimal, or one of returns with about four figures."""
    return _minus(f"{value:,.1f}") if column == "steps" and not math.isnan(value) else measured(value)


def signed(value: float) -> str:
    """Return a number of a percentage with its sign, without decimals from 10 on."""
    return _minus(f"{value:+.0f}" if abs(value) >= 9.95 else f"{value:+.1f}") if abs(value) >= 0.05 else "0"


def tick(value: float) -> str:
    """Return an axis's number with its sign."""
    return _minus(f"{value:+g}") if value else "0"


def number(value: float) -> str:
    """Return a number with three digits; a dash where there is none."""
    return NOTHING if math.isnan(value) else _minus(f"{value + 0.0:.3g}")


def percent(part: float) -> str:
    """Return a part of 1 in percent, never rounded to all or nothing unless it is."""
    if math.isnan(part):
        return NOTHING
    if 0 < part < 0.0005:
        return "less than 0.1 %"
    return "more than 99.9 %" if 0.9995 <= part < 1 else f"{100 * part:.3g} %"


def percents(parts: FloatArray) -> str:
    """Return parts of 1 as a list, those after the sixth together."""
    listed = len(parts) if len(parts) <= _LISTED + 1 else _LISTED
    shown = [f"{100 * part:.3g}" if part == 0 or part >= 0.0005 else "<0.1" for part in parts[:listed]]
    text = f"{joined(shown)} %"
    rest = parts[listed:]
    return text if rest.size == 0 else f"{text}, the other {rest.size} together {percent(float(rest.sum()))}"


def joined(parts: Iterable[str]) -> str:
    """Return "a, b and c"."""
    listed = list(parts)
    return " and ".join([", ".join(listed[:-1]), listed[-1]]) if len(listed) > 1 else "".join(listed)


def span(values: FloatArray) -> str:
    """Return "from 1 to 2" of finite numbers, or "1" if all are alike."""
    low, high = float(values.min()), float(values.max())
    return number(low) if low == high else f"from {number(low)} to {number(high)}"


def typed(value: float) -> str:
    """Return a number with four digits as terminals show it: with a plain hyphen for minus."""
    return f"{value:.4g}" if abs(value) < 1000 else f"{value:,.1f}"


def _rounded(part: float) -> float:
    return round(100 * part, 1) + 0.0  # no minus zero


def _bound(part: float) -> str:
    # A bound's sign decides the verdict beside it, so it is not rounded away.
    value = 100 * part
    return f"{value:.3f}" if 0.0005 <= abs(value) < 0.05 else f"{_rounded(part):.1f}"


def _minus(text: str) -> str:
    return text.replace("-", "\N{MINUS SIGN}")
