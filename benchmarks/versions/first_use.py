"""How long the first use of a learner takes: with nothing compiled yet, and with what the first process has kept.

Each time is processor time of a fresh process, from the learner's class to its first episode; importing `tuckerl` and
making the problem come before. ``python -m benchmarks.versions.first_use KIND`` is such a process.
"""

import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import tuckerl
from benchmarks.versions.names import made
from benchmarks.versions.trees import Tree, both, check_source, command, environment


class Use(NamedTuple):
    """A learner on a problem, and whether it is the first `evaluate` that is timed, after learning."""

    learner: str
    problem: Callable[[], Any]
    parameters: dict[str, Any]
    evaluates: bool = False


KINDS = {
    "QLearning": Use("QLearning", tuckerl.sutton_maze, {}),
    "SarsaLambda": Use("SarsaLambda", tuckerl.sutton_maze, {}),
    "SarsaLambda, MountainCar": Use("SarsaLambda", lambda: "MountainCar-v0", {"bins": 20}),
    "DynaH": Use("DynaH", tuckerl.sutton_maze, {}),
    "TeamQ": Use("TeamQ", tuckerl.robot_rescue, {}),
    "evaluate, Taxi": Use("QLearning", lambda: "Taxi-v4", {}, evaluates=True),
}


def compare(old_commit: str, rounds: int, words: str = "") -> None:
    """Print the least seconds of both versions for each learner whose name holds `words`."""
    trees = both(old_commit)
    print(f"{'seconds, least':<26} {'old':>8} {'new':>8} {'new/old':>9}     {'kept: old':>9} {'new':>8} {'new/old':>9}")
    for kind in KINDS:
        if words.lower() in kind.lower():
            rows = [[_times(tree, kind) for tree in trees] for _ in range(rounds)]
            compiled, kept = ([min(row[tree][which] for row in rows) for tree in (0, 1)] for which in (0, 1))
            print(f"{kind:<26} {_columns(*compiled)}     {_columns(*kept)}", flush=True)


def _columns(old: float, new: float) -> str:
    return f"{old:>8.2f} {new:>8.2f} {new / old:>9.3f}"


def _times(tree: Tree, kind: str) -> tuple[float, float]:
    """Return the seconds of a first process, whose compiled code is kept, and of a second one, which finds it."""
    with tempfile.TemporaryDirectory() as cache:
        variables = environment(tree, Path(cache))
        arguments = command("benchmarks.versions.first_use", kind)
        first, second = (
            float(subprocess.run(arguments, check=True, env=variables, cwd=cache, stdout=subprocess.PIPE).stdout)
            for _ in range(2)
        )
    return first, second


def main(kind: str) -> None:
    """Use a learner and print the processor seconds that it took."""
    check_source()
    warnings.simplefilter("ignore")
    use = KINDS[kind]
    problem = use.problem()
    before = time.process_time()
    learner = made(use.learner, problem, seed=0, **use.parameters).learn(1)
    if use.evaluates:
        before = time.process_time()
        learner.evaluate(1)
    print(time.process_time() - before)


if __name__ == "__main__":
    main(sys.argv[1])
