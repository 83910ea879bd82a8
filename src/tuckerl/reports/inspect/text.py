"""Numbers in the words of captions."""

import math
from collections.abc import Iterable

from tuckerl.reports.text import NOTHING
from tuckerl.types import FloatArray

_LISTED = 6


def number(value: float) -> str:
    """Return a number with three digits; a dash where there is none."""
    return NOTHING if math.isnan(value) else f"{value + 0.0:.3g}".replace("-", "\N{MINUS SIGN}")


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
