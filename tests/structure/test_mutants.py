"""The small wrong changes that `make mutants` makes are changes, and what is listed as equivalent is still there."""

import ast
from pathlib import Path

import pytest

from tests.mutants.__main__ import ROOT, Mutant, equivalents, likeliest, sampled
from tests.mutants.changes import changes
from tests.mutants.record import RecordedTest, function_at, recorded_in

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


@pytest.mark.slow
def test_a_sample_is_of_all_folders_and_every_change_is_python() -> None:
    drawn = sampled(60, seed=1)
    assert drawn == sampled(60, seed=1)
    assert len({mutant.folder for mutant in drawn}) >= 13
    assert len({mutant.change.kind for mutant in drawn}) >= 8
    for mutant in drawn:
        assert mutant.change.is_python(mutant.text)
        assert ast.dump(ast.parse(mutant.change.applied(mutant.text))) != ast.dump(ast.parse(mutant.text))


def test_a_change_is_shown_with_the_whole_lines_that_it_is_in() -> None:
    text = "call(\n    first,\n    second,\n)\n"
    (swapped,) = (change for change in changes(text) if change.kind == "swapped")
    assert Mutant(Path("one.py"), text, swapped).lines() == ("first,\nsecond,", "second,\nfirst,")


@pytest.mark.parametrize(
    ("line", "name"),
    [(1, ""), (3, "total"), (7, "total"), (11, "total.<locals>.inner"), (14, "Kind.method"), (15, "Kind"), (16, "")],
)
def test_the_function_of_a_line(line: int, name: str) -> None:
    text = TEXT.removesuffix("    return result * 2\n") + (
        "    def inner(number: int = 3) -> int:\n        return number\n    return inner()\n"
        "class Kind:\n    def method(self) -> None: ...\n    constant = 3\nother = 3\n"
    )
    assert function_at("one.py", text, line) == f"one.py:{name}"


def test_a_record_tells_what_was_running_when_time_ran_out(tmp_path: Path) -> None:
    (tmp_path / "record").write_text(
        '["a::x", "unfinished", 0, []]\n["a::x", "passed", 1.5, ["b.py:f"]]\n["a::y", "unfinished", 0, []]\n'
    )
    assert recorded_in(tmp_path / "record") == [
        RecordedTest("a::x", "passed", 1.5, frozenset({"b.py:f"})),
        RecordedTest("a::y", "unfinished", 0, frozenset()),
    ]


def test_the_likeliest_tests_come_first() -> None:
    text = "def f() -> int:\n    return 1 + 2\n\ndef g() -> int:\n    return 3\n"
    file = "src/tuckerl/tensor/one.py"
    f, g = (next(one for one in changes(text) if one.line == line) for line in (2, 5))
    tests = [
        RecordedTest("tests/cli/test_slow.py::a", "passed", 90.0, frozenset({f"{file}:f"})),
        RecordedTest("tests/cli/test_quick.py::a", "passed", 2.0, frozenset({f"{file}:f", "src/tuckerl/rng.py:g"})),
        RecordedTest("tests/cli/test_slow.py::b", "passed", 5.0, frozenset({f"{file}:f"})),
        RecordedTest("tests/tensor/test_one.py::a", "passed", 9.0, frozenset({f"{file}:f"})),
        RecordedTest("tests/tensor/test_other.py::a", "passed", 1.0, frozenset({"src/tuckerl/tensor/other.py:f"})),
    ]
    tensor, quick, slow, second = tests[3], tests[1], tests[0], tests[2]
    assert likeliest(Mutant(Path(file), text, f), tests, seconds=100.0) == [tensor, quick, slow, second]
    assert likeliest(Mutant(Path(file), text, f), tests, seconds=10.0) == [tensor, quick]
    assert likeliest(Mutant(Path(file), text, g), tests, seconds=10.0) == [tensor, quick], "nothing calls g itself"


@pytest.mark.parametrize("entry", equivalents(), ids=lambda entry: f"{entry['file']}: {entry['after']}")
def test_what_is_listed_as_equivalent_is_still_there(entry: dict[str, str]) -> None:
    lines = [line.strip() for line in (ROOT / Path(entry["file"])).read_text(encoding="utf-8").splitlines()]
    assert set(entry["before"].splitlines()) <= set(lines), "it changed: judge it anew, or take it out of the list"
    assert entry["reason"]
