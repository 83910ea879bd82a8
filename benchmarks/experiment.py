"""The paper's experiments in full, from a command on an installed package to the report."""

import subprocess
import sys
import tempfile

from benchmarks.timing import Row, seconds


def rows() -> list[Row]:
    """Time ``tuckerl reproduce`` in full, in a fresh process, on all cores: the maze alone, and everything."""
    return [_row("dyna-maze"), _row("all")]


def _row(scenario: str) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tuckerl", "reproduce", scenario, "--out", folder]
        full = seconds(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))
    return Row(f"tuckerl reproduce {scenario}", "to the report", full, "-", None, None)
