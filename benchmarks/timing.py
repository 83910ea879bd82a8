"""Timing two pieces of work in turn, and saying how they compare."""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple


class Row(NamedTuple):
    """One comparison: seconds a unit of ours and of the peer's, and how many times faster ours is."""

    what: str
    unit: str
    ours: float
    peer_name: str
    peer: float | None  # None where the peer could not be run; `peer_name` says why
    ratio: float | None


def seconds(work: Callable[[], object]) -> float:
    """Return how long one call takes."""
    before = time.perf_counter()
    work()
    return time.perf_counter() - before


@contextmanager
def replaced(thing: Any, name: str, value: Any) -> Iterator[None]:
    """Put something in the place of what a module or a class has under a name while the block lasts."""
    original = getattr(thing, name)
    setattr(thing, name, value)
    try:
        yield
    finally:
        setattr(thing, name, original)


def compare(
    what: str,
    unit: str,
    ours: Callable[[], object],
    peer_name: str,
    peer: Callable[[], object],
    *,
    units: float = 1.0,
    peer_units: float | None = None,
    repeats: int = 7,
) -> Row:
    """Time both in turn after one call each, and return medians and the median of the paired ratios.

    `units` is how many units of work a call of ours does, `peer_units` one of the peer's (default: the same).
    """
    ours(), peer()
    pairs = [(seconds(ours) / units, seconds(peer) / (peer_units or units)) for _ in range(repeats)]
    return Row(
        what,
        unit,
        statistics.median(a for a, _ in pairs),
        peer_name,
        statistics.median(b for _, b in pairs),
        statistics.median(b / a for a, b in pairs),
    )


def table(rows: list[Row]) -> str:
    """Return the rows as text."""
    head = f"{'what':<44} {'unit':<14} {'tuckerl':>10}   {'peer':<28} {'its time':>10} {'times faster':>13}"
    lines = [head, "-" * len(head)]
    for row in rows:
        peer = "-" if row.peer is None else duration(row.peer)
        ratio = "-" if row.ratio is None else f"{row.ratio:.2f}" if row.ratio < 10 else f"{row.ratio:.0f}"
        lines.append(
            f"{row.what:<44} {row.unit:<14} {duration(row.ours):>10}   {row.peer_name:<28} {peer:>10} {ratio:>13}"
        )
    return "\n".join(lines)


def duration(value: float) -> str:
    """Return a time in words, with three digits."""
    for scale, name in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if value >= scale:
            return f"{value / scale:.3g} {name}"
    return f"{value / 1e-9:.3g} ns"
