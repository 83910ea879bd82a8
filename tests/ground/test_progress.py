"""How many workers there are."""

import os

import pytest

from tuckerl.progress import default_workers


def test_there_is_a_worker_for_each_core_that_is_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 2, 5}, raising=False)
    assert default_workers() == 3
    monkeypatch.delattr(os, "sched_getaffinity")  # not everywhere is it known
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert default_workers() == 4
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert default_workers() == 1
