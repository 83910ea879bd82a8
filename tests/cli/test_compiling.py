import os
import subprocess
import sys
from pathlib import Path

import pytest

from tuckerl._jit import kernel
from tuckerl.cli.compiling import compiling_said


def compile_something() -> None:
    @kernel
    def more(number: float) -> float:
        return number + 1

    more(1.0)


@pytest.mark.compiled
def test_compiling_is_said_on_a_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with compiling_said():
        compile_something()
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with compiling_said():
        pass
    assert capsys.readouterr().err == ""
    with compiling_said():
        compile_something()
    assert capsys.readouterr().err == "Compiling kernels: some seconds, the first time only\n"


_TWICE = """
import sys
import tuckerl
from tuckerl.cli.compiling import compiling_said
sys.stderr.isatty = lambda: True
with compiling_said():
    tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(5)
"""


@pytest.mark.long
@pytest.mark.compiled
def test_compiling_is_said_by_the_first_process_alone(tmp_path: Path) -> None:
    said = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", _TWICE],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
            check=True,
            capture_output=True,
            text=True,
        )
        said.append(done.stderr.count("Compiling kernels"))
    assert said == [1, 0]
