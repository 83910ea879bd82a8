import json
from pathlib import Path

import pytest

from tests.cli.test_train import status_of
from tuckerl.cli.settings import parse_searches
from tuckerl.errors import ParameterError
from tuckerl.studies.search_space import Choices, Range
from tuckerl.training.schedules import Linear


def test_tuning_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "lake"
    budget = ("--trials", "2", "--batch", "2", "--rungs", "1", "--runs", "2", "--episodes", "10", "--workers", "1")
    words = ("tune", "q-learning", "FrozenLake-v1", "--search", "ties=first,random", "--set", "alpha=0.5", *budget)
    assert status_of(*words, "--out", str(folder)) == 0
    out = capsys.readouterr().out
    assert out.startswith("Of 2 trials of q-learning, q-learning[epsilon=")
    assert out.endswith(f"Report: {folder / 'report.html'}\n")
    tuned = json.loads((folder / "tune.json").read_text())
    assert tuned["searches"][0]["searched"] == {"epsilon": "0.01:0.5:log", "ties": "first,random"}
    assert tuned["searches"][0]["fixed"] == {"alpha": "0.5"}
    assert status_of("study", "status", str(folder)) == 0
    told = capsys.readouterr()
    assert told.out == "FrozenLake-v1: tuning, runs: 1\t2\t2 of 2\t0\nFrozenLake-v1: test\t2\t4 of 4\t0\n"
    assert told.err == f"Of 2 trials of q-learning, {tuned['searches'][0]['winner']} was best.\n"
    (folder / "tune.json").unlink()
    assert status_of("study", "status", str(folder)) == 0
    assert capsys.readouterr().err.startswith("The tuning is not finished: it adds trials and rungs as it goes on")
    assert status_of("study", "resume", str(folder)) == 2
    assert "lake holds a study that came from no file: the" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--search", "alpha=0.5:0.1"], "alpha must be searched from a low to a higher number; got 0.5 to 0.1"),
        (["--search", "alpha=0:1:log"], "alpha must be above 0 where ratios are searched (log); got 0 to 1"),
        (["--search", "alpha=x:1"], "--search of a range must be alpha=LOW:HIGH or alpha=LOW:HIGH:log"),
        (["--search", "alhpa=0.1:1"], "did you mean 'alpha'"),
        (
            ["--runs", "10000000"],
            "and its test: these are 30,000,810 runs; if that is meant, give --yes",
        ),
        (["--trials", "0"], "trials must be a whole number of at least 1; got 0"),
        (["--cluster", "tcp://127.0.0.1:1", "--workers", "2"], "give one of the two"),
        (["--rungs", "2,x"], "--rungs must be whole numbers with commas between them; got '2,x'"),
    ],
)
def test_wrong_input_is_one_sentence_and_status_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert status_of("tune", "q-learning", "FrozenLake-v1", "--out", str(tmp_path / "none"), *arguments) == 2
    shown = capsys.readouterr().err
    assert message in shown
    assert shown.count("\n") == 1
    assert not (tmp_path / "none").exists()


def test_a_cluster_that_is_not_there_is_said(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ("tune", "q-learning", "FrozenLake-v1", "--out", str(tmp_path / "none"), "--cluster", "tcp://127.0.0.1:1")
    assert status_of(*words) == 2
    assert "tuckerl: no Dask scheduler answers at tcp://127.0.0.1:1 (" in capsys.readouterr().err


def test_ranges_and_choices_are_read() -> None:
    texts = ("alpha=0.1:1:log", "every=2:9", "share=max, min", "ranks=(2,2,2,1),auto,0.9", "epsilon=Linear(1,0,9),0.1")
    assert parse_searches(texts) == {
        "alpha": Range(0.1, 1, log=True),
        "every": Range(2, 9),
        "share": Choices(("max", "min")),
        "ranks": Choices(((2, 2, 2, 1), "auto", 0.9)),
        "epsilon": Choices((Linear(1, 0, 9), 0.1)),
    }


@pytest.mark.parametrize(
    "text", ["alpha", "alpha=", "=1:2", "alpha=1:2:lin", "alpha=1:2:log:3", "alpha=true:2", "alpha=1,,2", "alpha=1,1"]
)
def test_what_is_neither_a_range_nor_choices_is_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="--search"):
        parse_searches([text])


def test_a_name_is_searched_once() -> None:
    with pytest.raises(ParameterError, match="--search must be given alpha once"):
        parse_searches(["alpha=1:2", "alpha=2:3"])
