import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
import pytest

from tests.cli import pennies_world
from tuckerl.cli import main
from tuckerl.reports import live_view
from tuckerl.studies.run_progress import RunProgress

MAZE = ["--env", "tuckerl/DynaMaze-v0", "--env-set", "rows=6", "--env-set", "columns=9", "--env-set", "goal=0,8"]
SMALL = [*MAZE, "--env-set", "start=2,0", "--episodes", "20"]


def status_of(arguments: list[str]) -> object:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code


def test_a_small_comparison(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["compare", "sarsa-lambda", "tsarsa-lambda", *SMALL, "--runs", "3", "--workers", "1", "--agents", "2"]
    assert status_of([*arguments, "--set", "alpha=0.3"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""  # no progress bar where there is no terminal
    folder = tmp_path / "results" / "compare" / "sarsa-lambda-tsarsa-lambda-tuckerl-DynaMaze-v0"
    assert shown.out.endswith(f"Report: {folder.relative_to(tmp_path)}{os.sep}report.html\n")
    told = json.loads((folder / "compare.json").read_text())
    assert (told["base"], told["candidate"], told["control"]) == ("sarsa-lambda", "tsarsa-lambda-2", "constant-2-min")
    assert told["runs"] == 3
    assert all(entry["regret_low"] <= entry["regret"] <= entry["regret_high"] for entry in told["variants"])
    assert "\nRegret of what was learned in the end, against the optimal values of the first states: " in shown.out
    assert "A regret of 0 is an optimal policy" in (folder / "report.html").read_text()
    assert "<html" in (folder / "report.html").read_text()
    assert (folder / "figures" / "compare.svg").stat().st_size > 1000
    assert (folder / "figures" / "compare.png").stat().st_size > 1000
    assert status_of([*arguments, "--set", "alpha=0.2"]) == 2
    assert "alpha is 0.3 there and 0.2 now" in capsys.readouterr().err
    assert status_of([*arguments, "--set", "alpha=0.2", "--overwrite"]) == 0


def test_ctrl_c_keeps_what_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @contextmanager
    def interrupting(what: str) -> Iterator[Callable[[RunProgress], None]]:
        def report(runs: RunProgress) -> None:
            if runs.n_done >= 1:  # runs are stored twice a second, so that the next may be all
                raise KeyboardInterrupt

        yield report

    arguments = ["compare", "sarsa", "q-learning", *SMALL, "--runs", "4", "--workers", "1", "--out", str(tmp_path)]
    with monkeypatch.context() as patched:
        patched.setattr(live_view, "runs_shown", interrupting)
        assert status_of(arguments) == 130
    shown = capsys.readouterr()
    assert shown.err == "tuckerl: interrupted: what is finished is kept, the same command goes on from there\n"
    assert pl.read_parquet(tmp_path / "runs.parquet").select("run").unique().height < 4
    assert not (tmp_path / "report.html").exists()
    assert status_of(arguments) == 0
    assert pl.read_parquet(tmp_path / "runs.parquet").select("run").unique().height == 4
    assert json.loads((tmp_path / "compare.json").read_text())["no_control"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sarsa", "tsarsa", *SMALL], "unknown algorithm 'tsarsa': did you mean 'tsarsa-lambda'?"),
        (["sarsa", "q-learning", "--env", "tuckerl/DynaMase"], "unknown environment 'tuckerl/DynaMase': did you mean "),
        (["sarsa", "q-learning"], "the environment is given by --env: `tuckerl compare"),
        (["sarsa", *SMALL], "the second algorithm is missing, as in `tuckerl compare"),
        (["sarsa", "q-learning", *SMALL, "--set", "alpha"], "--set must be given NAME=VALUE"),
        (["sarsa", "q-learning", *SMALL, "--set", "alhpa=1"], "has no parameter 'alhpa': did you mean 'alpha'?"),
        (["sarsa", "q-learning", *SMALL, "--set", "alpha=fast"], "alpha must be a number in (0, 1]; got 'fast'"),
        (["sarsa", "q-learning", *SMALL, "--set", "ranks=1,1,1,1"], "ranks belongs to the tensor step"),
        (
            ["sarsa", "q-learning", *SMALL, "--runs", "10000000"],
            "these are 20,000,000 runs; if that is meant, give --yes",
        ),
        (["sarsa", "tq-learning", *SMALL, "--set", "ranks=1,1"], "ranks must be four whole numbers"),
        (["sarsa", "tq-learning", *SMALL, "--set", "share=most"], "unknown share 'most'"),
        (["sarsa", "q-learning", *SMALL, "--env-set", "rowss=6"], "cannot make tuckerl/DynaMaze-v0 with "),
        (["sarsa", "team-q", *SMALL], "team-q plays the joint actions of several agents"),
        (["dyna-h", "dyna-ht", "--env", "tuckerl/CartPole-v0"], "DynaH needs a heuristic"),
        (["sarsa", "q-learning", *SMALL, "--runs", "0"], "runs must be a whole number of at least 1; got 0"),
        (["sarsa", "q-learning", *SMALL, "--agents", "2"], "agents are those of a T-version"),
        (["sarsa", "q-learning", *SMALL, "--workers", "0"], "workers must be a whole number of at least 1; got 0"),
        (["sarsa", "q-learning", *SMALL, "--measure", "speed"], "unknown measure 'speed'"),
        (["sarsa", "q-learning", *SMALL, "--out", "file/results"], "cannot make the folder file/results"),
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
    assert status_of(["compare", *arguments]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("tuckerl: ")
    assert shown.err.count("\n") == 1
    assert message in shown.err


def test_schedules_and_agents_of_opposite_interests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["compare", "sarsa", "q-learning", "--env", f"tests.cli.pennies_world:{pennies_world.ID}"]
    arguments += ["--runs", "2", "--episodes", "10", "--workers", "1", "--out", "pennies", "--measure", "return"]
    assert status_of([*arguments, "--set", "epsilon=Linear(1, 0, 10)", "--set", "base.alpha=Harmonic(0.5, 9)"]) == 0
    lines = capsys.readouterr().out.splitlines()
    runs = pl.read_parquet("pennies/runs.parquet")
    for place, name in enumerate(("sarsa", "q-learning"), start=1):
        mean = float(runs.filter(variant=name, agent=0)["return"].to_numpy().mean())
        assert lines[place] == f"Mean return of {name} by agent: same {mean:.4g}, other {-mean:.4g}"
    variants = json.loads(Path("pennies/study.json").read_text())["scenarios"].popitem()[1]["variants"]
    linear = {"schedule": "Linear", "start": 1.0, "stop": 0.0, "episodes": 10}
    assert [variants[name]["parameters"]["epsilon"] for name in ("sarsa", "q-learning")] == [linear] * 2
    assert variants["sarsa"]["parameters"]["alpha"] == {"schedule": "Harmonic", "start": 0.5, "half_after": 9.0}
    assert status_of([*arguments, "--set", "epsilon=Linear(1, 0, 11)", "--set", "base.alpha=Harmonic(0.5, 9)"]) == 2
    assert "episodes is 10 there and 11 now" in capsys.readouterr().err
    shown = Path("pennies/report.html").read_text()
    assert "Linear(start=1.0, stop=0.0, episodes=10)" in shown
