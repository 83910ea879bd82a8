"""Warn where a kernel is slower against the same loop in C than it was: ``python -m benchmarks.guard [--write]``.

Both are timed in turn in one process, several times, and of each the least counts, as what else the machine does only
adds to a time. `guard.json` has what the ratios were when somebody last looked, and ``--write`` writes it anew. A
slower kernel is no error: it is a line to read.
"""

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks import kernels, steps, traces
from benchmarks.timing import Row

KEPT = Path(__file__).with_suffix(".json")
LOSS, ROUNDS = 0.15, 5
_BENCHMARKS = (kernels, steps, traces)


def main(*, write: bool) -> None:
    """Compare today's ratios with those that are kept, or keep them."""
    rounds = [[row for benchmark in _BENCHMARKS for row in benchmark.against_c()] for _ in range(ROUNDS)]
    found = {_name(rows[0]): _ratio(rows) for rows in zip(*rounds, strict=True) if rows[0].peer is not None}
    if not found:
        print("No compiler for C was found: there is nothing to compare with.")
    elif write:
        KEPT.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", "utf-8")
    else:
        print("\n".join(lines(found, json.loads(KEPT.read_text("utf-8")))))


def lines(found: dict[str, float], kept: dict[str, float]) -> list[str]:
    """Return a line for each kernel: its ratio today, the one that is kept, and a warning where it lost too much."""
    return [
        f"{name:<70} {ratio:5.2f} (was {kept.get(name, float('nan')):.2f})"
        + ("   WARNING: slower than it was" if ratio < (1 - LOSS) * kept.get(name, 0.0) else "")
        for name, ratio in found.items()
    ]


def _ratio(rows: Sequence[Row]) -> float:
    """Return the peer's least time over ours."""
    return round(min(row.peer or math.inf for row in rows) / min(row.ours for row in rows), 2)


def _name(row: Row) -> str:
    return f"{row.what} against {row.peer_name}"


if __name__ == "__main__":
    main(write="--write" in sys.argv[1:])
