"""A training that was stopped goes on to the same bits, however and whenever that was."""

import sys
from pathlib import Path

import pytest

from tests.cli.stopped_trainings import interrupt, kill, stopped_again_and_again

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="Windows has other signals"),
]


def test_killed_trainings_go_on_to_the_same_bits(tmp_path: Path) -> None:
    stopped_again_and_again(kill, 3, tmp_path, seed=1)


@pytest.mark.long
def test_trainings_killed_hundreds_of_times_go_on_to_the_same_bits(tmp_path: Path) -> None:
    stopped_again_and_again(kill, 300, tmp_path, seed=2)


def test_interrupted_trainings_go_on_to_the_same_bits(tmp_path: Path) -> None:
    stopped_again_and_again(interrupt, 2, tmp_path, seed=3)


@pytest.mark.long
def test_trainings_interrupted_hundreds_of_times_go_on_to_the_same_bits(tmp_path: Path) -> None:
    stopped_again_and_again(interrupt, 300, tmp_path, seed=4)
