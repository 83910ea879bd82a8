"""What the figures of the inspection show and say, on tables made by hand."""

import base64
import math
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.quiver import Quiver

from tuckerl.errors import OutputError, ProblemError, TensorError
from tuckerl.generalization.loadings import Loadings
from tuckerl.generalization.step_history import TensorStepHistory, empty_history
from tuckerl.problems.maze import sutton_maze
from tuckerl.reports.figure import FigureSpec, own_style
from tuckerl.reports.inspect import Inspection, explore, inspect_tensor, inspection_figures, write_inspection
from tuckerl.reports.inspect.agents import AGENTS, differences
from tuckerl.reports.inspect.content import StatePath
from tuckerl.reports.inspect.curve import CURVE, blocks, running_mean, window_of
from tuckerl.reports.inspect.explore import listed, live_states
from tuckerl.reports.inspect.figures import FIGURES
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, arrows, direction, greedy, values
from tuckerl.reports.inspect.loadings import LOADINGS, MOST_STATES, STATE_LOADINGS, on_all_states, shown_rows, strengths
from tuckerl.reports.inspect.maps import cell_of, counting_ticks
from tuckerl.reports.inspect.policy import PLAIN, POLICY, draw_policy, stride
from tuckerl.reports.inspect.windows import (
    COPIED,
    FIT,
    MOST_DRAWN,
    WEIGHTS,
    copied_counts,
    drawn_windows,
    rows_of_agents,
)
from tuckerl.reports.text import percent, percents
from tuckerl.types import FloatArray

MOVES = ("up", "down", "left", "right")


def history_of(chosen: list[int], n_actions: int = 4) -> TensorStepHistory:
    n = len(chosen)
    weights = np.tile(np.linspace(0.2, 0.8, n_actions), (n, 1))
    fit = np.array([math.nan, *np.linspace(0.5, 0.9, n - 1)]) if n else np.zeros(0)
    ranks = np.tile([3, 2, 2, 1], (n, 1))
    ranks[:1] = 0
    return TensorStepHistory(10 * np.arange(1, n + 1), weights, np.array(chosen, dtype=np.int64), fit, ranks)


def inspection_of(q: FloatArray, layout: tuple[int, int] | None = None, **changes: object) -> Inspection:
    n_agents, n_actions = q.shape[0], q.shape[2]
    names = MOVES if n_actions == 4 else [f"a{action}" for action in range(n_actions)]
    none = np.zeros((0, n_agents))
    plain = Inspection("a title", q, layout, None, names, empty_history(n_actions), None, none.astype(np.int64), none)
    return plain._replace(**changes)  # type: ignore[arg-type]


def everything(layout: tuple[int, int] | None = (3, 4), n_agents: int = 3, n_windows: int = 5) -> Inspection:
    rng = np.random.default_rng(0)
    n_states, n_actions, n_episodes = 12, 4, 6
    X = rng.normal(size=(n_states, n_actions, n_episodes, n_agents))
    X[5] = 0.0
    made = inspect_tensor(X, (3, 2, 2, 1), layout, action_names=MOVES)
    chosen = [window % n_agents if window != 1 else -1 for window in range(n_windows)]
    steps = rng.integers(5, 50, size=(10 * n_windows, n_agents))
    optimal = np.append(np.nan, np.linspace(-1.0, 2.0, n_states - 1))
    return made._replace(history=history_of(chosen), steps=steps, returns=-steps.astype(np.float64), optimal=optimal)


def texts(spec: FigureSpec[Inspection], inspection: Inspection) -> str:
    return spec.caption(inspection) + spec.alt(inspection)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("up", (-1, 0)),
        ("South", (1, 0)),
        ("move_west", (0, -1)),
        ("→", (0, 1)),
        ("north-east", (-1, 1)),
        ("downleft", (1, -1)),
        ("push right", (0, 1)),
        ("stay", None),
        ("left, up", None),
        ("up down", None),
        ("upper", None),
        ("0", None),
        ("", None),
        ("move", None),
    ],
)
def test_a_direction_is_read_from_an_actions_name(name: str, expected: tuple[int, int] | None) -> None:
    assert direction(name) == expected


def test_greedy_takes_the_lowest_of_equals_and_prefers_nothing_where_all_are_equal() -> None:
    q = np.array([[1.0, 2, 2], [0, 0, 0], [-3, -3, -3], [0, -1, -1], [np.nan, 5, 1], [np.inf, 0, 0]])
    assert greedy(q).tolist() == [1, NO_PREFERENCE, NO_PREFERENCE, 0, NO_PREFERENCE, NO_PREFERENCE]
    np.testing.assert_array_equal(values(q), [2, np.nan, np.nan, 0, np.nan, np.nan])
    assert greedy(np.array([[0.0], [-1.0]])).tolist() == [NO_PREFERENCE, 0]


def test_arrows_lead_along_a_shortest_path_of_a_maze() -> None:
    maze = sutton_maze()
    distances, q = maze._distances().ravel(), np.zeros((maze.n_states, 4))
    next_state = maze.to_mdp().arrays.next_state.reshape(-1, 4)
    q[:] = -distances[next_state]
    for names in (MOVES, ("left", "right", "down", "up")):
        order = [MOVES.index(name) for name in names]
        ways = arrows(q[:, order], names)
        cell = maze.start
        for _ in range(14):
            state = maze.state(cell)
            cell = (int(cell[0] + ways[state, 0]), int(cell[1] + ways[state, 1]))
        assert cell == maze.goal


def arrows_of(axes: Axes) -> Quiver:
    (found,) = [one for one in axes.collections if isinstance(one, Quiver)]
    return found


def test_each_drawn_arrow_points_where_its_action_leads() -> None:
    q = np.zeros((1, 6, 4))
    for state, action in enumerate((0, 1, 2, 3)):
        q[0, state, action] = 1.0
    figure = draw_policy(inspection_of(q, (2, 3), blocked=np.array([0, 0, 0, 0, 0, 1], dtype=np.bool_)))
    drawn = arrows_of(figure.axes[0])
    rows = zip(np.asarray(drawn.XY).tolist(), np.sign(np.asarray(drawn.U)), np.sign(np.asarray(drawn.V)), strict=True)
    found = {tuple(place): (int(right), int(up)) for place, right, up in rows}
    # (column, row) of the cell, (right, up) of the arrow; states 4 (all equal) and 5 (blocked) have none.
    assert found == {(0, 0): (0, 1), (1, 0): (0, -1), (2, 0): (-1, 0), (0, 1): (1, 0)}
    assert drawn.angles == "uv", "up is up on paper, though rows are counted downwards"
    low, high = figure.axes[0].get_ylim()
    assert low > high  # row 0 is at the top


def test_the_policys_caption_counts_what_is_preferred_tied_blocked_and_infinite() -> None:
    q = np.zeros((1, 6, 4))
    q[0, 0] = (1, 2, 2, 0)
    q[0, 1] = (0, 0, 0, -4)
    q[0, 2] = (9, 0, 0, 0)
    q[0, 3] = (math.inf, 0, 0, 0)
    caption = POLICY.caption(inspection_of(q, (2, 3), blocked=np.array([0, 0, 1, 0, 0, 0], dtype=np.bool_)))
    assert "prefers an action in 2 of 5 states; their values are from 0 to 2." in caption
    assert "In 2 states several but not all actions are equally good" in caption
    assert "Left out: 1 state with values that are not finite" in caption
    assert "no preference" in caption


def test_arrows_are_thinned_out_where_cells_are_small() -> None:
    assert stride((39, 36)) == 1
    assert stride((100, 100)) == 2
    rng = np.random.default_rng(1)
    inspection = inspection_of(rng.normal(size=(1, 10_000, 4)), (100, 100))
    assert "every second row and column" in POLICY.caption(inspection)
    assert arrows_of(draw_policy(inspection).axes[0]).N == 2500


def test_cells_are_squares_unless_a_side_would_vanish() -> None:
    assert cell_of((3, 4)).across == cell_of((3, 4)).down
    assert cell_of((1, 600)).down == pytest.approx(0.3 * 72)


def test_the_greedy_path_is_a_line_through_its_cells() -> None:
    path = StatePath("greedy path", (np.array([0, 1, 4]),), "it ends after 2 steps")
    inspection = inspection_of(np.zeros((1, 6, 4)), (2, 3), paths=[path])
    line = draw_policy(inspection).axes[0].lines[-1]
    assert np.asarray(line.get_xydata()).tolist() == [[0, 0], [1, 0], [1, 1]]
    assert "Line: the greedy path from the start; it ends after 2 steps." in POLICY.caption(inspection)


def test_actions_without_a_direction_have_marks_with_a_legend() -> None:
    q = np.eye(3)[[0, 1, 2, 0]][np.newaxis]
    inspection = inspection_of(q, (2, 2), action_names=["left", "wait", "dig"])
    figure = draw_policy(inspection)
    axes = figure.axes[0]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["wait", "dig"]
    assert [(line.get_xdata(), line.get_ydata()) for line in axes.lines] == [([1], [0]), ([0], [1])]


def test_ticks_of_cells_are_whole_round_numbers() -> None:
    assert counting_ticks(1).tolist() == [0]
    assert counting_ticks(12).tolist() == [0, 2, 4, 6, 8, 10]
    assert counting_ticks(39).tolist() == [0, 5, 10, 15, 20, 25, 30, 35]


def test_differences_between_agents_are_counted_where_both_prefer_something() -> None:
    q = np.zeros((3, 3, 2))
    q[0] = [(1, 0), (0, 1), (0, 0)]
    q[1] = [(1, 0), (3, 0), (5, 0)]
    q[2] = [(0, 4), (2, 0), (0, 0)]
    inspection = inspection_of(q, (1, 3))
    found = differences(inspection)
    np.testing.assert_array_equal(found.others, [1, 2, np.nan])
    np.testing.assert_array_equal(found.spread, [3, 2, np.nan])
    np.testing.assert_allclose(found.agreement, [[1, 0.5, 0], [0.5, 1, 0.5], [0, 0.5, 1]])
    caption = AGENTS.caption(inspection)
    assert "agent 1 in 1 of 2 and agent 2 in 2 of 2" in caption
    assert "differ most in row 0, column 0, by 3" in caption
    assert not AGENTS.applies(inspection._replace(q=q[[0, 0, 0]]))


def test_a_profile_shows_sorted_values_and_how_often_each_action_is_greedy() -> None:
    q = np.zeros((1, 70, 2))
    q[0, :3] = [(1, 5), (7, 2), (0, 6)]
    inspection = inspection_of(q)
    curve, bars = PLAIN.draw(inspection).axes
    assert np.asarray(curve.lines[0].get_ydata()).tolist() == [7, 6, 5]
    assert [bar.get_width() for bar in bars.patches] == [1, 2]  # type: ignore[attr-defined]
    assert "3 of 70 states; their values are from 5 to 7" in PLAIN.caption(inspection)
    assert "on a screen they stand in a list" in PLAIN.caption(inspection)
    assert PLAIN.alt(inspection).endswith("is 7, of state 1. Greedy: a1 in 2 and a0 in 1 states.")


def test_a_table_of_few_states_marks_the_greedy_actions() -> None:
    q = np.array([[[1.0, 5], [7, 2], [0, 0]]])
    axes = PLAIN.draw(inspection_of(q)).axes[0]
    np.testing.assert_array_equal(np.asarray(axes.images[0].get_array()), q[0])
    assert np.asarray(axes.lines[0].get_xydata()).tolist() == [[1, 0], [0, 1]]


def test_loadings_say_the_fit_and_the_squares_of_the_core() -> None:
    core = np.zeros((2, 2, 1, 1))
    core[0, 0], core[1, 1] = 3.0, 1.0  # squares 9 and 1
    factors = (np.array([[0.6, -0.8], [0.8, 0.6]]), np.eye(4, 2), np.ones((1, 1)), np.ones((1, 1)))
    loadings = Loadings(np.array([4, 1]), factors, core, episode=7, fit=0.8)
    assert loadings.energies(0).tolist() == [0.9, 0.1]
    inspection = inspection_of(np.zeros((1, 6, 4)), (2, 3), loadings=loadings)
    caption = STATE_LOADINGS.caption(inspection)
    assert "the fit is 0.8, which means that 96 %" in caption  # 1 - 0.2 ** 2
    assert "they carry 90 and 10 %" in caption
    assert "4 states did not change in these episodes and have no loadings" in caption
    assert "column 1 is largest in row 0, column 1, 0.8; column 2 is largest in row 1, column 1" in STATE_LOADINGS.alt(
        inspection
    )
    others = LOADINGS.caption(inspection)
    assert "episodes 7 to 7" in others
    assert "the action factors 90 and 10 %, the episode factors 100 % and the agent factors 100 %" in others
    nan = math.nan
    np.testing.assert_array_equal(on_all_states(inspection)[:, 0], [nan, 0.8, nan, nan, 0.6, nan])


def test_there_is_a_map_for_each_state_factor() -> None:
    inspection = everything()
    titles = [axes.get_title(loc="left") for axes in STATE_LOADINGS.draw(inspection).axes if axes.images]
    assert [title.split(":")[0] for title in titles] == ["1", "2", "3"]


def test_of_many_states_without_layout_those_with_the_largest_loadings_are_drawn() -> None:
    factor = np.zeros((500, 1))
    factor[:100] = 0.001
    factor[100:] = math.sqrt((1 - 100 * 1e-6) / 400)
    ones = (np.ones((1, 1)),) * 3
    loadings = Loadings(np.arange(500)[::-1], (factor, *ones), np.ones((1, 1, 1, 1)), 1)
    rows = shown_rows(loadings)
    assert rows.size == MOST_STATES
    assert loadings.states[rows].tolist() == list(range(400))
    caption = STATE_LOADINGS.caption(inspection_of(np.ones((1, 500, 1)), loadings=loadings))
    assert "the other 100 carry less than 0.1 % of the factor's squares" in caption
    assert "the fit is not known" in caption


def test_who_was_copied_is_counted_and_drawn_where_it_was() -> None:
    inspection = everything()._replace(history=history_of([0, 2, -1, 2]))
    assert copied_counts(inspection).tolist() == [1, 0, 2, 1]
    caption = COPIED.caption(inspection)
    assert "Of 4 windows, all agents went on with agent 2's after 2 and agent 0's after 1; after 1 no single" in caption
    axes = COPIED.draw(inspection).axes[0]
    spans = [
        sorted((path.get_extents().x0, path.get_extents().x1) for path in row.get_paths()) for row in axes.collections
    ]
    assert spans == [[(0, 10)], [], [(10, 20), (30, 40)], [(20, 30)]]


def test_of_very_many_agents_those_that_were_copied_have_a_row() -> None:
    inspection = LITTLE["many agents"]
    assert rows_of_agents(inspection) == [0, 44]
    assert "43 agents, copied seldom or never, are not drawn" in COPIED.caption(inspection)


def test_weights_and_fit_say_their_ends() -> None:
    inspection = everything()
    assert "of 5 windows" in WEIGHTS.caption(inspection)
    assert "the least is 0.2 (up), the largest 0.8 (right)" in WEIGHTS.caption(inspection)
    assert "it is from 0.5 to 0.9, after the last one 0.9" in FIT.caption(inspection)
    assert "1 window had no decomposition" in FIT.caption(inspection)
    assert "states 3, actions 2, episodes 2 and agents 1" in FIT.caption(inspection)


def test_many_windows_are_thinned_out_to_the_last() -> None:
    history = history_of([0] * (MOST_DRAWN + 1))
    kept = drawn_windows(history)
    assert kept.episode.size == MOST_DRAWN // 2 + 1
    assert kept.episode[-1] == history.episode[-1]
    assert "one in 2 before it" in WEIGHTS.caption(everything()._replace(history=history))


def test_the_running_mean_is_over_the_episodes_before_and_says_how_many() -> None:
    assert running_mean(np.array([[1.0], [2], [3], [8]]), 2).ravel().tolist() == [1.5, 2.5, 5.5]
    assert [window_of(n) for n in (1, 4, 50, 400, 10_000)] == [1, 4, 5, 20, 100]
    at, means = blocks(np.arange(1.0, 1203.0))
    assert (at[0], means[0], at[-1], means[-1]) == (2.0, 2.0, 1201.5, 1201.5)
    steps = np.repeat([[10, 20]], 10, axis=0)
    steps[-5:] = 4
    inspection = inspection_of(np.zeros((2, 3, 4)), steps=steps, returns=steps.astype(np.float64))
    caption = CURVE.caption(inspection)
    assert "10 episodes of learning, exploration included, 2 agents averaged" in caption
    assert "Mean steps: 15 over the first and 4 over the last 5 episodes" in caption
    axes = CURVE.draw(inspection).axes[0]
    assert np.asarray(axes.lines[1].get_xydata()).tolist() == [
        [5, 15],
        [6, 12.8],
        [7, 10.6],
        [8, 8.4],
        [9, 6.2],
        [10, 4],
    ]
    low_high = axes.collections[0].get_paths()[0].get_extents()
    assert (low_high.y0, low_high.y1) == (4, 20)


def test_percents_do_not_round_to_nothing() -> None:
    assert percents(np.array([0.9, 0.0999, 0.0001, 0.0])) == "90, 9.99, <0.1 and 0 %"
    assert percents(np.full(8, 0.125)).endswith("and 12.5 %, the other 2 together 25 %")
    assert percents(np.full(7, 1 / 7)).count("14.3") == 7
    assert [percent(part) for part in (0.0, 0.0001, 0.5, 0.9999, 1.0)] == [
        "0 %",
        "less than 0.1 %",
        "50 %",
        "more than 99.9 %",
        "100 %",
    ]


@pytest.mark.parametrize("n_states", [0, 1])
def test_the_loadings_of_a_single_state_are_drawn(n_states: int) -> None:
    factors = np.ones((n_states, 1)), *[np.ones((1, 1))] * 3
    loadings = Loadings(np.arange(n_states), factors, np.ones((1, 1, 1, 1)), 1)
    assert STATE_LOADINGS.applies(inspection_of(np.ones((1, 3, 1)), loadings=loadings)) is bool(n_states)


def test_a_tensors_last_tables_and_loadings_are_shown() -> None:
    rng = np.random.default_rng(2)
    X = rng.normal(size=(6, 2, 5, 3))
    X[4] = 0
    inspection = inspect_tensor(X, (2, 2, 2, 2), (2, 3))
    np.testing.assert_array_equal(inspection.q, X[:, :, -1, :].transpose(2, 0, 1))
    assert inspection.loadings is not None
    assert inspection.loadings.states.tolist() == [0, 1, 2, 3, 5]
    assert [one.name for one in inspection_figures(inspection)] == ["policy", "agents", "state-loadings", "loadings"]


def test_a_tensor_of_zeros_has_no_loadings() -> None:
    inspection = inspect_tensor(np.zeros((4, 2, 3, 1)), (1, 1, 1, 1))
    assert inspection.loadings is None
    assert [one.name for one in inspection_figures(inspection)] == ["policy"]


def test_tensors_and_parts_that_do_not_fit_are_refused() -> None:
    with pytest.raises(TensorError, match=r"\(state, action, episode, agent\); got shape \(2, 2\)"):
        inspect_tensor(np.ones((2, 2)), (1, 1))
    with pytest.raises(TensorError, match="none of them empty"):
        inspect_tensor(np.ones((2, 0, 1, 1)), (1, 1, 1, 1))
    with pytest.raises(TensorError, match="finite"):
        inspect_tensor(np.full((2, 2, 1, 1), np.nan), (1, 1, 1, 1))
    X = np.ones((4, 2, 1, 1))
    with pytest.raises(ProblemError, match=r"layout must be \(rows, columns\) of 4 cells"):
        inspect_tensor(X, (1, 1, 1, 1), (2, 3))
    with pytest.raises(ProblemError, match="action_names must be 2 names"):
        inspect_tensor(X, (1, 1, 1, 1), action_names=["up"])
    with pytest.raises(ProblemError, match="blocked must be 4 booleans"):
        inspect_tensor(X, (1, 1, 1, 1), blocked=np.zeros(3, dtype=np.bool_))
    good = everything()
    assert good.loadings is not None
    twice = good.loadings._replace(states=np.zeros(11, dtype=np.int64))
    for changes, part in (
        ({"q": np.zeros((2, 3))}, "q must have"),
        ({"action_names": ["up"]}, "action_names"),
        ({"steps": np.zeros((2, 3), dtype=np.int64)}, "returns"),
        ({"loadings": twice}, "loadings.states"),
        ({"history": history_of([0], 3)}, "history.weights"),
    ):
        with pytest.raises(ProblemError, match=part):
            inspection_figures(good._replace(**changes))


LITTLE = {
    "one state, one action, untouched": inspection_of(np.zeros((1, 1, 1)), (1, 1)),
    "one state without layout": inspection_of(np.ones((1, 1, 1))),
    "nothing learned": inspection_of(np.zeros((2, 5, 4))),
    "nothing learned on many states": inspection_of(np.zeros((2, 500, 4))),
    "all blocked": inspection_of(np.ones((1, 4, 4)), (2, 2), blocked=np.ones(4, dtype=np.bool_)),
    "a long corridor": inspection_of(np.arange(2400.0).reshape(1, 600, 4), (1, 600)),
    "a tall corridor": inspection_of(np.arange(2400.0).reshape(1, 600, 4), (600, 1)),
    "not finite": inspection_of(np.full((2, 4, 4), np.nan), (2, 2)),
    "one window": everything(n_windows=1),
    "two windows, one agent": everything(n_agents=1, n_windows=2),
    "without layout": everything(layout=None),
    "one episode": everything()._replace(steps=np.ones((1, 3), dtype=np.int64), returns=np.ones((1, 3))),
    "many agents": inspection_of(np.random.default_rng(3).normal(size=(45, 7, 12)))._replace(
        history=history_of([0, 44, -1], 12)
    ),
    "many actions": inspection_of(np.random.default_rng(3).normal(size=(1, 7, 90)))._replace(
        history=history_of([0, 0], 90)
    ),
    "no fit at all": everything()._replace(
        history=history_of([-1, -1])._replace(fit=np.full(2, np.nan), ranks=np.zeros((2, 4), dtype=np.int64))
    ),
}


@pytest.mark.parametrize("case", LITTLE)
def test_little_or_nothing_can_be_drawn(case: str) -> None:
    inspection = LITTLE[case]
    shown = [spec for spec in FIGURES if spec.applies(inspection)]
    assert len([spec for spec in shown if spec.text_of(inspection).name == "policy"]) == 1
    for spec in shown:
        with own_style():
            spec.draw(inspection).canvas.draw()
        words = texts(spec, inspection)
        assert "nan" not in words.lower(), words
        assert spec.caption(inspection).endswith(".")
    assert len({spec.text_of(inspection).name for spec in shown}) == len(shown)


@pytest.mark.slow
def test_files_are_the_same_bytes_whatever_the_users_settings() -> None:
    first = inspection_figures(everything())
    with mpl.rc_context({"lines.linewidth": 9, "svg.hashsalt": "other", "font.size": 20, "axes.facecolor": "red"}):
        second = inspection_figures(everything())
        assert mpl.rcParams["font.size"] == 20
    assert first == second
    assert [one.name for one in first] == [spec.text_of(everything()).name for spec in FIGURES if spec is not PLAIN]
    assert all(one.png.startswith(b"\x89PNG") for one in first)


@pytest.mark.parametrize("inspection", [everything(), everything(layout=None)], ids=["grid", "no layout"])
def test_letters_are_at_least_8_points_and_figures_as_wide_as_a_text(inspection: Inspection) -> None:
    for spec in FIGURES:
        if not spec.applies(inspection):
            continue
        with own_style():
            figure = spec.draw(inspection)
            assert figure.get_size_inches()[0] == 7.2
            ticks = [tick for axes in figure.axes for tick in (*axes.get_xticklabels(), *axes.get_yticklabels())]
            titles = [axes.title for axes in figure.axes]
            labels = [text for axes in figure.axes for text in (*axes.texts, axes.xaxis.label, axes.yaxis.label)]
            assert min(float(text.get_fontsize()) for text in (*ticks, *titles, *labels)) >= 8


def test_the_page_holds_every_figure_and_says_what_is_missing(tmp_path: Path) -> None:
    inspection = inspection_of(np.stack([np.eye(4)] * 2), (2, 2))._replace(title="<learner> & co")
    page = write_inspection(inspection, tmp_path / "out")
    text = page.read_text(encoding="utf-8")
    assert "<h1>&lt;learner&gt; &amp; co</h1>" in text
    assert "2 agents, 4 states, 4 actions." in text
    assert "All 2 agents have the same table" in text
    assert "There is no learning curve" in text
    assert escape(POLICY.caption(inspection)) in text
    assert text.count("<svg") == 1
    assert not re.search(r'(src|href)="http|url\(http', text)
    assert sorted(file.name for file in (tmp_path / "out" / "figures").iterdir()) == ["policy.png", "policy.svg"]
    first = page.read_bytes()
    assert write_inspection(inspection, tmp_path / "out").read_bytes() == first


@pytest.mark.slow
def test_no_two_things_on_the_page_have_one_id(tmp_path: Path) -> None:
    text = write_inspection(everything(), tmp_path).read_text(encoding="utf-8")
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(set(ids)) == len(ids)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot make the folder"):
        write_inspection(LITTLE["one state without layout"], tmp_path / "file")


def test_a_page_lists_all_open_states_or_those_in_which_most_was_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    q = np.zeros((2, 6, 4))
    q[0, [1, 4], 0] = (3.0, 9.0)
    blocked = np.array([0, 0, 0, 0, 0, 1], dtype=np.bool_)
    inspection = inspection_of(q, blocked=blocked)
    n_agents, states = listed(inspection)
    assert (n_agents, states.tolist()) == (2, [0, 1, 2, 3, 4])
    assert live_states(inspection).content["note"] == ""
    monkeypatch.setattr(explore, "MOST_VALUES", 20)
    assert listed(inspection)[0] == 1
    monkeypatch.setattr(explore, "MOST_VALUES", 8)
    assert listed(inspection)[1].tolist() == [1, 4]
    note = live_states(inspection).content["note"]
    assert "Listed are the 2 of 5 states whose values are farthest apart. Only the first 1 agent of 2 can be" in note


def test_a_pages_numbers_are_the_tables_numbers() -> None:
    inspection = everything()
    content = live_states(inspection).content
    read = np.frombuffer(base64.b64decode(content["q"][2]), "<f4").reshape(12, 4)
    np.testing.assert_array_equal(read, inspection.q[2].astype(np.float32))
    best = np.frombuffer(base64.b64decode(content["best"][1]), "<i4")
    np.testing.assert_array_equal(best, inspection.best[1])
    assert content["ways"] == [(-1, 0), (1, 0), (0, -1), (0, 1)]


def test_a_state_loading_is_as_strong_as_its_part_of_the_episodes_tables() -> None:
    inspection = everything()
    loadings = inspection.decomposed
    found = strengths(loadings)
    for episode in range(6):
        core = np.tensordot(loadings.factors[2][episode], loadings.core, (0, 2))  # (r_0, r_1, r_3)
        others = np.einsum("san,pa,mn->spm", core, loadings.factors[1], loadings.factors[3])
        expected = np.sqrt(np.square(others).sum(axis=(1, 2)))  # factors' columns are orthonormal
        np.testing.assert_allclose(found[episode] / found[0], expected / np.linalg.norm(core_of(loadings, 0), axis=1))
    assert found.max(axis=0).tolist() == [1.0, 1.0, 1.0]


def core_of(loadings: Loadings, episode: int) -> FloatArray:
    part: FloatArray = np.tensordot(loadings.factors[2][episode], loadings.core, (0, 2))
    return part.reshape(len(part), -1)


def test_only_columns_that_carry_a_hundredth_are_drawn() -> None:
    core = np.zeros((3, 3, 1, 1))
    core[0, 0], core[1, 1], core[2, 2] = 10.0, 0.5, 2.0  # squares 100, 0.25, 4
    factors = (np.eye(6, 3), np.eye(4, 3), np.ones((1, 1)), np.ones((1, 1)))
    loadings = Loadings(np.arange(6), factors, core, episode=7)
    inspection = inspection_of(np.zeros((1, 6, 4)), (2, 3), loadings=loadings)
    titles = [axes.get_title(loc="left") for axes in STATE_LOADINGS.draw(inspection).axes if axes.images]
    assert [title.split(":")[0] for title in titles] == ["1", "3"]
    assert "Not drawn: 1 column of less than 1 %, together 0.24 %" in STATE_LOADINGS.caption(inspection)
    assert "Columns that carry less than 1 % are not drawn" in LOADINGS.caption(inspection)
