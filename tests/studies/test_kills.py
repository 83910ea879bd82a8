"""A study that is killed at random moments, again and again, loses nothing that it said was finished."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tests.studies.small_study import SMALL
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.store import Store

ROOT = Path(__file__).parents[2]
TABLES = ("runs.parquet", "weights.parquet", "paths.parquet")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name == "nt", reason="processes are killed otherwise there"),
]


def killed(folder: Path, workers: int, words: int, seconds: float) -> tuple[int, bool]:
    """Play the study, kill it so many words and seconds later; return what it said last, and whether it ended."""
    command = [sys.executable, "-m", "tests.studies.small_study", str(folder), str(workers)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        assert process.stdout is not None
        said = [process.stdout.readline() for _ in range(words)]
        assert said[0], process.stderr.read() if process.stderr else ""
        with suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        with suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGKILL)
        said += process.stdout.read().splitlines(keepends=True)
        whole = [line for line in said if line.endswith("\n")]  # the last one may have been cut off
        return int(whole[-1].split()[0]), process.wait() == 0


@pytest.mark.parametrize(
    ("workers", "times"),
    [
        (1, 8),
        (2, 2),
        pytest.param(1, 500, marks=pytest.mark.long),
        pytest.param(2, 500, marks=pytest.mark.long),
    ],
)
def test_a_study_that_is_killed_loses_nothing(workers: int, times: int, tmp_path: Path) -> None:
    run_study(SMALL, tmp_path / "straight", workers=1)
    whole = {name: (tmp_path / "straight" / name).read_bytes() for name in TABLES}
    rnd, left, study = np.random.default_rng(workers), times, 0
    while left > 0:
        folder, study = tmp_path / f"killed {study}", study + 1
        ended = False
        while not ended:
            # Every other time at the very moment when it has said something.
            words, seconds = (int(rnd.integers(1, 8)), 0.0) if left % 2 else (1, rnd.uniform(0.0, 0.4))
            said, ended = killed(folder, workers, *((words, seconds) if left > 0 else (1, 60.0)))
            left -= not ended
            deadline = time.monotonic() + 5.0
            while True:  # its workers end with it
                try:
                    with Store(folder, SMALL) as store:
                        finished = len(store.finished())
                    break
                except Exception:
                    if time.monotonic() > deadline:
                        raise
                    time.sleep(0.05)
            assert finished >= said
            assert not list(folder.glob("parts/.*"))
        for name in TABLES:
            assert (folder / name).read_bytes() == whole[name]
