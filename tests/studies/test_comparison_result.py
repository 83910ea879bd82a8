import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.studies.comparisons import small_comparison, tables_of
from tuckerl.studies.comparison_result import ComparisonResult, summarise_comparison
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.tables import StudyTables


def plain(
    base: list[list[float | None]], candidate: list[list[float | None]], measure: str = "return"
) -> ComparisonResult:
    made = small_comparison("sarsa", "q-learning", n_runs=len(base), n_episodes=len(base[0]), measure=measure)
    return summarise_comparison(made, tables_of(made, {"sarsa": base, "q-learning": candidate}))


def test_the_mean_return_of_pairs_by_hand() -> None:
    # Means of the runs: -4 and -6 against -2 and -3, so -5 against -2.5.
    result = plain([[-3, -5], [-5, -7]], [[-1, -3], [-4, -2]])
    assert result.difference.mean == pytest.approx(0.5)
    assert (result.difference.n_pairs, result.difference.relative) == (2, True)
    assert [one.mean for one in result.estimates] == [-5, -2.5]
    assert (result.estimates[0].low, result.estimates[0].high) == pytest.approx((-5 - 12.706205, -5 + 12.706205))
    assert result.verdict == "better"  # both pairs gained a half: every resample says so
    assert result.difference[1:3] == pytest.approx((0.5, 0.5))


def test_fewer_steps_are_better_where_steps_are_measured() -> None:
    result = plain([[-3, -5], [-5, -7]], [[-1, -3], [-4, -2]], "steps")
    assert result.difference.mean == pytest.approx(0.5)
    assert [one.mean for one in result.estimates] == [5, 2.5]
    assert result.curves[1].band.mean.tolist() == [2.5, 2.5]


def test_the_last_tenth_is_rounded_up() -> None:
    base: list[list[float | None]] = [[*[-1.0] * 22, -2.0, -4.0, -6.0]] * 2
    better: list[list[float | None]] = [[*[-9.0] * 22, -1.0, -1.0, -1.0]] * 2
    result = plain(base, better, "final")
    assert [one.mean for one in result.estimates] == [-4, -1]
    assert plain([[-1, -2]], [[-1, -3]], "final").estimates[1].mean == -3
    even: list[list[float | None]] = [[*[-9.0] * 18, -2.0, -4.0]]
    assert plain(even, even, "final").estimates[0].mean == -3


def test_where_the_base_can_be_0_the_difference_is_absolute() -> None:
    result = plain([[0.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [1.0, 1.0]])
    assert not result.difference.relative
    assert result.difference.mean == 0.5
    assert result.verdict == "better"
    mixed = plain([[-1.0], [2.0]], [[0.0], [3.0]])
    assert not mixed.difference.relative
    assert mixed.difference.mean == 1.0
    assert plain([[0.0], [0.0]], [[0.0], [0.0]]).verdict == "not decided"


def test_one_run_has_no_interval() -> None:
    result = plain([[-4, -4]], [[-2, -2]])
    assert result.difference.mean == 0.5
    assert math.isnan(result.difference.low)
    assert math.isnan(result.estimates[0].low)
    assert result.verdict == "not decided"


def test_diverged_runs_are_counted_and_left_out() -> None:
    result = plain([[-4, -4], [-2, -2], [-2, -2]], [[-2, None], [-1, -1], [-1, -1]])
    assert (result.difference.n_pairs, result.difference.n_diverged) == (2, 1)
    assert result.difference.mean == 0.5
    assert [one.n_diverged for one in result.estimates] == [0, 1]
    assert [curve.n_runs for curve in result.curves] == [3, 2]
    lost = plain([[-4], [-4]], [[None], [None]])
    assert math.isnan(lost.difference.mean)
    assert lost.to_dict()["difference"] is None
    assert lost.estimates[1].n_runs == 0


def test_the_control_is_compared_in_the_same_unit() -> None:
    made = small_comparison(n_agents=2, n_runs=2, n_episodes=1)
    base, candidate, control = (variant.name for variant in made.scenario.variants)
    tables = tables_of(made, {base: [[-4], [-8]], candidate: [[-2], [-4]], control: [[-1], [-2]]})
    result = summarise_comparison(made, tables)
    assert result.difference.mean == pytest.approx(0.5)
    assert result.control.mean == pytest.approx(-1)  # three against one and a half
    told = result.to_dict()
    assert (told["control"], told["control_difference"], told["no_control"]) == (control, pytest.approx(-1), None)
    absolute = summarise_comparison(
        made, tables_of(made, {base: [[-4], [-8]], candidate: [[-2], [-4]], control: [[0], [0]]})
    )
    assert not absolute.difference.relative
    assert (absolute.difference.mean, absolute.control.mean) == (3, -3)


def test_without_a_control_the_columns_are_null_and_the_reason_is_there() -> None:
    told = plain([[-4], [-4]], [[-2], [-2]]).to_dict()
    assert told["control"] is told["control_difference"] is told["control_low"] is told["control_high"] is None
    assert told["no_control"].startswith("neither of the two has a tensor step")
    assert json.loads(json.dumps(told, allow_nan=False))["variants"] == told["variants"]


def test_a_point_of_the_curves_is_the_mean_of_as_many_episodes_as_are_needed() -> None:
    values: list[list[float | None]] = [[-float(episode) for episode in range(1, 252)]] * 2
    result = plain(values, [[-1.0] * 251] * 2)
    assert result.episode.size == 84  # of three episodes each, the last of two
    assert result.episode[[0, 1, -1]].tolist() == [3, 6, 251]
    assert result.curves[0].band.mean[[0, 1, -1]].tolist() == [-2, -5, -250.5]
    assert result.curves[1].against_base.mean[0] == 1
    few = plain([[-1, -2]], [[-1, -2]])
    assert few.episode.tolist() == [1, 2]


def test_agents_are_averaged(tmp_path: Path) -> None:
    made = small_comparison(n_agents=3)
    tables = run_study(made.study, tmp_path, workers=1)
    result = summarise_comparison(made, tables)
    own = tables.runs.filter(variant="tsarsa-lambda-3").sort("run", "agent", "episode")["return"].to_numpy()
    by_run = own.reshape(2, 3 * 20).mean(axis=1)
    assert result.estimates[1].mean == pytest.approx(by_run.mean())
    assert result.curves[1].band.mean == pytest.approx(own.reshape(2, 3, 20).mean(axis=(0, 1)))


def test_the_same_tables_give_the_same_intervals_and_each_difference_has_a_stream_of_its_own() -> None:
    made = small_comparison(n_runs=8, n_episodes=3)
    rng = np.random.default_rng(0)
    names = [variant.name for variant in made.scenario.variants]
    drawn = {name: (-rng.integers(5, 40, size=(8, 3))).astype(float).tolist() for name in names}
    tables: StudyTables = tables_of(made, drawn)
    assert summarise_comparison(made, tables).to_dict() == summarise_comparison(made, tables).to_dict()
    drawn[names[2]] = drawn[names[0]]  # the control does what the base does
    result = summarise_comparison(made, tables_of(made, drawn))
    assert result.control.mean == result.difference.mean
    assert result.control.low != result.difference.low
