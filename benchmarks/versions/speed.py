"""How fast kernels of two versions are, timed in turn."""

import json
import statistics
import subprocess
import sys
from types import TracebackType
from typing import NamedTuple, Self

from benchmarks.versions.rows import rows
from benchmarks.versions.trees import Tree, both, command, environment


class Worker:
    """A process of one version, which imports and compiles once; see `worker`."""

    def __init__(self, tree: Tree) -> None:
        arguments = command("benchmarks.versions.worker")
        self._process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(tree)
        )

    def time(self, name: str) -> tuple[float, int]:
        """Return the seconds and the steps of one repetition of a row."""
        if self._process.stdin is None or self._process.stdout is None:
            raise RuntimeError("the process was started without pipes")
        self._process.stdin.write(f"{name}\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            sys.exit(f"the worker ended at {name}")
        seconds, steps = json.loads(answer)
        return seconds, steps

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait()


class Times(NamedTuple):
    """Seconds of both versions in each round."""

    old: list[float]
    new: list[float]

    def line(self, steps: int) -> str:
        """Return both minima in ns a step, their ratio, and the median and quartiles of the paired ratios."""
        ratios = [new / old for old, new in zip(self.old, self.new, strict=True)]
        low, middle, high = statistics.quantiles(ratios, method="inclusive") if len(ratios) > 1 else ratios * 3
        old, new = (min(times) / steps * 1e9 for times in self)
        return f"{old:>10.2f} {new:>10.2f} {new / old:>9.3f} {middle:>15.3f}   {low:.3f} to {high:.3f}"


def compare(old_commit: str, rounds: int, words: str = "") -> None:
    """Print a line for each row that holds `words`."""
    old, new = both(old_commit)
    print(f"{'ns a step, least':<48} {'old':>10} {'new':>10} {'new/old':>9} {'median of pairs':>15}   quartiles")
    with Worker(old) as before, Worker(new) as after:
        for name in rows():
            if words.lower() in name.lower():
                print(f"{name:<48} {_row(before, after, name, rounds)}", flush=True)


def _row(before: Worker, after: Worker, name: str, rounds: int) -> str:
    steps = [worker.time(name)[1] for worker in (before, after)]  # these warm up
    if steps[0] != steps[1]:
        return f"DIFFERS: {steps[0]} steps in the old version, {steps[1]} in the new"
    times = Times([], [])
    for _ in range(rounds):
        times.old.append(before.time(name)[0])
        times.new.append(after.time(name)[0])
    return times.line(steps[0])
