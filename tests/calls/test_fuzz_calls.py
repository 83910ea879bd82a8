"""Calls with wrong and odd arguments work, or raise an error of this library's own that says what to do.

``TUCKERL_FUZZ_CALLS`` says how many the long test makes, ``TUCKERL_FUZZ_FIRST`` with which number it begins: a call
follows from its number, and ``python -m tests.calls.fuzz_calls show NUMBER`` makes it again.
"""

import os

import pytest

from tests.calls.fuzz_calls import OWN, REFUSED, WORKED, drawn, try_calls

pytestmark = pytest.mark.slow

FIRST, COUNT = (int(os.environ.get(f"TUCKERL_FUZZ_{name}", value)) for name, value in (("FIRST", 0), ("CALLS", 10_000)))


def test_calls_follow_from_their_numbers() -> None:
    for number in range(10):
        one, other = drawn(number), drawn(number)
        assert (one.target.name, list(one.given)) == (other.target.name, list(other.given))


def test_odd_calls_work_or_are_refused_by_name() -> None:
    figures = try_calls(0, 120)
    assert figures.failures == {}
    assert figures.outcomes[WORKED] > 5, "not everything that is odd is wrong"
    assert figures.outcomes[REFUSED] > 60


@pytest.mark.long
def test_ten_thousand_odd_calls_work_or_are_refused_by_name() -> None:
    figures = try_calls(FIRST, COUNT)
    assert figures.failures == {}
    assert sum(figures.outcomes.values()) == COUNT
    assert figures.outcomes[OWN] > 0
