"""Every example that users read is run: pages, the README, notebooks and docstrings.

On a page (Markdown), the ``python`` blocks run in order in one namespace and an empty folder; a block in ``>>>`` form
is compared with what it shows, and any other with the ``text`` block right below it, which shows what it prints. In a
``console`` block, each line that begins with ``$ tuckerl`` runs, must succeed, and must print the lines below it, where
there are any. In what is printed, ``...`` stands for anything, and lines may be broken elsewhere.
A ``toml`` block whose first line is ``# NAME.toml`` is written to that file.
A comment on the line before a block changes that: ``% pending`` (it needs what is not there yet) and ``% not run`` (it
takes minutes, or shows what others wrote) skip it.
"""

import contextlib
import doctest
import importlib
import io
import json
import pkgutil
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import tuckerl
from tuckerl.cli import main

ROOT = Path(__file__).parents[2]
SKIPPED = ("% pending", "% not run")
PRINTED: Any = {"precision": 8, "threshold": 1000, "edgeitems": 3, "linewidth": 75, "suppress": False}
DOCTEST = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
FENCE = re.compile(r"(?P<indent> *)(?P<ticks>`{3,})(?P<kind>[^\s`]*)[^`]*$")


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Decompose on one thread: those of parallel tests wait for each other, which is many times as slow."""
    with threadpool_limits(1):
        yield


class Block(NamedTuple):
    """A fenced block of a page."""

    kind: str
    line: int  # the number of its first line of code, from 1
    code: str


def blocks(text: str) -> Iterator[Block]:
    """Give a page's fenced blocks that are not marked as skipped."""
    lines = text.splitlines()
    at = 0
    while at < len(lines):
        fence = FENCE.match(lines[at])
        if fence is None:
            at += 1
            continue
        begin = at + 1
        end = next(i for i in range(begin, len(lines)) if lines[i].strip() == fence["ticks"])
        before = next((line for line in reversed(lines[:at]) if line.strip()), "")
        if not before.startswith(SKIPPED):
            code = "\n".join(line.removeprefix(fence["indent"]) for line in lines[begin:end])
            yield Block(fence["kind"], begin + 1, code)
        at = end + 1


def run_python(block: Block, page: Path, namespace: dict[str, Any]) -> str:
    """Run a block, and return what it prints."""
    printed = io.StringIO()
    if ">>> " in block.code:
        run_doctest(doctest.DocTestParser().get_doctest(block.code, namespace, page.name, str(page), block.line - 1))
    else:
        code = "\n" * (block.line - 1) + block.code  # so that a traceback names the page's own line
        with contextlib.redirect_stdout(printed), np.printoptions(**PRINTED):
            exec(compile(code, str(page), "exec"), namespace)  # noqa: S102  # our own pages
    return printed.getvalue()


def is_right_below(block: Block, above: Block | None) -> bool:
    """Return whether only a blank line, at most, is between the fences of two blocks."""
    return above is not None and block.line - above.line - above.code.count("\n") in (3, 4)


def check_printed(shown: str, printed: str, where: str) -> None:
    """Compare what a page shows with what was printed."""
    same = doctest.OutputChecker().check_output(f"{shown}\n", printed, DOCTEST)
    assert same, f"{where} shows\n{shown}\nand this is printed:\n{printed}"


def run_doctest(test: doctest.DocTest) -> None:
    """Run the examples, which see and leave names in the test's own namespace."""
    report = io.StringIO()
    runner = doctest.DocTestRunner(optionflags=DOCTEST, verbose=False)
    with np.printoptions(**PRINTED):
        runner.run(test, out=report.write, clear_globs=False)
    assert runner.failures == 0, report.getvalue()


def run_console(block: Block, page: Path) -> None:
    for command in re.split(r"^(?=\S*\$ )", block.code, flags=re.MULTILINE):
        line, _, shown = command.partition("\n")
        if line.startswith("$ tuckerl"):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed), pytest.raises(SystemExit) as end:
                main(shlex.split(line)[2:])
            assert end.value.code == 0, line
            if shown.strip():
                check_printed(shown.strip(), printed.getvalue().strip() + "\n", f"{page.name}, {line}")


def run_page(text: str, page: Path) -> dict[str, Any]:
    """Run a page's examples, compare what they print with what it shows, and return the names that they leave."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    above, printed = None, ""
    for block in blocks(text):
        if block.kind == "python":
            printed = run_python(block, page, namespace)
        elif block.kind == "text" and above and above.kind == "python" and is_right_below(block, above):
            check_printed(block.code, printed, f"{page.name}:{block.line}")
        elif block.kind == "console":
            run_console(block, page)
        elif block.kind == "toml" and (named := re.match(r"# (\S+\.toml)\n", block.code)):
            Path(named[1]).write_text(block.code, "utf-8")
        above = block
    return namespace


def sources(ending: str) -> list[Path]:
    """Return the site's sources of a kind, but not what was built of them."""
    return sorted(page for page in (ROOT / "docs").rglob(f"*.{ending}") if "_build" not in page.parts)


def pages() -> list[Path]:
    return [ROOT / "README.md", *(page for page in sources("md") if any(blocks(page.read_text("utf-8"))))]


def named(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.slow
@pytest.mark.compiled  # pages learn as long as users do
@pytest.mark.parametrize("page", pages(), ids=named)
def test_every_example_of_a_page_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(page.read_text("utf-8"), page)


@pytest.mark.slow
@pytest.mark.compiled  # as above
@pytest.mark.parametrize("notebook", sources("ipynb"), ids=named)
def test_every_cell_of_a_notebook_runs(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    namespace: dict[str, Any] = {"__name__": "__main__"}
    cells = json.loads(notebook.read_text("utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert sources
    for number, source in enumerate(sources):
        exec(compile(source, f"{notebook.name}, code cell {number}", "exec"), namespace)  # noqa: S102


def modules_with_examples() -> list[str]:
    names = ["tuckerl", *(found.name for found in pkgutil.walk_packages(tuckerl.__path__, "tuckerl."))]
    names.remove("tuckerl.__main__")  # importing it runs the program
    package = Path(tuckerl.__file__).parents[1]

    def source(name: str) -> Path:
        path = package.joinpath(*name.split("."))
        return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")

    return [name for name in names if ">>> " in source(name).read_text("utf-8")]


@pytest.mark.parametrize("name", modules_with_examples())
def test_every_example_of_a_docstring_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tests = [test for test in doctest.DocTestFinder().find(importlib.import_module(name)) if test.examples]
    assert tests
    for test in tests:
        run_doctest(test)


PAGE = """\
Text.

```python
first = 1
```

{mark}

```python
first += {second}
```

Words.

```text
not python
```

    ```python
    >>> first
    {shown}
    ```
"""


def run_text(text: str) -> dict[str, Any]:
    return run_page(text, Path("page.md"))


def test_blocks_of_a_page_share_their_names_and_doctests_are_compared() -> None:
    assert run_text(PAGE.format(mark="", second=1, shown=2))["first"] == 2
    with pytest.raises(AssertionError, match=r"Expected:\s+3\s+Got:\s+2"):
        run_text(PAGE.format(mark="", second=1, shown=3))


@pytest.mark.parametrize("mark", SKIPPED)
def test_a_marked_block_is_skipped(mark: str) -> None:
    assert run_text(PAGE.format(mark=mark, second="no_such_name", shown=1))["first"] == 1


def test_a_broken_example_is_found_on_its_line() -> None:
    with pytest.raises(NameError, match="no_such_name") as found:
        run_text(PAGE.format(mark="", second="no_such_name", shown=1))
    assert found.traceback[-1].lineno == 10 - 1  # counted from 0


def test_a_command_that_fails_is_found() -> None:
    run_text("```console\n$ tuckerl --version\n$ make everything\nand its output\n```")
    with pytest.raises(AssertionError, match="no-such-command"):
        run_text("```console\n$ tuckerl no-such-command\n```")


def test_what_a_page_shows_is_what_is_printed() -> None:
    shown = "```python\nprint('one', 'two')\n```\n\n```text\n{}\n```\n"
    run_text(shown.format("one\ntwo"))
    run_text(shown.format("o...o"))
    run_text(shown.replace("\n\n```text", "\n\nIn words.\n\n```text").format("something else"))
    with pytest.raises(AssertionError, match=r"page\.md:6 shows\s+three\s+and this is printed:\s+one two"):
        run_text(shown.format("three"))
    command = "```console\n$ tuckerl --version\n{}\n```\n"
    run_text(command.format(f"tuckerl {tuckerl.__version__}"))
    with pytest.raises(AssertionError, match=r"page\.md, \$ tuckerl --version shows\s+tuckerl 9"):
        run_text(command.format("tuckerl 9"))


def test_every_public_name_is_in_the_reference() -> None:
    reference = "".join(page.read_text("utf-8") for page in (ROOT / "docs" / "reference").glob("*.md"))
    assert set(tuckerl.__all__) - {"__version__"} <= set(re.findall(r"tuckerl\.(\w+)", reference))
