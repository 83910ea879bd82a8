import io
import sys
from pathlib import Path

import polars as pl
import pytest

from tests.cli.test_train import status_of
from tests.studies.study_texts import LAKE, changed
from tuckerl.reports.study import Study, StudyReport
from tuckerl.studies.planned import file_of


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lake.toml").write_text(LAKE)
    monkeypatch.setattr(sys, "stdin", io.StringIO())


@pytest.mark.slow
def test_a_study_from_its_file_to_its_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of("study", "status", "lake.toml") == 0
    assert capsys.readouterr().out.splitlines()[0] == "lake\tbase\t0 of 3\t0\t\N{EN DASH}"
    assert status_of("study", "run", "lake.toml", "--workers", "1") == 0
    folder, out = Path("results/study/lake"), capsys.readouterr().out
    assert out.endswith(f"Report: {folder / 'report.html'}\n")
    assert "t[alpha=0.1]" in out.splitlines()[0]
    before = (folder / "runs.parquet").read_bytes()
    Path("lake.toml").unlink()  # the folder needs nothing else
    for command in ("resume", "report"):
        (folder / "report.html").unlink()
        assert status_of("study", command, str(folder)) == 0
        assert capsys.readouterr().out == out
        assert (folder / "report.html").exists()
    assert (folder / "runs.parquet").read_bytes() == before
    assert status_of("study", "status", str(folder)) == 0
    told = capsys.readouterr()
    assert [line.split("\t")[:4] for line in told.out.splitlines()] == [
        ["lake", name, "3 of 3", "0"] for name in ("base", "t[alpha=0.1]", "t[alpha=0.2]", "t[alpha=0.1]-constant")
    ]
    assert told.err == "Study of 1 problem, 4 variants and 12 runs\n"
    assert status_of("study", "export", str(folder), "--format", "parquet") == 0
    assert capsys.readouterr().out == f"Table: {folder / 'export.parquet'}\n"
    assert pl.read_parquet(folder / "export.parquet").height == 4 * 3 * 20


def test_the_papers_files_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of("study", "paper", "dyna-maze") == 0
    assert capsys.readouterr().out == file_of("dyna-maze")
    assert status_of("study", "paper", "dyna-mace") == 2
    assert capsys.readouterr().err == "tuckerl: unknown scenario 'dyna-mace': did you mean 'dyna-maze'?\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "wrong.toml"], "wrong.toml, line 1: unknown key 'rns': did you mean 'runs'?"),
        (["status", "wrong.toml"], "wrong.toml, line 1: unknown key 'rns': did you mean 'runs'?"),
        (["run", "none.toml"], "cannot read the study file none.toml: No such file or directory"),
        (
            ["run", "many.toml"],
            "many.toml: these are 12,000,000 runs; if that is meant, give --yes",
        ),
        (["run", "lake.toml", "--workers", "0"], "workers must be a whole number of at least 1; got 0"),
        (["run", "lake.toml", "--runs", "0"], "runs must be a whole number of at least 1; got 0"),
        (["run", "lake.toml", "--out", "many.toml/x"], "cannot make the folder many.toml/x"),
        (["resume", "."], ". holds no study.toml, so no study was run into it from a file: `tuckerl study run FILE"),
        (["report", "none"], "none is no folder"),
        (["export", ".", "--format", "xml"], ". holds no study.toml"),
    ],
)
def test_wrong_input_is_one_sentence_and_status_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("wrong.toml").write_text(changed(("runs", "rns")))
    Path("many.toml").write_text(changed(("runs = 3", "runs = 4_000_000")))
    assert status_of("study", *arguments) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("tuckerl: ")
    assert shown.err.count("\n") == 1
    assert message in shown.err
    assert not Path("results").exists()


def test_of_very_many_comparisons_the_first_are_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page, words = Path("report.html"), tuple(f"sentence {place}" for place in range(14))
    monkeypatch.setattr(Study, "report", lambda self, folder: StudyReport(page, words))
    Path("study.toml").write_text(LAKE)
    assert status_of("study", "report", ".") == 0
    assert capsys.readouterr().out.splitlines() == [
        *words[:12],
        "... and 2 more comparisons, which the report shows",
        "Report: report.html",
    ]


class Terminal(io.StringIO):
    """Somebody who sits there and answers."""

    def isatty(self) -> bool:
        return True


def test_a_very_large_study_is_asked_about(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    Path("many.toml").write_text(changed(("runs = 3", "runs = 4_000_000")))
    monkeypatch.setattr(sys, "stdin", Terminal("n\n"))
    assert status_of("study", "run", "many.toml") == 1
    question = "many.toml: these are 12,000,000 runs. Play them all? [y/N]:"
    assert question in capsys.readouterr().err
    assert not Path("results").exists()
    monkeypatch.setattr(sys, "stdin", Terminal("y\n"))
    assert status_of("study", "run", "many.toml", "--workers", "0") == 2
    assert "workers must be" in capsys.readouterr().err
    assert status_of("study", "run", "many.toml", "--workers", "0", "--yes") == 2
    assert "workers must be" in capsys.readouterr().err


def test_a_cluster_that_is_not_there_is_said_and_the_same_command_works_later(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert status_of("study", "run", "lake.toml", "--cluster", "tcp://127.0.0.1:1") == 2
    assert "tuckerl: no Dask scheduler answers at tcp://127.0.0.1:1 (" in capsys.readouterr().err
    assert status_of("study", "run", "lake.toml", "--cluster", "tcp://127.0.0.1:1", "--workers", "1") == 2
    assert "give one of the two" in capsys.readouterr().err
    assert status_of("study", "run", "lake.toml", "--workers", "1") == 0
