"""Which functions of the package every test calls, and how long it takes: a plugin of pytest and its record.

``python -m pytest -p tests.mutants.record`` writes a record to the file that MUTANTS_RECORD names. With MUTANTS_CHOSEN,
the name of a file, it records nothing and runs only the tests that the file lists. What a test calls after its first
seconds, leaves to another process, or finds in a fixture or a cache that an earlier test has filled, is not in the
record.
"""

import _thread
import json
import os
import sys
import time
from collections.abc import Generator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple

import pytest

_PACKAGE = "src/tuckerl/"
_LISTENING = 2.0  # seconds of a test: to listen makes interpreted kernels much slower
_called: dict[int, CodeType] = {}  # by id: code is slow to hash
_until = 0.0


class RecordedTest(NamedTuple):
    """A test as it went without any change."""

    name: str
    outcome: str  # "passed", "failed", "skipped", or "unfinished" if it was running when its process was stopped
    seconds: float
    calls: frozenset[str]  # as `function_at` names them

    @property
    def file(self) -> str:
        """The file that it is in, from the root."""
        return self.name.split("::")[0]


def function_at(file: str, text: str, line: int) -> str:
    """Return the innermost function of a line, as ``src/tuckerl/rng.py:uniform``; no name at the end: the import's."""
    codes = [compile(text, file, "exec")]
    for code in codes:
        codes.extend(inner for inner in code.co_consts if isinstance(inner, CodeType))
    inside = [code for code in codes[1:] if any(number == line for *_, number in code.co_lines())]
    return f"{file}:{inside[-1].co_qualname if inside else ''}"


def recorded_in(record: Path) -> list[RecordedTest]:
    """Return the tests of a record, in the order in which they were run."""
    tests: dict[str, RecordedTest] = {}
    for line in record.read_text(encoding="utf-8").splitlines():
        name, outcome, seconds, calls = json.loads(line)
        tests[name] = RecordedTest(name, outcome, seconds, frozenset(calls))
    return list(tests.values())


def _hear(frame: FrameType, event: str, argument: Any) -> None:
    """Note a call; nothing more of it has to be heard."""
    _called[id(frame.f_code)] = frame.f_code
    if time.monotonic() > _until:
        sys.settrace(None)


_start_thread = _thread.start_new_thread


def _start_listening(function: Any, *arguments: Any) -> int:
    """Start a thread that is listened to; kernels are played in such, of which `threading` knows nothing."""

    def listening(*own: Any, **named: Any) -> None:
        sys.settrace(_hear)
        function(*own, **named)

    return _start_thread(listening, *arguments)


def _names(codes: list[CodeType]) -> list[str]:
    places = ((code.co_filename.replace("\\", "/").rpartition(_PACKAGE), code.co_qualname) for code in codes)
    return sorted({f"{package}{file}:{name}" for (_, package, file), name in places if package})


def _write(test: RecordedTest) -> None:
    with Path(os.environ["MUTANTS_RECORD"]).open("a", encoding="utf-8") as record:
        record.write(json.dumps([*test[:3], sorted(test.calls)]) + "\n")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Listen while a test is set up, run and torn down."""
    if "MUTANTS_RECORD" not in os.environ:
        return (yield)
    _write(RecordedTest(item.nodeid, "unfinished", 0.0, frozenset()))
    global _until
    _called.clear()
    _until = time.monotonic() + _LISTENING
    _thread.start_new_thread = _start_listening
    sys.settrace(_hear)
    try:
        return (yield)
    finally:
        sys.settrace(None)
        _thread.start_new_thread = _start_thread


_reports: list[pytest.TestReport] = []


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Write a test down when its last phase is over."""
    _reports.append(report)
    if report.when == "teardown" and "MUTANTS_RECORD" in os.environ:
        outcomes = {phase.outcome for phase in _reports}
        outcome = next(one for one in ("failed", "skipped", "passed") if one in outcomes)
        seconds = round(sum(phase.duration for phase in _reports), 3)
        _write(RecordedTest(report.nodeid, outcome, seconds, frozenset(_names(list(_called.values())))))
        _reports.clear()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave the tests that are not chosen."""
    if "MUTANTS_CHOSEN" in os.environ:
        chosen = set(Path(os.environ["MUTANTS_CHOSEN"]).read_text(encoding="utf-8").splitlines())
        items[:] = [item for item in items if item.nodeid in chosen]
