"""Files of every version stay readable, and learning goes on from them as it did then.

`make_saved_files` says how those of formats 2 and 3 were made. Numbers are compared to 1e-9: other machines add up in
another order.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import drift
from tests.training.make_saved_files import ENVIRONMENTS, learners
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TeamQ
from tuckerl.errors import SavedFileError
from tuckerl.training import learner_file as saved

FOLDER = Path(__file__).parent / "saved_files"
LEARNERS: dict[str, Any] = {kind.__name__: kind for kind in (QLearning, Sarsa, SarsaLambda, DynaH, TeamQ)}
FILES = sorted(FOLDER.glob("*.tuckerl"))

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")


def load(path: Path) -> Any:
    header = saved.read(path).header
    version, _, name = path.stem.partition("_")
    make: Any = ENVIRONMENTS.get(name) if version != "format1" else drift if "simulator" in header["problem"] else None
    return LEARNERS[header["learner"]].load(path, env=None if make is None else make())


def test_there_are_files_of_every_version_and_kind() -> None:
    names = [path.stem for path in FILES]
    assert len([name for name in names if name.startswith("format1_")]) == 5
    for version in ("format2_", "format3_"):
        assert {name.removeprefix(version) for name in names if name.startswith(version)} == set(learners())
    assert saved.FORMAT_VERSION == 3, "keep files of the new version, too"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_old_files_are_read_and_gone_on_with(path: Path) -> None:
    version, _, name = path.stem.partition("_")
    with np.load(FOLDER / f"{version}_after.npz") as after:
        expected = {key.partition(".")[2]: after[key] for key in after.files if key.startswith(f"{name}.")}
    learner = load(path)
    assert learner.episodes == 6
    learner.learn(6)
    assert expected.keys() >= {"q", "steps"}
    for key, value in expected.items():
        np.testing.assert_allclose(getattr(learner, key), value, rtol=1e-9, atol=1e-9, err_msg=key)


@pytest.mark.parametrize("name", ["generator", "reseeded", "players", "joint"])
def test_files_of_learners_in_python_environments_are_refused_when_altered(name: str, tmp_path: Path) -> None:
    content, path = (FOLDER / f"format2_{name}.tuckerl").read_bytes(), tmp_path / "agent"
    kind = LEARNERS[saved.read(FOLDER / f"format2_{name}.tuckerl")[0]["learner"]]
    altered = [content[:length] for length in [*range(0, 120, 7), *range(120, len(content), 211), len(content) - 1]]
    for place in [*range(0, 100, 9), *range(100, len(content), 197)]:
        flipped = bytearray(content)
        flipped[place] ^= 0x41
        altered.append(bytes(flipped))
    for damaged in altered:
        path.write_bytes(damaged)
        with pytest.raises(SavedFileError, match=r"not a saved learner|truncated or damaged"):
            kind.load(path, env=ENVIRONMENTS[name]())
