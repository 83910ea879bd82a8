"""What playing a study adds to its runs, and what a second worker takes off, with and without a tensor step.

All are timed from the call of `run_study` to its tables, workers being started and results being stored. The bare runs
are the same learners in a loop. Threads, which studies do not use, are timed as well: the tensor step is mostly
Python, for which they wait for each other.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.timing import Row, compare, seconds
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.playing import play_run, warm_up
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.runs import Run, all_runs
from tuckerl.studies.study import Study

LENGTH = 0.05  # seconds that a run is to take
N_BARE, N_WORKERS, N_THREADS = 1_000, 300, 60  # runs


def rows() -> list[Row]:
    """Time runs of 50 ms: 1,000 in a study and in a loop, and fewer on one and on two workers, and on threads."""
    found: list[Row] = []
    for name in ("dyna-h", "dyna-ht-1"):
        study = _study(name, N_BARE)
        found += [
            _beside_bare_runs(f"{name}, {N_BARE:,} runs in a study", study),
            _two_workers(f"{name}, two workers", _first(study, N_WORKERS)),
            _two_threads(f"{name}, two threads", _first(study, N_THREADS)),
        ]
    return [*found, _start_up("two workers in a new process, no runs")]


def _study(name: str, n_runs: int) -> Study:
    """Return a study of one variant in one maze, whose runs have as many episodes as take a twentieth of a second."""
    own = {"variants": (DYNA_MAZE.variant(name),), "n_instances": 1, "n_runs": n_runs, "record_paths_of": ()}
    study = Study((replace(DYNA_MAZE, **own, n_episodes=200),), seed=0)  # type: ignore[arg-type]  # as they are named
    with threadpool_limits(1):
        warm_up(study)
        took = min(_processor_time(partial(play_run, study, run)) for run in all_runs(study)[:5])
    episodes = max(10, round(200 * LENGTH / took))
    return replace(study, scenarios=(study.scenarios[0].resized(n_episodes=episodes),))


def _first(study: Study, n_runs: int) -> Study:
    return replace(study, scenarios=(study.scenarios[0].resized(n_runs=n_runs),))


def _play(study: Study, workers: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run_study(study, Path(folder), workers=workers)


def _bare(study: Study) -> None:
    scenario = study.scenarios[0]
    (variant,), problem = scenario.variants, scenario.problem(0)
    with threadpool_limits(1):
        for run in all_runs(study):
            variant.make(problem, study.run_seed(scenario, 0, run.run)).learn(episodes=scenario.n_episodes)


def _beside_bare_runs(what: str, study: Study) -> Row:
    """Time them once each, in processor time: nobody else is counted, and a thousand runs vary little."""
    _bare(_first(study, 5))
    _play(_first(study, 5), 1)
    ours, bare = _processor_time(partial(_play, study, 1)), _processor_time(partial(_bare, study))
    return Row(what, "run, CPU", ours / N_BARE, "the bare runs", bare / N_BARE, bare / ours)


def _two_workers(what: str, study: Study) -> Row:
    one, two = partial(_play, study, 1), partial(_play, study, 2)
    return compare(what, "run", two, "one worker", one, units=N_WORKERS, repeats=3)


def start(workers: int) -> None:
    """Print how long the first study of a process takes whose four runs take almost nothing."""
    study = Study((_study("dyna-ht-1", 4).scenarios[0].resized(n_episodes=10),), seed=0)
    print(seconds(partial(_play, study, workers)))


def _start_up(what: str) -> Row:
    def took(workers: int) -> float:
        command = [sys.executable, "-c", f"from benchmarks.studies import start; start({workers})"]
        return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    pairs = [(took(2), took(1)) for _ in range(3)]
    two, one = (statistics.median(each) for each in zip(*pairs, strict=True))
    return Row(what, "study", two, "one worker", one, one / two)


def _two_threads(what: str, study: Study) -> Row:
    runs = all_runs(study)

    def play(n_threads: int) -> None:
        with threadpool_limits(1), ThreadPoolExecutor(n_threads) as threads:
            list(threads.map(partial(_played, study), runs))

    return compare(what, "run", partial(play, 2), "one thread", partial(play, 1), units=N_THREADS, repeats=3)


def _played(study: Study, run: Run) -> None:
    play_run(study, run)


def _processor_time(work: Callable[[], object]) -> float:
    before = time.process_time()
    work()
    return time.process_time() - before
