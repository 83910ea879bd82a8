import json
import math
from pathlib import Path

import numpy as np
import pytest

from tuckerl.studies import remembered
from tuckerl.studies.remembered import FILE, Remembered
from tuckerl.studies.statistics import Difference, seeded_difference
from tuckerl.types import FloatArray

RNG = np.random.default_rng(0)
SAMPLES = RNG.normal(5, 1, 20), RNG.normal(6, 1, 20)


def asked(folder: Path, samples: tuple[FloatArray, FloatArray] = SAMPLES, entropy: int = 3) -> Difference:
    known = Remembered(folder)
    found = known(samples, 1.0, 2, [entropy], relative=True)
    known.write()
    return found


@pytest.fixture
def worked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Count what is worked out."""
    calls: list[int] = []

    def counted(*arguments: object, **options: object) -> Difference:
        calls.append(1)
        return seeded_difference(*arguments, **options)  # type: ignore[arg-type]  # as they came

    monkeypatch.setattr(remembered, "seeded_difference", counted)
    return calls


def test_a_difference_is_worked_out_once(tmp_path: Path, worked: list[int]) -> None:
    expected = seeded_difference(SAMPLES, 1.0, 2, [3], relative=True)
    assert [asked(tmp_path) for _ in range(3)] == [expected] * 3
    assert len(worked) == 1
    one = (np.ones(1), np.ones(1))
    assert math.isnan(asked(tmp_path, (np.zeros(0), np.zeros(0))).mean)
    assert asked(tmp_path, one) == asked(tmp_path, one)


def test_anything_else_that_decides_it_is_worked_out_anew(tmp_path: Path, worked: list[int]) -> None:
    first = asked(tmp_path)
    assert asked(tmp_path, entropy=4).low != first.low
    asked(tmp_path, (SAMPLES[0], SAMPLES[1] + 1e-12))
    asked(tmp_path, (SAMPLES[1], SAMPLES[0]))
    assert len(worked) == 4


def test_a_changed_file_is_not_believed(tmp_path: Path, worked: list[int]) -> None:
    first = asked(tmp_path)
    held = json.loads((tmp_path / FILE).read_text())
    (name,) = held["differences"]
    held["differences"][name][0] = 7.0
    for content in (json.dumps(held), "[]", "{", "", "[" * 9999, '{"differences": 3, "digest": 3}'):
        (tmp_path / FILE).write_text(content)
        assert asked(tmp_path) == first
    assert len(worked) == 7


def test_what_is_not_asked_for_any_more_is_forgotten(tmp_path: Path) -> None:
    asked(tmp_path)
    asked(tmp_path, entropy=4)
    assert len(json.loads((tmp_path / FILE).read_text())["differences"]) == 1
