from dataclasses import replace
from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.reports.examples import LEVELS, N_EPISODES, SCENARIO, SCENARIOS, nothing_of, scenario_of, summary_of
from tuckerl.errors import ProblemError
from tuckerl.problems.maze import sutton_maze
from tuckerl.reports.curves import CurveWords, gains
from tuckerl.reports.fig9 import FIG9
from tuckerl.reports.fig10 import draw_fig10
from tuckerl.reports.fig11 import draw_fig11
from tuckerl.reports.fig13 import FIG13
from tuckerl.reports.figures import PICTURES
from tuckerl.reports.omega import draw_omega_dyna_maze
from tuckerl.reports.omega_map import CART_POLE_ACTIONS, RESCUE_ACTIONS
from tuckerl.reports.picture import Picture, own_style, show
from tuckerl.reports.styles import EndLabel, label_ends, line_styles
from tuckerl.studies.dyna_maze import FAMILY
from tuckerl.studies.statistics import Band
from tuckerl.studies.study import variant


def line_data(figure: Figure, panel: int, place: int) -> tuple[list[float], list[float]]:
    x, y = figure.axes[panel].lines[place].get_data()
    return np.asarray(x).tolist(), np.asarray(y).tolist()


def test_fig10_draws_the_paths_of_the_summary_and_the_shortest_one() -> None:
    summary, maze = summary_of(), sutton_maze()
    figure = draw_fig10(summary)
    assert len(figure.axes) == 4
    for panel, path in enumerate(summary.paths):
        cells = [maze.cell(state) for state in path.states]
        assert line_data(figure, panel, 0) == ([c for _, c in cells], [r for r, _ in cells])
    shortest = maze.shortest_path()
    assert line_data(figure, 3, 0) == ([c for _, c in shortest], [r for r, _ in shortest])


def test_fig10_says_the_steps_found_and_those_of_the_paper() -> None:
    figure = draw_fig10(summary_of())
    words = [axes.texts[0].get_text() for axes in figure.axes]
    assert words == ["15 steps (paper: 90)", "15 steps (paper: 83)", "15 steps (paper: 59)", "14 steps"]
    assert [axes.get_title(loc="left") for axes in figure.axes] == [*SCENARIO.record_paths_of, "shortest possible"]


def test_fig10_shows_the_walls_where_they_are_and_row_0_at_the_top() -> None:
    figure = draw_fig10(summary_of())
    squares = figure.axes[0].collections[0].get_paths()
    centres = {tuple(np.asarray(square.vertices)[:4].mean(axis=0)) for square in squares}
    assert centres == {(column, row) for row, column in np.argwhere(sutton_maze().walls).tolist()}
    bottom, top = figure.axes[0].get_ylim()
    assert bottom > top


def test_fig10_says_when_a_path_misses_the_goal() -> None:
    summary = summary_of()
    cut = summary.paths[0]._replace(states=summary.paths[0].states[:-1])
    figure = draw_fig10(summary._replace(paths=(cut,)))
    assert figure.axes[0].texts[0].get_text() == "14 steps, goal not reached (paper: 90)"


def test_fig10_needs_a_maze() -> None:
    summary = summary_of()
    scenario = replace(SCENARIO, problem=lambda _: sutton_maze().to_mdp())
    with pytest.raises(ProblemError, match="only paths in a Maze"):
        draw_fig10(summary._replace(scenario=scenario))


def test_fig11_shows_totals_above_and_gains_below() -> None:
    summary = summary_of()
    figure = draw_fig11(summary)
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
    for line in gains(summary, CurveWords("total", "gain", sign=-1)):
        assert (line.band.low < line.band.mean).all()
        assert (line.band.mean < line.band.high).all()
    band_of_last = np.asarray(draw_fig11(summary).axes[1].collections[-1].get_paths()[0].vertices)
    against = summary.curves[-1].against_base
    assert band_of_last[:, 1].min() == (-against.high).min()
    assert band_of_last[:, 1].max() == (-against.low).max()


def test_more_of_a_measure_can_be_better() -> None:
    summary = summary_of()
    lines = gains(summary, CurveWords("balanced steps", "gain", sign=1))
    assert [line.band for line in lines] == [curve.against_base for curve in summary.curves[1:]]


def test_omega_shows_each_action_of_the_pictured_variants_and_the_control() -> None:
    summary = summary_of()
    figure = draw_omega_dyna_maze(summary)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["dyna-ht-1", "dyna-ht-3"]
    for panel in range(2):
        for action, level in enumerate((0.5, 0.4, 0.6, 0.48)):
            assert line_data(figure, panel, action) == ([10, 20], [level, level])
        assert line_data(figure, panel, 4)[1] == [0.5, 0.5]
        texts = [text.get_text() for text in figure.axes[panel].texts]
        assert texts == ["constant control, 1/√4 = 0.5", "down", "right", "up", "left"]


@pytest.mark.parametrize("picture", PICTURES, ids=lambda picture: picture.name)
def test_files_are_the_same_bytes_whatever_the_users_settings(picture: Picture) -> None:
    first = show(picture, summary_of(scenario_of(picture))).drawn
    with mpl.rc_context({"lines.linewidth": 9, "svg.hashsalt": "other", "font.size": 20, "axes.facecolor": "red"}):
        second = show(picture, summary_of(scenario_of(picture))).drawn
        assert mpl.rcParams["font.size"] == 20
    assert first == second
    assert first.png.startswith(b"\x89PNG")
    assert b"<date>" not in first.svg.lower().replace(b"dc:", b"")


@pytest.mark.parametrize("picture", PICTURES, ids=lambda picture: picture.name)
@pytest.mark.parametrize("n_episodes", [None, 1, 10])
def test_little_or_nothing_can_be_drawn(picture: Picture, n_episodes: int | None) -> None:
    scenario = scenario_of(picture)
    summary = nothing_of(scenario) if n_episodes is None else summary_of(scenario, n_episodes)
    picture.draw(summary).canvas.draw()
    words = picture.caption(summary) + picture.alt(summary)
    assert words
    assert "nan" not in words.lower()


def test_weights_of_runs_that_all_diverged_later_can_be_drawn() -> None:
    for picture in [picture for picture in PICTURES if picture.name.startswith("omega")]:
        summary = summary_of(scenario_of(picture))
        lost = tuple(
            course._replace(bands=tuple(Band(*(np.full(2, np.nan),) * 3) for _ in course.bands))
            for course in summary.weights
        )
        picture.draw(summary._replace(weights=lost)).canvas.draw()


@pytest.mark.parametrize("picture", PICTURES, ids=lambda picture: picture.name)
def test_letters_are_at_least_8_points(picture: Picture) -> None:
    with own_style():
        figure = picture.draw(summary_of(scenario_of(picture)))
        ticks = [tick for axes in figure.axes for tick in (*axes.get_xticklabels(), *axes.get_yticklabels())]
        texts = [text for axes in figure.axes for text in (*axes.texts, axes.xaxis.label, axes.title)]
        assert min(float(text.get_fontsize()) for text in (*ticks, *texts)) >= 8


@pytest.mark.parametrize(
    ("picture", "total", "gain", "sign"),
    [
        (FIG9, "cumulative number of balanced steps", "balanced steps more than sarsa-lambda", 1),
        (FIG13, "cumulative cost (steps to deliver)", "steps saved against team-q", -1),
    ],
)
def test_curves_say_what_they_count_and_which_way_is_better(picture: Picture, total: str, gain: str, sign: int) -> None:
    summary = summary_of(scenario_of(picture))
    figure = picture.draw(summary)
    assert [axes.get_ylabel() for axes in figure.axes] == [total, gain]
    for place, curve in enumerate(summary.curves):
        assert line_data(figure, 0, place)[1] == curve.band.mean.tolist()
    for place, curve in enumerate(summary.curves[1:]):
        assert line_data(figure, 1, place)[1] == (sign * curve.against_base.mean).tolist()


def test_captions_count_the_runs_that_diverged() -> None:
    summary = summary_of(SCENARIOS[0])
    assert "diverged" not in FIG9.caption(summary)
    lost = tuple(curve._replace(n_diverged=2) for curve in summary.curves[:2])
    assert "4 runs of single variants" in FIG9.caption(summary._replace(curves=lost))


@pytest.mark.parametrize(("place", "names"), [(0, CART_POLE_ACTIONS), (2, RESCUE_ACTIONS)])
def test_maps_of_weights_show_every_action_of_the_one_agent_version(place: int, names: tuple[str, ...]) -> None:
    scenario = SCENARIOS[place]
    picture = next(p for p in PICTURES if p.name == f"omega-{scenario.name}")
    over_time, _, last = picture.draw(summary_of(scenario)).axes  # the second is the colour bar's
    assert over_time.get_title(loc="left") == f"{scenario.family.t_version}-1"
    assert [label.get_text() for label in over_time.get_yticklabels()] == list(names)
    values = np.asarray(over_time.collections[0].get_array()).reshape(len(names), -1)
    assert values.shape == (scenario.family.n_actions, 2)
    assert values[:4, 1].tolist() == list(LEVELS)
    assert np.asarray(last.lines[0].get_xdata()).tolist() == values[:, -1].tolist()
    assert np.asarray(last.lines[1].get_xdata())[0] == scenario.family.n_actions**-0.5


def test_actions_are_named_as_the_problems_number_them() -> None:
    assert CART_POLE_ACTIONS[0] == "\N{MINUS SIGN}1"
    assert (CART_POLE_ACTIONS[10], CART_POLE_ACTIONS[20]) == ("0", "1")
    assert (RESCUE_ACTIONS[0], RESCUE_ACTIONS[7], RESCUE_ACTIONS[24]) == ("left, left", "right, up", "stay, stay")


def test_every_variant_looks_different() -> None:
    names = ["dyna-h", "dyna-ht-1", "dyna-ht-3", "dyna-ht-3-min", "constant-1", "constant-3-max", "constant-3-min"]
    names += ["permuted-1", "relative-1", "dyna-ht-2", "dyna-ht-4"]
    chosen = line_styles(replace(SCENARIO, variants=tuple(variant(FAMILY, name) for name in names)))
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
