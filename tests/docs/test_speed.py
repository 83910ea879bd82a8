"""The numbers on the page about speed are those that were measured."""

import json

import pytest
from benchmarks import guard
from docs.pictures import layers, speed


@pytest.mark.parametrize("name", list(speed.TABLES))
def test_the_tables_are_made_of_what_was_measured(name: str) -> None:
    written = layers.table_pattern(name).search(speed.PAGE.read_text("utf-8"))
    assert written is not None
    measured = json.loads(speed.MEASURED.read_text("utf-8"))
    assert written[1].strip() == speed.TABLES[name](measured[name]), "run python -m docs.pictures.speed --draw"


def test_a_size_is_told_by_its_rows() -> None:
    measured = {f"2 x 3: {part}": 1e-9 for part in speed.STEP_PARTS} | {f"2 x 3: {speed.WHOLE}": 9e-9}
    assert speed.sizes(measured) == ["2 x 3"]
    assert speed.step_table(measured).splitlines()[-2:] == ["| the whole step | 9.0 |", "| of it waiting | 4.0 |"]


def test_a_kernel_that_has_lost_is_warned_of() -> None:
    kept = {"one": 1.0, "two": 1.0}
    lines = guard.lines({"one": 0.86, "two": 0.84, "new": 0.1}, kept)
    assert ["WARNING" in line for line in lines] == [False, True, False]
    assert set(guard.lines(kept, json.loads(guard.KEPT.read_text("utf-8")))), "what is kept can be read"
