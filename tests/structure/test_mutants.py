"""The small wrong changes that `make mutants` makes are changes, and what is listed as equivalent is still there."""

import ast
from pathlib import Path

import pytest

from tests.mutants.__main__ import ROOT, equivalents, sampled
from tests.mutants.changes import changes

TEXT = '''"""A docstring, with 3 and not."""

def total(numbers: "list[int]", start: int = 0) -> int:
    """Add up."""
    result = start
    for number in numbers:
        if number > 2 and not result:
            result += max(number, 1)
    print(result, start)
    return result * 2
'''


def test_changes_are_the_ones_that_are_meant() -> None:
    made = {(change.kind, change.line, TEXT[change.start : change.end], change.new) for change in changes(TEXT)}
    assert made == {
        ("one more", 3, "0", "1"),
        ("comparison", 7, ">", ">="),
        ("one more", 7, "2", "3"),
        ("double", 7, "2", "4"),
        ("and, or", 7, "and", "or"),
        ("sign", 7, "not ", ""),
        ("dropped", 8, "result += max(number, 1)", "pass"),
        ("name", 8, "max", "min"),
        ("swapped", 8, "number, 1", "1, number"),
        ("one more", 8, "1", "2"),
        ("double", 8, "1", "2"),
        ("dropped", 9, "print(result, start)", "pass"),
        ("swapped", 9, "result, start", "start, result"),
        ("operator", 10, "*", "/"),
        ("one more", 10, "2", "3"),
        ("double", 10, "2", "4"),
    }


def test_a_sample_is_of_all_folders_and_every_change_is_python() -> None:
    drawn = sampled(60, seed=1)
    assert drawn == sampled(60, seed=1)
    assert len({mutant.folder for mutant in drawn}) >= 13
    assert len({mutant.change.kind for mutant in drawn}) >= 8
    for mutant in drawn:
        assert ast.dump(ast.parse(mutant.change.applied(mutant.text))) != ast.dump(ast.parse(mutant.text))


@pytest.mark.parametrize("entry", equivalents(), ids=lambda entry: f"{entry['file']}: {entry['after']}")
def test_what_is_listed_as_equivalent_is_still_there(entry: dict[str, str]) -> None:
    lines = [line.strip() for line in (ROOT / Path(entry["file"])).read_text(encoding="utf-8").splitlines()]
    assert set(entry["before"].splitlines()) <= set(lines), "it changed: judge it anew, or take it out of the list"
    assert entry["reason"]
