"""A process of one version that times learners when it is asked: ``python -m benchmarks.versions.worker``.

It reads a row's name in each line and answers with the seconds and the steps of one repetition, as JSON. Before the
first one of a row it makes the problem and does a repetition that nobody sees, so that all is compiled.
"""

import gc
import json
import sys
import time
import warnings

from benchmarks.versions import load
from benchmarks.versions.names import made
from benchmarks.versions.rows import Row, rows
from benchmarks.versions.trees import check_source

_MOST = 2  # so many are kept, as a base and its T-version take turns


class Bench:
    """One row: its problem, and a learner that is new each time."""

    def __init__(self, row: Row) -> None:
        self._row, self._problem = row, row.world()

    def repetition(self) -> tuple[float, int]:
        """Let a new learner learn; return the processor seconds of that, and its steps."""
        learner = made(self._row.kind, self._problem, seed=0, **self._row.parameters)
        gc.collect()
        gc.disable()
        before = time.process_time()
        learner.learn(self._row.episodes)
        seconds = time.process_time() - before
        gc.enable()
        return seconds, int(learner.steps.sum())


def main() -> None:
    """Answer until there are no more lines."""
    check_source()
    warnings.simplefilter("ignore")
    known = rows() | load.rows()
    benches: dict[str, Bench] = {}
    for line in sys.stdin:
        name = line.strip()
        if name not in benches:
            if len(benches) == _MOST:
                benches = {}  # let go of those before
            benches[name] = Bench(known[name])
            benches[name].repetition()
        print(json.dumps(benches[name].repetition()), flush=True)


if __name__ == "__main__":
    main()
