"""The whole maze experiment, from a command on an installed package to its report."""

import subprocess
import sys
import tempfile

from benchmarks.timing import Row, seconds


def rows() -> list[Row]:
    """Time ``tuckerl reproduce dyna-maze`` in full, in a fresh process, on all cores."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tuckerl", "reproduce", "dyna-maze", "--out", folder]
        full = seconds(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))
    return [Row("reproduce dyna-maze, 250 runs x 7 variants", "experiment", full, "-", None, None)]
