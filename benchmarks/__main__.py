"""Run all benchmarks, or those named: ``python -m benchmarks kernels traces``."""

import importlib
import sys

from benchmarks.timing import table

BENCHMARKS = (
    "steps",
    "parts",
    "kernels",
    "planning",
    "traces",
    "toy_text",
    "decomposition",
    "windows",
    "sharing",
    "stepping",
    "n_step",
    "solving",
    "first_result",
    "cluster",
    "experiment",
)

if __name__ == "__main__":
    unknown = set(sys.argv[1:]) - set(BENCHMARKS)
    if unknown:
        sys.exit(f"unknown benchmark {min(unknown)!r}: choose from {', '.join(BENCHMARKS)}")
    for name in sys.argv[1:] or BENCHMARKS:
        print(f"\n{name}")
        print(table(importlib.import_module(f"benchmarks.{name}").rows()), flush=True)
