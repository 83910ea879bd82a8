"""Files of saved learners: data only, and refused when they are not what they should be."""

import hashlib
import io
from pathlib import Path

import numpy as np
import pytest

from tests.learners.worlds import corridor
from tuckerl import DynaH, QLearning, TensorStep
from tuckerl.errors import ParameterError, RankWarning, SavedFileError

STEP = TensorStep(every=4, ranks=(2, 2, 2, 1))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    QLearning(corridor(), seed=0, tensor_step=STEP).learn(6).save(tmp_path / "agent.tuckerl")
    return tmp_path / "agent.tuckerl"


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        QLearning.load(tmp_path / "nothing")


def test_every_truncation_is_refused(path: Path) -> None:
    content = path.read_bytes()
    for length in [*range(120), *range(120, len(content), 97), len(content) - 1]:
        path.write_bytes(content[:length])
        with pytest.raises(SavedFileError, match=r"not a saved learner|truncated or damaged"):
            QLearning.load(path)


def test_every_flipped_byte_is_refused(path: Path) -> None:
    content = path.read_bytes()
    for place in [*range(100), *range(100, len(content), 61)]:
        flipped = bytearray(content)
        flipped[place] ^= 0x41
        path.write_bytes(bytes(flipped))
        with pytest.raises(SavedFileError, match=r"not a saved learner|truncated or damaged"):
            QLearning.load(path)


def test_longer_files_are_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(SavedFileError, match="truncated or damaged"):
        QLearning.load(path)


def test_a_newer_version_is_refused(path: Path) -> None:
    first, _, rest = path.read_bytes().partition(b"\n")
    path.write_bytes(first[:-1] + b"12\n" + rest)
    with pytest.raises(SavedFileError, match=r"has format 12, and this version .* up to format 3: update tuckerl"):
        QLearning.load(path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"a,b\n1,2\n", b"\x80\x04N."])
def test_other_files_are_refused(content: bytes, path: Path) -> None:
    path.write_bytes(content)
    with pytest.raises(SavedFileError, match="is not a saved learner"):
        QLearning.load(path)


@pytest.mark.parametrize("body", [b"", b"no archive"])
def test_a_body_that_is_no_archive_is_refused(body: bytes, path: Path) -> None:
    digest = hashlib.sha256(body).hexdigest().encode()
    path.write_bytes(b"tuckerl learner, format 2\n" + digest + b"\n" + body)
    with pytest.raises(SavedFileError, match="holds no sound learner"):
        QLearning.load(path)


def test_another_learner_is_refused(path: Path) -> None:
    with pytest.raises(SavedFileError, match=r"holds a QLearning, not a DynaH: load it with QLearning\.load"):
        DynaH.load(path)


def test_there_are_no_pickled_objects_in_it(tmp_path: Path) -> None:
    DynaH(corridor(), seed=0, n_agents=2, tensor_step=STEP).learn(6).save(tmp_path / "agent.tuckerl")
    body = (tmp_path / "agent.tuckerl").read_bytes().split(b"\n", 2)[2]
    with np.load(io.BytesIO(body), allow_pickle=False) as archive:
        for name in archive.files:
            assert name == "manifest.json" or not archive[name].dtype.hasobject


def test_saving_replaces_a_file_and_leaves_nothing_beside_it(path: Path) -> None:
    QLearning(corridor(), seed=3).learn(2).save(str(path))
    assert QLearning.load(str(path)).episodes == 2
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def _flat(decomposition: object) -> list[float]:
    return [0.5, 0.5]


def test_functions_must_be_given_again(tmp_path: Path) -> None:
    step = TensorStep(every=4, ranks=(2, 2, 2, 1), weights=_flat)
    path = tmp_path / "agent.tuckerl"
    whole = QLearning(corridor(), seed=0, tensor_step=step).learn(12)
    QLearning(corridor(), seed=0, tensor_step=step).learn(6).save(path)
    with pytest.raises(SavedFileError, match=r"functions of its own \(weights\).* pass load\(\) a tensor_step"):
        QLearning.load(path)
    with pytest.raises(ParameterError, match="its every was 4; got 5"):
        QLearning.load(path, tensor_step=TensorStep(every=5, ranks=(2, 2, 2, 1), weights=_flat))
    with pytest.raises(ParameterError, match=r"its ranks was \[2, 2, 2, 1\]; got \(2, 2, 2, 2\)"):
        QLearning.load(path, tensor_step=TensorStep(every=4, ranks=(2, 2, 2, 2), weights=_flat))
    with pytest.raises(ParameterError, match="its weights was a function; got 'paper'"):
        QLearning.load(path, tensor_step=TensorStep(every=4, ranks=(2, 2, 2, 1)))
    again = QLearning.load(path, tensor_step=step).learn(6)
    np.testing.assert_array_equal(again.q, whole.q)


def test_a_step_that_is_not_needed_is_refused(path: Path) -> None:
    with pytest.raises(ParameterError, match="holds all of its tensor step: load it without"):
        QLearning.load(path, tensor_step=STEP)


def test_a_loaded_step_is_equal(path: Path) -> None:
    assert QLearning.load(path).tensor_step == STEP


@pytest.mark.parametrize("ranks", ["auto", 0.9])
def test_ranks_by_energy_are_kept_and_gone_on_with(ranks: str | float, tmp_path: Path) -> None:
    step = TensorStep(every=4, ranks=ranks)
    QLearning(corridor(), seed=0, tensor_step=step, n_agents=2).learn(6).save(tmp_path / "agent.tuckerl")
    again = QLearning.load(tmp_path / "agent.tuckerl")
    assert again.tensor_step == step
    whole = QLearning(corridor(), seed=0, tensor_step=step, n_agents=2).learn(12)
    np.testing.assert_array_equal(again.learn(6).q, whole.q)
    np.testing.assert_array_equal(again.tensor_step_history.ranks, whole.tensor_step_history.ranks)
    assert (whole.tensor_step_history.ranks > 0).all()


def test_a_warning_names_the_line_that_learns() -> None:
    learner = QLearning(corridor(), seed=0, tensor_step=TensorStep(every=2, ranks=(9, 9, 9, 9)))
    with pytest.warns(RankWarning, match="clipped") as caught:
        learner.learn(2)
    assert [warning.filename for warning in caught] == [__file__]
