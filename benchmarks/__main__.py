"""Run all benchmarks, or those named: ``python -m benchmarks kernels traces``.

With ``--out FILE``, what was measured is kept there as JSON, beside what the file has of other benchmarks.
"""

import argparse
import importlib
import json
from pathlib import Path

from benchmarks.timing import table

BENCHMARKS = (
    "steps",
    "parts",
    "kernels",
    "planning",
    "traces",
    "team",
    "outcomes",
    "toy_text",
    "decomposition",
    "windows",
    "sharing",
    "stepping",
    "n_step",
    "solving",
    "first_result",
    "cluster",
    "studies",
    "large_study",
    "experiment",
)


def main() -> None:
    """Run what the command line names, and print a table of each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHMARKS)}; default: all")
    parser.add_argument("--out", type=Path, help="a file for what was measured")
    given = parser.parse_args()
    if unknown := set(given.names) - set(BENCHMARKS):
        parser.error(f"unknown benchmark {min(unknown)!r}: choose from {', '.join(BENCHMARKS)}")
    for name in given.names or BENCHMARKS:
        print(f"\n{name}")
        rows = list(importlib.import_module(f"benchmarks.{name}").rows())
        print(table(rows), flush=True)
        if given.out:  # after each, as all take long
            kept = json.loads(given.out.read_text("utf-8")) if given.out.exists() else {}
            kept[name] = [row._asdict() for row in rows]
            given.out.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
