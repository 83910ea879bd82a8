"""What docs/code-in-an-hour.md shows of the code is so: the picture of the layers, the way to the table, the sizes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from docs.pictures import layers
from tests.structure.test_structure import LAYERS, PACKAGE

ROOT = Path(__file__).parents[2]
WRITE_ANEW = "run `python -m docs.pictures.layers`, which writes it anew"
STACK = """
import sys, traceback
import tuckerl
from tuckerl.learners import q_learning
from tuckerl.training.kernel_calls import KernelCall

KernelCall._run_beside = lambda call, kernel, arguments: kernel(*arguments)  # not in a thread, which has no stack above


def look(frame, event, argument):
    if event == "call" and frame.f_code is q_learning.move_towards_target.__code__:
        sys.setprofile(None)
        print(*dict.fromkeys(entry.filename for entry in traceback.extract_stack(frame)), sep="\\n")

agent = tuckerl.QLearning(tuckerl.sutton_maze(), seed=0)
sys.setprofile(look)
agent.learn(1)
"""


def test_the_picture_shows_the_imports_as_they_are() -> None:
    assert (layers.HERE / "layers.txt").read_text("utf-8") == layers.imports_text(), WRITE_ANEW


def test_the_picture_has_an_arrow_or_a_name_for_every_import() -> None:
    found = layers.imports()
    arrows = layers.nearest(found)
    places = {folder: place for place, layer in enumerate(LAYERS) for folder in layer}
    assert all(places[folder] > places[other] for folder, other in arrows), "arrows lead downwards"

    def reached(folder: str) -> set[str]:
        below = {other for source, other in arrows if source == folder}
        return below.union(*map(reached, below))

    for folder, others in found.items():
        assert others <= reached(folder), "what has no arrow of its own is at the end of a longer way"


def test_the_way_to_the_table_is_six_files_and_900_lines() -> None:
    assert len(layers.UPDATE_PATH) <= 6
    assert sum(layers.size_of(path).code for path in layers.UPDATE_PATH) <= 900


def test_the_way_to_the_table_leads_through_these_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")  # so that kernels have a call stack, too
    done = subprocess.run([sys.executable, "-c", STACK], capture_output=True, text=True, check=True, cwd=ROOT)
    called = [Path(line).relative_to(PACKAGE).as_posix() for line in done.stdout.splitlines() if str(PACKAGE) in line]
    assert called, "the profiler has seen the table change"
    # The stack is that of one update; ByKind stands in _jit only where nothing is compiled, habits only looks at the
    # words of the call, kernel_calls says in which thread the loop is played, and the training state is made before.
    passed = ("_jit.py", "training/habits.py", "training/kernel_calls.py")
    assert [path for path in called if path not in passed] == [
        path for path in layers.UPDATE_PATH if path != "training/training_state.py"
    ]


def test_the_ten_files_are_ten() -> None:
    assert len(layers.TEN_FILES) == 10


@pytest.mark.parametrize("name", ["path", "ten"])
def test_the_sizes_on_the_page_are_about_right(name: str) -> None:
    written = layers.table_pattern(name).search(layers.PAGE.read_text("utf-8"))
    assert written is not None
    shown, now = written[1].strip().splitlines(), layers.table_of(name).splitlines()
    assert len(shown) == len(now), WRITE_ANEW
    for before, after in zip(shown, now, strict=True):
        words, numbers = split(before)
        words_now, numbers_now = split(after)
        assert words == words_now, WRITE_ANEW
        for number, number_now in zip(numbers, numbers_now, strict=True):
            assert abs(number - number_now) <= max(10, 0.1 * number_now), WRITE_ANEW


def split(row: str) -> tuple[str, list[int]]:
    """Return a row without its last two columns, and these where they are numbers."""
    found = re.fullmatch(r"(.*)\| (\d+) \| (\d+) \|", row)
    return (row, []) if found is None else (found[1], [int(found[2]), int(found[3])])


def test_lines_of_code_are_counted_without_blanks_comments_and_docstrings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layers, "PACKAGE", tmp_path)
    (tmp_path / "one.py").write_text('"""Doc\n\nstring."""\n\n# a comment\nx = (\n    1,  # one\n)\ny = """a\nb"""\n')
    assert layers.size_of("one.py") == (5, 10)
