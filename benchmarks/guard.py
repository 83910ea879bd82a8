"""Warn where a kernel is slower against the same loop in C than it was: ``python -m benchmarks.guard [--write]``.

Both are timed in turn in one process, several times, and of each the least counts, as what else the machine does only
adds to a time. `guard.json` has what the ratios were when somebody last looked, and ``--write`` writes it anew. What is
slower is timed again, with what is beside it in its benchmark, and warned of if it is so each time; other kinds of
processors have other ratios. A slower kernel is no error: it is a line to read.
"""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks import kernels, n_step, planning, steps, team, traces
from benchmarks.timing import Row

KEPT = Path(__file__).with_suffix(".json")
LOSS, ROUNDS, TRIES = 0.15, 2, 2
_BENCHMARKS = (kernels, steps, traces, n_step, planning, team)


def main(*, write: bool) -> None:
    """Compare today's ratios with those that are kept, or keep them."""
    kept = {} if write else json.loads(KEPT.read_text("utf-8"))
    found = ratios(kept)
    if not found:
        print("No compiler for C was found: there is nothing to compare with.")
    elif write:
        KEPT.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", "utf-8")
    else:
        print("\n".join(lines(found, kept)))


def ratios(kept: Mapping[str, float]) -> dict[str, float]:
    """Return how many times a peer's least time is ours, for each kernel and peer; nothing without a compiler for C.

    A benchmark in which something is slower than `kept` says is timed up to `TRIES` times, and the best ratio counts.
    """
    found: dict[str, float] = {}
    for benchmark in _BENCHMARKS:
        own = _timed(benchmark, ROUNDS if kept else ROUNDS * TRIES)
        for _ in range(TRIES - 1):
            if lost(own, kept):
                again = _timed(benchmark, ROUNDS)
                own = {name: max(ratio, again[name]) for name, ratio in own.items()}
        found |= own
    return found


def _timed(benchmark: Any, n_rounds: int) -> dict[str, float]:
    rounds = [benchmark.against_c() for _ in range(n_rounds)]
    return {_name(rows[0]): _ratio(rows) for rows in zip(*rounds, strict=True) if rows[0].peer is not None}


def lost(found: Mapping[str, float], kept: Mapping[str, float]) -> set[str]:
    """Return the names of what is slower than it was by more than `LOSS`."""
    return {name for name, ratio in found.items() if ratio < (1 - LOSS) * kept.get(name, 0.0)}


def lines(found: Mapping[str, float], kept: Mapping[str, float]) -> list[str]:
    """Return a line for each kernel: its ratio today, the one that is kept, and a warning where it lost too much."""
    slower = lost(found, kept)
    return [
        f"{name:<70} {ratio:5.2f} (was {kept.get(name, float('nan')):.2f})"
        + ("   WARNING: slower than it was" if name in slower else "")
        for name, ratio in found.items()
    ]


def _ratio(rows: Sequence[Row]) -> float:
    """Return the peer's least time over ours."""
    return round(min(row.peer or math.inf for row in rows) / min(row.ours for row in rows), 2)


def _name(row: Row) -> str:
    return f"{row.what} against {row.peer_name}"


if __name__ == "__main__":
    main(write="--write" in sys.argv[1:])
