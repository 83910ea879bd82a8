import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.reports.examples import SCENARIO, SCENARIOS, ablation_of, difference
from tuckerl.reports.ablation import (
    ABLATION,
    CHAIN,
    SHARING,
    SLOW,
    draw_ablation,
    mark_of,
    what_works,
    without_the_step,
)
from tuckerl.reports.figure import own_style
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.statistics import NO_DIFFERENCE
from tuckerl.studies.study import Scenario


def dots(figure: Figure) -> dict[float, tuple[float, str]]:
    """Return each row's dot: its place and whether it is filled."""
    marked = [line for line in figure.axes[0].lines if line.get_marker() not in ("", "None", None)]
    return {
        float(np.asarray(line.get_ydata())[0]): (
            float(np.asarray(line.get_xdata())[0]),
            "hollow" if line.get_markerfacecolor() == "white" else "filled",
        )
        for line in marked
    }


def test_every_ingredient_has_its_dot_its_interval_and_its_pairs() -> None:
    ablation = ablation_of()
    figure = draw_ablation(ablation)
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == [one.label for one in ablation.steps]
    found = dots(figure)
    for place, one in enumerate(ablation.steps):
        if math.isnan(one.difference.mean):
            assert place not in found
        else:
            assert found[place] == (
                100 * one.difference.mean,
                "filled" if abs(one.difference.mean) > 0.05 else "hollow",
            )
    intervals = [np.asarray(line.get_xdata()).tolist() for line in axes.lines]
    assert [100 * value for value in ablation.steps[0].difference[1:3]] in intervals
    words = [text.get_text() for text in axes.texts]
    assert words.count("no pair left") == 2
    assert (words.count("3"), words.count("0 (3 lost)"), words.count("0")) == (len(ablation.steps) - 2, 1, 1)
    assert "dyna-h" in words


def test_letters_are_at_least_8_points() -> None:
    with own_style():
        axes = draw_ablation(ablation_of()).axes[0]
        texts = [*axes.texts, *axes.get_xticklabels(), *axes.get_yticklabels(), axes.xaxis.label]
        assert min(float(text.get_fontsize()) for text in texts) >= 8


def test_kinds_of_ingredients_look_different() -> None:
    ablation = ablation_of()
    marks = [mark_of(ablation, one) for one in ablation.steps]
    assert marks == [CHAIN] * 3 + [SHARING] * 6 + [SLOW]
    assert len({mark.marker for mark in marks}) == 3


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_each_scenario_has_its_own_figure(scenario: Scenario) -> None:
    shown = ABLATION.render(ablation_of(scenario))
    assert shown.name == f"ablation-{scenario.name}"
    assert scenario.algorithm.base in shown.caption
    assert "nan" not in (shown.caption + shown.alt).lower()
    assert shown == ABLATION.render(ablation_of(scenario))


def test_the_sentence_is_worked_out_from_the_intervals() -> None:
    text = what_works(ablation_of())
    assert text == (
        "By the intervals of each step over the one before it, the work is done by: ingredient constant-1 (+30.0 % "
        "[25.0, 35.0] over dyna-h); and ingredient dyna-ht-1 (+20.0 % [15.0, 25.0] over permuted-1), though not better "
        "than dyna-h as far as these runs can tell. Worse than the step before: ingredient permuted-1 "
        "(\N{MINUS SIGN}40.0 % [\N{MINUS SIGN}45.0, \N{MINUS SIGN}35.0] over constant-1). The interval covers 0 for 4 "
        "other steps. Too few pairs are left for 2 steps."
    )


def with_all(value: float) -> Ablation:
    ablation = ablation_of()
    added = NO_DIFFERENCE if math.isnan(value) else difference(value)
    return ablation._replace(steps=tuple(one._replace(added=added, difference=added) for one in ablation.steps))


def test_the_sentence_says_when_nothing_helps_or_nothing_can_be_told() -> None:
    assert what_works(with_all(0.0)) == (
        "No ingredient adds a gain whose whole interval lies above 0. The interval covers 0 for 9 other steps."
    )
    assert what_works(with_all(math.nan)).startswith("Which ingredient does the work cannot be told")
    still_worse = ablation_of()
    first = still_worse.steps[0]._replace(difference=difference(-0.3))
    still_worse = still_worse._replace(steps=(first, *still_worse.steps[1:]))
    assert "over dyna-h), though still worse than dyna-h" in what_works(still_worse)


def test_the_slower_base_is_told_apart() -> None:
    assert without_the_step(ablation_of()).endswith("without any tensor step: +2.0 % [\N{MINUS SIGN}3.0, 7.0].")
    assert "slow" not in what_works(ablation_of())
    assert without_the_step(with_all(math.nan)) == ""
    assert without_the_step(ablation_of()._replace(steps=())) == ""


def test_a_gain_without_pairs_can_be_drawn() -> None:
    lost = with_all(math.nan)
    assert ABLATION.render(lost).svg
    assert ABLATION.render(lost._replace(scenario=replace(lost.scenario, n_runs=1))).caption
    assert SCENARIO.algorithm.base in ABLATION.render(lost).caption
