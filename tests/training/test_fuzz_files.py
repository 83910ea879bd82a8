"""Files of learners that are damaged are refused; those that are crafted are refused, or hold a sound learner.

``TUCKERL_FUZZ_FILES`` says how many files of each kind the long tests try, and ``TUCKERL_FUZZ_FIRST`` with which number
they begin: a file follows from its number.
"""

import os

import pytest

from tests.training.fuzz_files import FILES, accepted_damage, crafted_file, damaged, try_crafted

pytestmark = pytest.mark.slow

MEMORY = 300 * 2**20  # what a crafted file may take beyond those that were saved
FIRST, COUNT = (
    int(os.environ.get(f"TUCKERL_FUZZ_{name}", value)) for name, value in (("FIRST", 0), ("FILES", 100_000))
)


def test_files_follow_from_their_numbers() -> None:
    assert [damaged(n) for n in range(5)] == [damaged(n) for n in range(5)]
    assert [crafted_file(n) for n in range(5)] == [crafted_file(n) for n in range(5)]
    assert len({crafted_file(n)[0] for n in range(300)}) == len(FILES)


def test_damaged_files_are_refused() -> None:
    assert accepted_damage(0, 600) == []


def test_crafted_files_are_refused_or_hold_a_sound_learner() -> None:
    figures = try_crafted(0, 300)
    assert figures.failures == {}
    assert figures.accepted > 10, "not everything that differs is wrong"
    assert figures.refused > 150
    assert figures.memory < MEMORY


@pytest.mark.long
def test_a_hundred_thousand_damaged_files_are_refused() -> None:
    assert accepted_damage(FIRST, COUNT) == []


@pytest.mark.long
def test_a_hundred_thousand_crafted_files_are_refused_or_hold_a_sound_learner() -> None:
    figures = try_crafted(FIRST, COUNT)
    assert figures.failures == {}
    assert figures.memory < MEMORY
