"""The data of curves that a page lets its readers explore: the numbers of the figure, and the runs behind them."""

import base64
import csv
from typing import Any

import numpy as np
import pytest

from tests.reports.examples import SCENARIO, SCENARIOS, study_of, summary_of, tables_of
from tuckerl.reports.action_weights import weight_text
from tuckerl.reports.curves import panels_of
from tuckerl.reports.figure import csv_of, draw_figures
from tuckerl.reports.lines import curve_columns, live_curves
from tuckerl.reports.live_weights import live_weights, weight_columns
from tuckerl.reports.panels import Panels
from tuckerl.reports.paths import PATHS
from tuckerl.studies.study import Scenario
from tuckerl.studies.summary import Path, Summary, summarise
from tuckerl.types import FloatArray


@pytest.fixture(scope="module")
def panels() -> Panels:
    """Those of runs of which one diverged: run 2 of dyna-ht-1."""
    return panels_of(summarise(study_of(), tables_of())[1][0])


@pytest.fixture(scope="module")
def content(panels: Panels) -> dict[str, Any]:
    return live_curves(panels, "curves").content


def decoded(runs: dict[str, Any]) -> FloatArray:
    codes = np.frombuffer(base64.b64decode(runs["codes"]), "<u2").reshape(len(runs["numbers"]), -1)
    return np.asarray(runs["low"] + runs["step"] * codes)


def test_the_lines_are_those_of_the_figure(panels: Panels, content: dict[str, Any]) -> None:
    upper, lower = content["panels"]
    assert [name for name, *_ in upper["lines"][""]] == [curve.variant for curve in panels.curves]
    for (_, mean, low, high, n), curve in zip(upper["lines"][""], panels.curves, strict=True):
        for shown, expected in zip((mean, low, high), curve.band, strict=True):
            assert shown == pytest.approx(expected.tolist(), rel=1e-4)
        assert n == curve.n_runs
    for name, mean, low, high, n in lower["lines"]["dyna-h"]:
        for shown, expected in zip((mean, low, high), panels.gains[name], strict=True):
            assert shown == pytest.approx(expected.tolist(), rel=1e-4)
        assert n == (2 if name == "dyna-ht-1" else 3)


def test_differences_can_be_taken_from_the_controls(panels: Panels, content: dict[str, Any]) -> None:
    _, lower = content["panels"]
    plain = [one.name for one in SCENARIO.variants if one.tensor_step is None or one.tensor_step.weights != "paper"]
    assert content["choose"]["names"] == list(lower["lines"]) == plain
    assert lower["labels"]["constant-1"] == "steps saved against constant-1"
    samples = {curve.variant: curve.samples for curve in panels.curves}
    (mean,) = (mean for name, mean, *_ in lower["lines"]["constant-1"] if name == "dyna-ht-1")
    saved = samples["constant-1"].values[:2] - samples["dyna-ht-1"].values
    assert mean == pytest.approx(saved.mean(axis=0).tolist(), rel=1e-4)


def test_single_runs_are_rounded_and_those_that_diverged_are_left_out(panels: Panels, content: dict[str, Any]) -> None:
    for runs, curve in zip(content["runs"]["variants"], panels.curves, strict=True):
        assert runs["numbers"] == ([0, 1] if curve.variant == "dyna-ht-1" else [0, 1, 2])
        assert runs["left_out"] == 0
        assert decoded(runs) == pytest.approx(curve.samples.values, abs=runs["step"])
        assert runs["step"] <= np.ptp(curve.samples.values) / 65_000
        assert runs["totals"] == pytest.approx(curve.samples.values[:, -1].tolist(), rel=1e-4)


def test_of_too_many_runs_evenly_chosen_ones_are_in_the_page(panels: Panels) -> None:
    most = 2 * panels.episode.size * len(panels.curves)  # two runs of each
    runs = live_curves(panels, "curves", most).content["runs"]["variants"][0]
    assert (runs["numbers"], runs["left_out"]) == ([0, 2], 1)


def test_files_have_a_row_for_each_variant_and_point(panels: Panels) -> None:
    rows = list(csv.DictReader(csv_of(curve_columns(panels)).splitlines()))
    assert len(rows) == len(panels.curves) * panels.episode.size
    last = rows[-1]
    assert last["variant"] == panels.curves[-1].variant
    assert float(last["mean"]) == pytest.approx(panels.curves[-1].band.mean[-1], rel=1e-4)
    assert float(last["gain_low"]) == pytest.approx(panels.gains[last["variant"]].low[-1], rel=1e-4)


@pytest.mark.parametrize("scenario", [SCENARIO, SCENARIOS[2]], ids=lambda scenario: scenario.name)
def test_weights_of_every_variant_can_be_chosen(scenario: Scenario) -> None:
    summary = summary_of(scenario)
    text = weight_text(summary)
    live = live_weights(summary, text)
    assert live is not None
    content = live.content
    assert set(content["choose"]["names"]) == {course.variant for course in summary.weights}
    assert content["choose"]["names"][0] == f"{scenario.algorithm.t_version}-1"
    weights = content["panels"][0]["lines"][f"{scenario.algorithm.t_version}-1"]
    assert [mean[-1] for _, mean, *_ in weights] == pytest.approx(
        [b.mean[-1] for b in summary.weights[0].bands], rel=1e-4
    )
    assert {name for name, *_ in weights} <= content["looks"].keys()
    rows = csv_of(weight_columns(summary, text)).splitlines()
    assert len(rows) == 1 + len(summary.weights) * 2 * scenario.algorithm.n_actions


def paths_in_page(summary: Summary) -> list[dict[str, Any]]:
    (figure,) = draw_figures([PATHS], summary)
    assert figure.live is not None
    paths: list[dict[str, Any]] = figure.live.content["paths"]
    return paths


def test_the_paths_of_all_episodes_are_in_the_page() -> None:
    summary = summary_of()
    assert [path["episodes"] for path in paths_in_page(summary)] == [[], [], []]  # of older results
    walked = (np.array([0, 1, 2]), np.array([0, 1]))
    again = summary._replace(paths=(Path("dyna-h", walked[1], walked),))
    (path,) = paths_in_page(again)
    assert path["episodes"] == [[0, 1, 2], [0, 1]]
    assert path["best"] == [0, 1]
