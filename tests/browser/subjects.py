"""The pages that the commands write, small ones, each made by its command once, when a test first asks for it."""

import warnings
from pathlib import Path

import pytest

from tests.studies.study_texts import LAKE
from tuckerl.cli import main

_SMALL = ("--runs", "2", "--episodes", "20", "--workers", "1")


def _reproduce(folder: Path) -> Path:
    _run("reproduce", "dyna-maze", "--quick", *_SMALL, "--out", str(folder))
    return folder / "report.html"


def _compare(folder: Path) -> Path:
    _run("compare", "sarsa-lambda", "tsarsa-lambda", "--env", "FrozenLake-v1", *_SMALL, "--out", str(folder))
    return folder / "report.html"


def _study(folder: Path) -> Path:
    folder.mkdir()
    (folder / "lake.toml").write_text(LAKE)
    _run("study", "run", str(folder / "lake.toml"), "--workers", "1", "--out", str(folder / "study"))
    return folder / "study" / "report.html"


def _tune(folder: Path) -> Path:
    small = ("--trials", "2", "--batch", "2", "--rungs", "1,2", *_SMALL)
    _run("tune", "tq-learning", "FrozenLake-v1", "--agents", "2", *small, "--out", str(folder))
    return folder / "report.html"


def _show(folder: Path) -> Path:
    tensor_step = ("--agents", "3", "--set", "every=5")
    _run("train", "dyna-ht", "tuckerl/DynaMaze-v0", "--episodes", "20", *tensor_step, "--out", str(folder))
    _run("show", str(folder / "agent.tuckerl"), "--out", str(folder / "page"))
    return folder / "page" / "inspect.html"


SUBJECTS = {"reproduce": _reproduce, "compare": _compare, "study": _study, "tune": _tune, "show": _show}


def _run(*arguments: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # such small runs end with warnings of their own
        with pytest.raises(SystemExit) as end:
            main(list(arguments))
    assert end.value.code == 0, arguments
