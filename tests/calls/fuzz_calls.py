"""Calls of the public interface with wrong and odd arguments: a sound result, or an error of this library's own.

Every case follows from its number: ``python -m tests.calls.fuzz_calls show NUMBER`` makes it again and says what comes.
The kernels are interpreted, so that there is time for many (compiled with ``NUMBA_DISABLE_JIT=0``); a child process
makes the calls, so that a dead interpreter is seen, and one that hangs. What the command line is given is tried in the
same way.
"""

import contextlib
import faulthandler
import io
import json
import os
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tuckerl.checks import shown

ROOT = Path(__file__).parents[2]
HANGS = 120
"""Seconds after which a call is taken to hang."""

PATIENCE = 2.0
"""Seconds of work after which Ctrl-C is pressed: a call may ask for hours of work, but has to hear that."""

MEMORY = 3 * 2**30
WORKED, REFUSED, LASTED, OWN = "worked", "refused", "lasted", "the user's own error"
_SIGNATURE = re.compile(
    r"[\w.<>]+\(\) (got an unexpected keyword argument|missing \d+ required|takes |got multiple values for)"
)


class Case(NamedTuple):
    """A call."""

    target: Any
    given: dict[str, Any]


def drawn(number: int) -> Case:
    """Return the call of a number."""
    from tests.calls.interface import targets
    from tests.calls.target import ONLY_WRONG
    from tests.calls.values import odd

    rng = np.random.default_rng((3, number))
    listed = targets()
    sizes = np.sqrt([len(one.arguments) for one in listed])  # where more can be wrong, more is tried
    target = listed[rng.choice(len(listed), p=sizes / sizes.sum())]
    names = list(target.arguments)
    given: dict[str, Any] = {}
    for place, (name, makers) in enumerate(target.arguments.items()):
        if place < target.required or rng.random() < 0.25:
            given[name] = makers[int(rng.integers(len(makers)))]()
    for _ in range(rng.choice(3, p=[0.1, 0.65, 0.25])):  # none is altered now and then
        name = names[rng.integers(len(names))]
        makers = target.arguments[name]
        given[name] = odd(makers[int(rng.integers(len(makers)))](), rng)
    while any(value is ONLY_WRONG for value in given.values()):
        given = {name: odd(value, rng) if value is ONLY_WRONG else value for name, value in given.items()}
    if rng.random() < 0.02:
        given[str(rng.choice(["extra", "lr", "total_timesteps", "obs"]))] = 1
    elif rng.random() < 0.02:
        given.pop(names[0], None)
    return Case(target, given)


def outcome_of(case: Case) -> str:
    """Return what comes of a call: a word of those above, or what is wrong."""
    said = io.StringIO()
    with (
        warnings.catch_warnings(record=True) as warned,
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
    ):
        warnings.simplefilter("always")
        outcome = _called(case)
    for warning in warned:
        ours = warning.category.__module__.startswith("tuckerl.") or warning.category is ResourceWarning
        ours |= "/gymnasium/" in warning.filename  # of what it was given
        if not ours:
            return f"warns: {warning.category.__name__}: {warning.message} ({warning.filename}:{warning.lineno})"
    return outcome


def _called(case: Case) -> str:
    target = case.target
    subject = target.subject()
    try:
        with _pressed():
            result = target.call(subject, **case.given)
        outcome = WORKED
    except BaseException as error:  # noqa: BLE001  # whatever comes is what is looked for
        outcome = _judge(error, may_last=target.may_last)
        result = None
    if outcome == WORKED:
        try:
            with _pressed():
                target.check(result)
        except BaseException as error:  # noqa: BLE001  # as above
            outcome = _judge(error, may_last=True, unsound=True)
    if outcome in (WORKED, REFUSED, OWN):
        try:
            with _pressed():
                target.after(subject)
        except BaseException as error:  # noqa: BLE001  # as above
            verdict = _judge(error, may_last=True)
            outcome = outcome if verdict in (OWN, LASTED) else f"afterwards {outcome}: {_described(error)}"
    return outcome


def _judge(error: BaseException, *, may_last: bool, unsound: bool = False) -> str:
    import gymnasium

    from tests.calls.values import OwnError
    from tuckerl.errors import LONGEST_MESSAGE, TuckerlError

    if isinstance(error, KeyboardInterrupt):
        return LASTED if may_last else f"takes long: {_described(error)}"
    if isinstance(error, OwnError):
        return OWN
    if isinstance(error, TuckerlError):
        return REFUSED if len(str(error)) <= LONGEST_MESSAGE else f"says too much: {_described(error)}"
    if isinstance(error, gymnasium.error.Error):
        return REFUSED
    if type(error) is TypeError and _SIGNATURE.match(str(error)) and _is_binding(error):
        return REFUSED
    return f"{'unsound' if unsound else 'raw'}: {_described(error)}"


def _is_binding(error: TypeError) -> bool:
    """Return whether it is the call itself that does not fit a signature of this library."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "/tuckerl/" in frame.filename]
    return all(frame.name in ("answering", "__call__", "__init__", "load") for frame in ours)


def _described(error: BaseException) -> str:
    ours = [frame for frame in traceback.extract_tb(error.__traceback__) if "/tuckerl/" in frame.filename]
    place = f"{ours[-1].filename.partition('/tuckerl/')[2]}:{ours[-1].lineno}" if ours else "outside"
    text = str(error)
    return f"{type(error).__name__} at {place}: {text[:200]}"


@contextlib.contextmanager
def _pressed() -> Iterator[None]:
    """Press Ctrl-C where a block lasts."""
    signal.signal(signal.SIGPROF, lambda number, frame: signal.raise_signal(signal.SIGINT))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_PROF, PATIENCE, PATIENCE * 2)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def prepare() -> None:
    """Write the files that cases name, into the current folder."""
    from tests.calls.values import learner

    learner().save("good.tuckerl")
    learner().save("other.tuckerl")
    content = Path("good.tuckerl").read_bytes()
    np.save("table.npy", np.random.default_rng(0).normal(size=(4, 2, 3, 1)))
    np.save("objects.npy", np.array([None, 1]), allow_pickle=True)
    Path("not.npz").write_bytes(b"PK")
    Path("bad.tuckerl").write_bytes(content[:-7] + b"abcdefg")


def serve(first: int, count: int) -> None:
    """Make calls by their numbers, and print a line of JSON for each."""
    answers = os.fdopen(os.dup(1), "w")
    prepare()
    here = set(Path().iterdir())
    used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    for number in range(first, first + count):
        faulthandler.dump_traceback_later(HANGS, exit=True, file=2)
        case = drawn(number)
        outcome = outcome_of(case)
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps([number, case.target.name, outcome]), file=answers, flush=True)
        for path in set(Path().iterdir()) - here:
            if path.is_file():
                path.unlink()


class Figures(NamedTuple):
    """What came of many calls."""

    outcomes: Counter[str]
    failures: dict[int, str]  # by number


def try_calls(first: int, count: int, tell: Callable[[str], object] = len) -> Figures:
    """Make calls by their numbers; a child that died or hangs is followed by another, which goes on after the call."""
    figures = Figures(Counter(), {})
    number, last = first, first + count
    paths = os.pathsep.join((str(ROOT / "src"), str(ROOT)))
    while number < last:
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+") as errors:
            child = subprocess.Popen(
                [sys.executable, "-m", "tests.calls.fuzz_calls", "serve", str(number), str(last - number)],
                cwd=folder,
                env={"NUMBA_DISABLE_JIT": "1"} | os.environ | {"PYTHONPATH": paths, "MPLBACKEND": "agg"},
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            )
            assert child.stdout is not None
            while select.select([child.stdout], [], [], 2 * HANGS)[0] and (line := child.stdout.readline()):
                number, name, outcome = json.loads(line)
                number += 1
                if outcome in (WORKED, REFUSED, LASTED, OWN):
                    figures.outcomes[outcome] += 1
                else:
                    figures.failures[number - 1] = f"{name}: {outcome}"
                    tell(f"{number - 1} {name}: {outcome}")
            child.kill()
            child.wait()
            child.stdout.close()
            errors.seek(0)
            said = errors.read()
            if number < last:
                figures.failures[number] = f"the interpreter died or hung: {said[:300]} ... {said[-900:]}"
                tell(f"{number} {figures.failures[number]}")
                number += 1
    return figures


def main() -> None:
    """Do what the arguments say: serve FIRST COUNT; try FIRST COUNT; show NUMBER."""
    what, first, count = [*sys.argv[1:], "1"][:3]
    if what == "serve":
        serve(int(first), int(count))
    elif what == "try":
        figures = try_calls(int(first), int(count), tell=lambda line: print(line, flush=True))  # noqa: T201  # a program
        print(dict(figures.outcomes), len(figures.failures))  # noqa: T201  # as above
    else:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            prepare()
            case = drawn(int(first))
            print(case.target.name, shown(case.given), outcome_of(case), sep="\n")  # noqa: T201  # as above
            case.target.check(case.target.call(case.target.subject(), **drawn(int(first)).given))


if __name__ == "__main__":
    main()
