"""The command as a user meets it: exit status, one sentence on standard error, files in the folder."""

import json
import os
import re
import runpy
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest

import tuckerl
from tuckerl.cli import main


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tuckerl", *arguments], capture_output=True, text=True, check=False, cwd=cwd
    )


@pytest.mark.slow
@pytest.mark.compiled
def test_a_small_study_from_the_command_line(tmp_path: Path) -> None:
    done = run("reproduce", "dyna-maze", "--quick", "--runs", "2", "--episodes", "20", "--workers", "2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # no progress bar where there is no terminal
    folder = tmp_path / "results" / "quick"
    claims = json.loads((folder / "claims.json").read_text())
    assert [claim["id"] for claim in claims] == ["C3", "C4", "C5", "C6", "C9"]
    assert re.search(r"^ C3  (holds|does not hold|not decided) ", done.stdout, re.MULTILINE)
    assert "<html" in (folder / "report.html").read_text()
    for name in ("fig10", "fig11"):
        assert (folder / "figures" / f"{name}.svg").stat().st_size > 1000
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
    first = (folder / "runs.parquet").read_bytes()
    again = run("reproduce", "dyna-maze", "--quick", "--runs", "2", "--episodes", "20", "--workers", "1", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert (folder / "runs.parquet").read_bytes() == first
    other = run("reproduce", "dyna-maze", "--quick", "--runs", "2", "--episodes", "21", cwd=tmp_path)
    assert other.returncode == 2
    assert re.fullmatch(r"tuckerl: .*episodes is 20 there and 21 now.*--overwrite\n", other.stderr)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["reproduce", "dyna-mase"], "unknown scenario 'dyna-mase': did you mean 'dyna-maze'?"),
        (["reproduce", "--runs", "0"], "runs must be a whole number of at least 1; got 0"),
        (["reproduce", "--runs", "many"], "--runs must be a whole number, such as --runs 100; got 'many'"),
        (["reproduce", "--episodes", "-3"], "episodes must be a whole number of at least 1; got -3"),
        (["reproduce", "--workers", "0"], "workers must be a whole number of at least 1; got 0"),
        (["reproduce", "--seed", "-1"], "seed must be a whole number of at least 0; got -1"),
        (["reproduce", "--quik"], "--quik"),
        (["reproduse"], "reproduse"),
        (["reproduce", "--out", "file/results"], "cannot make the folder file/results"),
    ],
)
def test_wrong_input_is_one_sentence_and_status_2(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("tuckerl: ")
    assert shown.err.count("\n") == 1
    assert message in shown.err


@pytest.mark.parametrize("arguments", [["--help"], ["reproduce", "--help"], ["-h"]])
def test_help(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 0
    assert "Usage" in capsys.readouterr().out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"tuckerl {tuckerl.__version__}\n"


def test_the_package_is_the_command_and_can_be_imported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["tuckerl", "--version"])
    with pytest.raises(SystemExit):
        runpy.run_module("tuckerl", run_name="__main__")
    assert capsys.readouterr().out == f"tuckerl {tuckerl.__version__}\n"
    runpy.run_module("tuckerl.__main__", run_name="imported")  # as worker processes do
    assert capsys.readouterr().out == ""


@pytest.mark.slow
@pytest.mark.compiled  # it waits for the first of the paper's runs
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="signals reach process groups on POSIX only")
def test_ctrl_c_keeps_what_is_finished(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "tuckerl",
        "reproduce",
        "dyna-maze",
        "--runs",
        "500",
        "--workers",
        "2",
        "--out",
        "out",
    ]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            deadline = time.monotonic() + 120
            while not list(tmp_path.glob("out/parts/*.part")):  # the first write
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.1)
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of its processes
            _, err = process.communicate(timeout=60)
        finally:
            process.kill()  # or the block would wait for all of its work
    assert process.returncode == 130
    assert err == "tuckerl: interrupted: what is finished is kept, the same command goes on from there\n"
    runs = pl.read_parquet(tmp_path / "out" / "runs.parquet")
    episodes = runs.group_by("variant", "instance", "run", "agent").len()["len"]
    assert set(episodes) == {100}, "only whole runs are kept"
    assert not list((tmp_path / "out").glob(".*"))
