from dataclasses import replace
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.reports.examples import LEVELS, N_EPISODES, SCENARIO, SCENARIOS, nothing_of, summary_of
from tuckerl.errors import ProblemError
from tuckerl.problems.maze import sutton_maze
from tuckerl.reports.action_weights import WEIGHTS
from tuckerl.reports.curves import CURVES, panels_of
from tuckerl.reports.figure import FigureSpec, draw_figures, own_style
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.paths import PATHS, draw_paths
from tuckerl.reports.styles import EndLabel, count_episodes, label_ends, line_styles
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.figure_text import WeightText
from tuckerl.studies.statistics import Band
from tuckerl.studies.study import Scenario, variant
from tuckerl.studies.summary import Summary


def summary_name(spec: FigureSpec[Any], scenario: Scenario) -> str:
    return spec.text_of(summary_of(scenario)).name


DRAWN = {
    summary_name(spec, scenario): (spec, scenario)
    for scenario in SCENARIOS
    for spec in FIGURES
    if spec.subject is Summary and spec.applies(summary_of(scenario))
}
"""Every figure of the paper's scenarios."""


@pytest.fixture(params=DRAWN)
def drawn(request: pytest.FixtureRequest) -> tuple[FigureSpec[Any], Scenario]:
    return DRAWN[request.param]


def test_scenarios_have_the_papers_figures() -> None:
    assert list(DRAWN) == [
        *("fig9", "omega-cart-pole"),
        *("fig10", "fig11", "omega-dyna-maze"),
        *("fig13", "omega-robot-rescue"),
    ]


def line_data(figure: Figure, panel: int, place: int) -> tuple[list[float], list[float]]:
    x, y = figure.axes[panel].lines[place].get_data()
    return np.asarray(x).tolist(), np.asarray(y).tolist()


def test_fig10_draws_the_paths_of_the_summary_and_the_shortest_one() -> None:
    summary, maze = summary_of(), sutton_maze()
    figure = draw_paths(summary)
    assert len(figure.axes) == 4
    for panel, path in enumerate(summary.paths):
        cells = [maze.cell(state) for state in path.states]
        assert line_data(figure, panel, 0) == ([c for _, c in cells], [r for r, _ in cells])
    shortest = maze.shortest_path()
    assert line_data(figure, 3, 0) == ([c for _, c in shortest], [r for r, _ in shortest])


def test_fig10_says_the_steps_found_and_those_of_the_paper() -> None:
    figure = draw_paths(summary_of())
    words = [axes.texts[0].get_text() for axes in figure.axes]
    assert words == ["15 steps (paper: 90)", "15 steps (paper: 83)", "15 steps (paper: 59)", "14 steps"]
    assert [axes.get_title(loc="left") for axes in figure.axes] == [*SCENARIO.record_paths_of, "shortest possible"]


def test_fig10_shows_the_walls_where_they_are_and_row_0_at_the_top() -> None:
    figure = draw_paths(summary_of())
    squares = figure.axes[0].collections[0].get_paths()
    centres = {tuple(np.asarray(square.vertices)[:4].mean(axis=0)) for square in squares}
    assert centres == {(column, row) for row, column in np.argwhere(sutton_maze().walls).tolist()}
    bottom, top = figure.axes[0].get_ylim()
    assert bottom > top


def test_fig10_says_when_a_path_misses_the_goal() -> None:
    summary = summary_of()
    cut = summary.paths[0]._replace(states=summary.paths[0].states[:-1])
    figure = draw_paths(summary._replace(paths=(cut,)))
    assert figure.axes[0].texts[0].get_text() == "14 steps, goal not reached (paper: 90)"


def test_fig10_needs_a_maze() -> None:
    summary = summary_of()
    scenario = replace(SCENARIO, problem=lambda _: sutton_maze().to_mdp())
    assert not PATHS.applies(summary._replace(scenario=scenario))
    with pytest.raises(ProblemError, match="only paths in a Maze"):
        draw_paths(summary._replace(scenario=scenario))


def test_fig11_shows_totals_above_and_gains_below() -> None:
    summary = summary_of()
    figure = CURVES.draw(summary)
    upper, lower = figure.axes
    assert upper.get_ylabel() == "cumulative cost (steps in 1 maze)"
    assert lower.get_ylabel() == "steps saved against dyna-h"
    assert lower.get_xlabel() == "episodes"
    episodes = list(range(1, N_EPISODES + 1))
    for place, curve in enumerate(summary.curves):
        assert line_data(figure, 0, place) == (episodes, curve.band.mean.tolist())
    for place, curve in enumerate(summary.curves[1:]):
        assert line_data(figure, 1, place) == (episodes, (-curve.against_base.mean).tolist())
    names = {variant.name for variant in SCENARIO.variants}
    assert {text.get_text() for text in upper.texts} == names
    assert {text.get_text() for text in lower.texts} == names


def test_fig11_turns_bands_with_their_lines() -> None:
    summary = summary_of()
    for band in list(panels_of(summary).gains.values())[1:]:
        assert (band.low < band.mean).all()
        assert (band.mean < band.high).all()
    band_of_last = np.asarray(CURVES.draw(summary).axes[1].collections[-1].get_paths()[0].vertices)
    against = summary.curves[-1].against_base
    assert band_of_last[:, 1].min() == (-against.high).min()
    assert band_of_last[:, 1].max() == (-against.low).max()


def test_more_of_a_measure_can_be_better() -> None:
    summary = summary_of(SCENARIOS[0])
    gains = list(panels_of(summary).gains.values())[1:]
    assert gains == [curve.against_base for curve in summary.curves[1:]]


def test_omega_shows_each_action_of_the_pictured_variants_and_the_control() -> None:
    summary = summary_of()
    figure = DRAWN["omega-dyna-maze"][0].draw(summary)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["dyna-ht-1", "dyna-ht-3"]
    for panel in range(2):
        for action, level in enumerate((0.5, 0.4, 0.6, 0.48)):
            assert line_data(figure, panel, action) == ([10, 20], [level, level])
        assert line_data(figure, panel, 4)[1] == [0.5, 0.5]
        texts = [text.get_text() for text in figure.axes[panel].texts]
        assert texts == ["down", "right", "up", "constant", "left"]


@pytest.mark.slow
def test_files_are_the_same_bytes_whatever_the_users_settings(drawn: tuple[FigureSpec[Any], Scenario]) -> None:
    spec, scenario = drawn
    first = spec.render(summary_of(scenario))
    with mpl.rc_context({"lines.linewidth": 9, "svg.hashsalt": "other", "font.size": 20, "axes.facecolor": "red"}):
        second = spec.render(summary_of(scenario))
        assert mpl.rcParams["font.size"] == 20
    assert first == second
    assert first.png.startswith(b"\x89PNG")
    assert b"<date>" not in first.svg.lower().replace(b"dc:", b"")


@pytest.mark.parametrize("n_episodes", [None, 1, 10])
def test_little_or_nothing_can_be_drawn(drawn: tuple[FigureSpec[Any], Scenario], n_episodes: int | None) -> None:
    spec, scenario = drawn
    summary = nothing_of(scenario) if n_episodes is None else summary_of(scenario, n_episodes)
    spec.draw(summary).canvas.draw()
    words = spec.caption(summary) + spec.alt(summary)
    assert words
    assert "nan" not in words.lower()


def test_weights_of_runs_that_all_diverged_later_can_be_drawn() -> None:
    for spec, scenario in (DRAWN[name] for name in DRAWN if name.startswith("omega")):
        summary = summary_of(scenario)
        lost = tuple(
            course._replace(bands=tuple(Band(*(np.full(2, np.nan),) * 3) for _ in course.bands))
            for course in summary.weights
        )
        spec.draw(summary._replace(weights=lost)).canvas.draw()


def test_the_last_weights_stand_beside_their_curves() -> None:
    said = WEIGHTS.alt(summary_of())
    weights = "left 0.6, up 0.5, right 0.48, down 0.4"
    assert said.endswith(f"After the last window, largest first: dyna-ht-1: {weights}; dyna-ht-3: {weights}.")
    assert WEIGHTS.alt(nothing_of()) == "No weights to show."


def test_letters_are_at_least_8_points(drawn: tuple[FigureSpec[Any], Scenario]) -> None:
    spec, scenario = drawn
    with own_style():
        figure = spec.draw(summary_of(scenario))
        ticks = [tick for axes in figure.axes for tick in (*axes.get_xticklabels(), *axes.get_yticklabels())]
        texts = [text for axes in figure.axes for text in (*axes.texts, axes.xaxis.label, axes.title)]
        assert min(float(text.get_fontsize()) for text in (*ticks, *texts)) >= 8


@pytest.mark.parametrize(
    ("scenario", "total", "gain", "sign"),
    [
        (SCENARIOS[0], "cumulative number of balanced steps", "balanced steps more than sarsa-lambda", 1),
        (SCENARIOS[2], "cumulative cost (steps to deliver)", "steps saved against team-q", -1),
    ],
)
def test_curves_say_what_they_count_and_which_way_is_better(
    scenario: Scenario, total: str, gain: str, sign: int
) -> None:
    summary = summary_of(scenario)
    figure = CURVES.draw(summary)
    assert [axes.get_ylabel() for axes in figure.axes] == [total, gain]
    for place, curve in enumerate(summary.curves):
        assert line_data(figure, 0, place)[1] == curve.band.mean.tolist()
    for place, curve in enumerate(summary.curves[1:]):
        assert line_data(figure, 1, place)[1] == (sign * curve.against_base.mean).tolist()


def test_captions_count_the_runs_that_diverged() -> None:
    summary = summary_of(SCENARIOS[0])
    assert "diverged" not in CURVES.caption(summary)
    lost = tuple(curve._replace(n_diverged=2) for curve in summary.curves[:2])
    assert "4 runs of single variants" in CURVES.caption(summary._replace(curves=lost))


def names_of_actions(scenario: Scenario) -> tuple[str, ...]:
    return next(text.actions for text in scenario.figures if isinstance(text, WeightText))


@pytest.mark.parametrize("place", [0, 2])
def test_maps_of_weights_show_every_action_of_the_one_agent_version(place: int) -> None:
    scenario = SCENARIOS[place]
    names = names_of_actions(scenario)
    # The third is the colour bar's.
    over_time, last, _ = DRAWN[f"omega-{scenario.name}"][0].draw(summary_of(scenario)).axes
    assert over_time.get_title(loc="left") == f"{scenario.algorithm.t_version}-1"
    assert [label.get_text() for label in over_time.get_yticklabels()] == list(names)
    assert over_time.get_ylim() == (len(names) - 0.5, -0.5), "from the first action down to the last"
    values = np.asarray(over_time.collections[0].get_array()).reshape(len(names), -1)
    assert values.shape == (scenario.algorithm.n_actions, 2)
    assert values[:4, 1].tolist() == list(LEVELS)
    assert np.asarray(last.lines[0].get_xdata()).tolist() == values[:, -1].tolist()
    assert np.asarray(last.lines[1].get_xdata())[0] == scenario.algorithm.n_actions**-0.5


def test_actions_are_named_as_the_problems_number_them() -> None:
    pole, maze, rescue = (names_of_actions(scenario) for scenario in SCENARIOS)
    assert (pole[0], pole[10], pole[20]) == ("\N{MINUS SIGN}1", "0", "1")
    assert maze == ("up", "down", "left", "right")
    assert (rescue[0], rescue[7], rescue[24]) == ("left, left", "right, up", "stay, stay")


def test_a_scenario_that_says_nothing_of_its_figures_has_them_all_the_same() -> None:
    summary = summary_of(replace(SCENARIO, figures=(), title="Mine", name="mine"))
    shown = draw_figures(FIGURES, summary)
    assert [one.name for one in shown] == ["paths-mine", "curves-mine", "omega-mine"]
    assert [one.title for one in shown] == [
        "Mine: paths found in one maze",
        "Mine: learning curves",
        "Mine: action weights over time",
    ]
    assert "paper" not in shown[0].caption


def test_every_variant_looks_different() -> None:
    names = ["dyna-h", "dyna-ht-1", "dyna-ht-3", "dyna-ht-3-min", "constant-1", "constant-3-max", "constant-3-min"]
    names += ["permuted-1", "relative-1", "dyna-ht-2", "dyna-ht-4"]
    chosen = line_styles(replace(SCENARIO, variants=tuple(variant(DYNA_MAZE.algorithm, name) for name in names)))
    assert list(chosen) == names
    assert len(set(chosen.values())) == len(names)


def test_labels_of_close_lines_do_not_overlap_and_stay_in_the_panel() -> None:
    figure = Figure(figsize=(4, 3))
    axes = figure.subplots()
    axes.set_ylim(0, 1)
    label_ends(axes, [EndLabel(str(i), 1.0 - 0.001 * i, "black") for i in range(6)])
    boxes = [text.get_window_extent() for text in axes.texts]
    assert [text.get_text() for text in axes.texts] == ["5", "4", "3", "2", "1", "0"]
    assert all(upper.y0 >= lower.y1 for lower, upper in pairwise(boxes))
    assert axes.texts[-1].get_position()[1] <= 1.0


@pytest.mark.parametrize(("last", "n_ticks"), [(3, 10), (1000, 4)])
def test_episodes_are_counted_in_a_few_whole_numbers(last: int, n_ticks: int) -> None:
    axes = Figure().subplots()
    count_episodes(axes, last, n_ticks)
    ticks = axes.get_xticks()
    assert axes.get_xlim() == (0, last)
    np.testing.assert_array_equal(ticks, ticks.round())
    assert 3 <= len(ticks) <= n_ticks + 1
