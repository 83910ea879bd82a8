"""Compiled code is kept where a change in any source of the package makes it anew, and nothing depends on it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tuckerl import _kernel_cache

pytestmark = pytest.mark.slow


@pytest.fixture
def package(tmp_path: Path) -> Path:
    (tmp_path / "inner").mkdir()
    (tmp_path / "a.py").write_text("a = 1\n")
    (tmp_path / "inner" / "b.py").write_text("b = 2\n")
    return tmp_path


def test_the_same_sources_have_the_same_hash(package: Path) -> None:
    before = _kernel_cache._source_hash(package)
    (package / "notes.txt").write_text("not a source")
    assert _kernel_cache._source_hash(package) == before


@pytest.mark.parametrize("change", ["edit", "add", "remove", "rename", "move a line"])
def test_any_change_of_sources_changes_the_hash(package: Path, change: str) -> None:
    before = _kernel_cache._source_hash(package)
    if change == "edit":
        (package / "inner" / "b.py").write_text("b = 3\n")
    elif change == "add":
        (package / "c.py").write_text("")
    elif change == "remove":
        (package / "a.py").unlink()
    elif change == "rename":
        (package / "a.py").rename(package / "aa.py")
    else:
        (package / "a.py").write_text("")
        (package / "inner" / "b.py").write_text("a = 1\nb = 2\n")
    assert _kernel_cache._source_hash(package) != before


def test_the_cache_folder_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "here"))
    folder = _kernel_cache.cache_folder.__wrapped__()
    assert folder is not None
    assert Path(folder).parent == tmp_path / "here"
    assert Path(folder).is_dir()
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))  # where no folder can be made
    assert _kernel_cache.cache_folder.__wrapped__() is None


PROGRAM = """
import numba.core.config as config
before = config.CACHE_DIR
from tuckerl.rng import below
import numpy as np
below(3, np.ones(4, dtype=np.uint64))
assert config.CACHE_DIR == before, "other packages' kernels must not move with ours"
print(sum(below.for_python.stats.cache_hits.values()))
"""


@pytest.mark.compiled
def test_a_second_process_finds_the_compiled_code(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    hits = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True
        ).stdout.strip()
        for _ in range(2)
    ]
    assert hits == ["0", "1"]
    (folder,) = tmp_path.iterdir()
    assert folder.name.startswith("kernels-")


MINE = """
from typing import NamedTuple

class MyState(NamedTuple):
    number: int
"""
CHOICE = """
import numpy as np
from tuckerl.generalization.change_log import empty_log
from tuckerl.training.greedy_actions import greedy_action
from tuckerl.training.agent_arrays import AgentArrays, EpisodeRecord, Settings
from tuckerl.training.policies.greedy import GreedyArrays
from tuckerl.training.row_maxima import NoMaxima
from tuckerl.learners.q_learning import QLearningState

def choose(state):
    nothing, none = np.zeros(0), np.zeros(0, dtype=np.int64)
    path, stop = np.zeros((2, 1), dtype=np.int64), np.zeros(1, dtype=np.int64)
    record = EpisodeRecord(none, nothing, path, np.zeros((0, 1)), 0, 0, stop, 0)
    mask, stream = np.zeros((0, 0), dtype=np.bool_), np.ones(4, dtype=np.uint64)
    table = np.array([[1.0, 3.0, 2.0]])
    settings = Settings(0.9, 0.0, True)
    log = empty_log(1, 3, 0)
    arrays = (table, nothing, nothing, nothing, mask, settings, NoMaxima(), log, record, stream, nothing)
    agent = AgentArrays(state, GreedyArrays(), *arrays)
    assert greedy_action(agent, 0) == 1

choose(QLearningState())
"""


@pytest.mark.compiled
def test_code_compiled_for_an_algorithm_of_others_is_not_kept(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    (tmp_path / "mine.py").write_text(MINE)
    with_mine = "from mine import MyState\n" + CHOICE + "choose(MyState(1))\n"
    tell = "stats = greedy_action.for_python.stats\n"
    tell += "print(*(sum(counts.values()) for counts in (stats.cache_hits, stats.cache_misses)))"

    def run(code: str) -> str:
        command = [sys.executable, "-c", code + tell]
        return subprocess.run(
            command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout.strip()

    assert run(with_mine) == "0 2"
    assert run(with_mine) == "1 1"
    (tmp_path / "mine.py").unlink()  # what is kept must not ask for it
    assert run(CHOICE) == "1 0"


def run(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder)}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, cwd=folder.parent
    )


TWICE = (
    PROGRAM
    + """
from tuckerl.rng import uniform
uniform(np.ones(4, dtype=np.uint64))
"""
)
FULL = """
import numba.core.caching as caching

def save(self, key, data):
    raise OSError(28, "No space left on device")

caching.IndexDataCacheFile.save = save
"""


@pytest.mark.compiled
def test_a_full_disk_is_said_once_and_all_goes_on(tmp_path: Path) -> None:
    done = run(FULL + TWICE, tmp_path / "cache")
    assert done.stdout.strip() == "0"
    assert done.stderr.count("KernelCacheWarning") == 1
    assert "cannot be written: No space left on device; every process takes some seconds" in done.stderr


@pytest.mark.compiled
def test_without_a_folder_it_is_said_once_and_all_goes_on(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = run(TWICE, tmp_path / "file")
    assert done.stderr.count("KernelCacheWarning: compiled kernels are not kept, as no folder for them can be") == 1


@pytest.mark.compiled
@pytest.mark.parametrize("which", ["*.nbi", "*.nbc"])
def test_damaged_files_are_made_anew(tmp_path: Path, which: str) -> None:
    cache = tmp_path / "cache"
    assert run(PROGRAM, cache).stdout.strip() == "0"
    (damaged,) = cache.glob(f"*/**/*below*{which[1:]}")
    damaged.write_bytes(damaged.read_bytes()[:-40])
    done = run(PROGRAM, cache)
    assert (done.stdout.strip(), done.stderr.count("cannot be read")) == ("0", 1)
    done = run(PROGRAM, cache)
    assert (done.stdout.strip(), done.stderr) == ("1", "")


OTHER = """
from tuckerl.rng import below
import numpy as np
print(below(np.{kind}(3), np.ones(4, dtype=np.uint64)))
print(sum(below.for_python.stats.cache_hits.values()))
"""


@pytest.mark.compiled
def test_code_that_another_process_put_in_the_place_of_ours_is_not_used(tmp_path: Path) -> None:
    cache, elsewhere = tmp_path / "cache", tmp_path / "elsewhere"
    results = [
        run(OTHER.format(kind=kind), folder).stdout for kind, folder in (("int64", cache), ("float64", elsewhere))
    ]
    (ours,), (theirs,) = (list(folder.glob("*/**/*below*.nbc")) for folder in (cache, elsewhere))
    ours.write_bytes(theirs.read_bytes())  # both were the first of their index
    assert run(OTHER.format(kind="int64"), cache).stdout == results[0], "compiled again"


DAMAGED_AND_FULL = """
import numba.core.caching as caching

def full(self, overloads):
    raise OSError(28, "No space left on device")

caching.IndexDataCacheFile._save_index = full
"""


@pytest.mark.compiled
def test_a_damaged_index_on_a_full_disk_is_said_once_and_all_goes_on(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    run(PROGRAM, cache)
    (index,) = cache.glob("*/**/*below*.nbi")
    index.write_bytes(b"nothing that was ever written")
    done = run(DAMAGED_AND_FULL + PROGRAM, cache)
    assert (done.stdout.strip(), done.stderr.count("KernelCacheWarning")) == ("0", 1)
