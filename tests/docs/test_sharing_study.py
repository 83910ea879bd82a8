"""The page on when to share has the numbers that came out; the study tunes on other runs than it tests on."""

import json

import pytest
from docs.pictures import layers, sharing

pytestmark = pytest.mark.slow

SETTINGS = json.loads(sharing.SETTINGS.read_text("utf-8"))
RESULTS = json.loads(sharing.RESULTS.read_text("utf-8"))


@pytest.mark.parametrize("name", list(sharing.TABLES))
def test_the_tables_are_made_of_what_came_out(name: str) -> None:
    written = layers.table_pattern(name).search(sharing.PAGE.read_text("utf-8"))
    assert written is not None
    assert written[1].strip() == sharing.TABLES[name](RESULTS), "run python -m docs.pictures.sharing --draw"


def test_what_came_out_is_of_these_settings() -> None:
    assert list(RESULTS) == list(SETTINGS["problems"])
    for name, problem in SETTINGS["problems"].items():
        result = RESULTS[name]
        assert result["runs"] == SETTINGS["runs"]["test"]
        points = [{parameter: tried[parameter] for parameter in problem["grid"]} for tried in result["grid"]]
        sizes = [len(values) for values in problem["grid"].values()]
        assert len(points) == sizes[0] * sizes[1]
        for point in points:
            assert all(value in problem["grid"][parameter] for parameter, value in point.items())
        best = (max if problem["larger_is_better"] else min)(tried["mean"] for tried in result["grid"])
        assert result["tuned"] | {"mean": best} in result["grid"]


def test_tuning_and_test_share_neither_seeds_nor_mazes() -> None:
    assert SETTINGS["seeds"]["tuning"] != SETTINGS["seeds"]["test"]
    first, runs = SETTINGS["first maze"], SETTINGS["runs"]
    tuning, test = (set(range(first[phase], first[phase] + runs[phase])) for phase in ("tuning", "test"))
    assert not tuning & test


def test_a_study_of_one_problem_can_be_played() -> None:
    small = SETTINGS | {"runs": {"tuning": 1, "test": 2}, "first maze": {"tuning": 7, "test": 0}}
    problem = SETTINGS["problems"]["DYNA maze"] | {"episodes": 10, "grid": {"alpha": [0.1, 0.2], "epsilon": [0.0]}}
    small["problems"] = {"DYNA maze": problem}
    ((name, result),) = sharing.study(small, ["DYNA maze"])
    assert (name, result["runs"], len(result["grid"])) == ("DYNA maze", 2, 2)
    assert set(result["variants"]) == set(sharing.VARIANTS)
