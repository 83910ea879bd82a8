import math

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from tests.reports.examples import sensitivity_of
from tuckerl.reports.figure import own_style
from tuckerl.reports.sensitivity_figure import COLOURS, SENSITIVITY, cell_words, draw_sensitivity
from tuckerl.studies.sensitivity import DEFAULT, Sensitivity

MINUS = "\N{MINUS SIGN}"


def test_there_is_a_panel_for_each_scenario_and_a_row_for_each_claim() -> None:
    maze, cart_pole = draw_sensitivity(sensitivity_of()).axes[:2]
    assert [label.get_text() for label in maze.get_yticklabels()] == ["C5", "C6"]
    assert [label.get_text() for label in maze.get_xticklabels()] == [
        DEFAULT,
        "other reading",
        "wild reading",
        "never run",
    ]
    assert [label.get_text() for label in cart_pole.get_yticklabels()] == ["C1"]
    assert maze.get_title("left") == "DYNA maze"


def test_every_cell_has_its_number_and_its_verdicts_sign() -> None:
    cells = tuple(cell for cell in sensitivity_of().cells if cell.scenario == "DYNA maze")
    maze = draw_sensitivity(Sensitivity(cells)).axes[0]
    words = [(round(text.get_position()[0]), text.get_text()) for text in maze.texts]
    assert words == [
        *((0, "+10 %"), (0, "+1.0 %")),
        *((1, f"{MINUS}40 %"), (1, f"{MINUS}1.0 %")),
        *((2, "diverged"), (3, "no pairs")),
    ]
    signs = {}
    for line in maze.lines:
        x, y = (round(float(np.asarray(place)[0])) for place in line.get_data())
        signs[x, y] = line.get_marker()
    assert signs == {(0, 0): "^", (1, 0): "v", (0, 1): "o", (1, 1): "o"}


def test_frames_mark_other_verdicts_than_the_default_of_the_same_claim() -> None:
    sensitivity = sensitivity_of()
    assert [sensitivity.is_changed(cell) for cell in sensitivity.cells] == [
        False,
        False,
        True,
        False,
        True,
        False,
        False,
        False,
    ]
    maze = draw_sensitivity(sensitivity).axes[0]
    frames = [patch for patch in maze.patches if isinstance(patch, Rectangle) and not patch.get_fill()]
    assert [(round(frame.get_x() + 0.45), round(frame.get_y() + 0.44)) for frame in frames] == [(1, 0), (2, 0)]


def test_without_a_default_nothing_is_changed() -> None:
    others = Sensitivity(tuple(cell for cell in sensitivity_of().cells if cell.alternative != DEFAULT))
    assert not any(others.is_changed(cell) for cell in others.cells)
    assert SENSITIVITY.render(others).svg


def test_colours_say_the_sign() -> None:
    maze = draw_sensitivity(sensitivity_of()).axes[0]
    filled = [patch for patch in maze.patches if patch.get_fill()]
    gain, loss = (to_rgb(filled[place].get_facecolor()) for place in (0, 2))  # C5, as read and otherwise
    assert gain[2] > gain[0]
    assert loss[0] > loss[2]
    assert np.allclose(COLOURS(0.5)[:3], to_rgb("#fafafa"), atol=0.01)


def test_black_letters_are_legible_on_every_colour() -> None:
    colours = COLOURS(np.linspace(0, 1, 101))[:, :3]
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    assert ((luminance + 0.05) / 0.05).min() >= 4.5  # WCAG AA


def test_letters_are_at_least_8_points() -> None:
    with own_style():
        figure = draw_sensitivity(sensitivity_of())
        texts = [
            text for axes in figure.axes for text in (*axes.texts, *axes.get_xticklabels(), *axes.get_yticklabels())
        ]
        assert min(float(text.get_fontsize()) for text in (*texts, *figure.legends[0].get_texts())) >= 8


def test_the_legend_names_every_mark_that_is_used() -> None:
    def names(sensitivity: Sensitivity) -> list[str]:
        return [text.get_text() for text in draw_sensitivity(sensitivity).legends[0].get_texts()]

    marks = ["holds", "does not hold", "not decided", "verdict other than as read"]
    assert names(sensitivity_of()) == [*marks, "no pair left"]
    assert names(Sensitivity(sensitivity_of().cells[:4])) == marks


def test_everything_diverged_can_be_drawn() -> None:
    lost = tuple(cell for cell in sensitivity_of().cells if math.isnan(cell.claim.difference.mean))
    shown = SENSITIVITY.render(Sensitivity(lost))
    assert shown.svg
    assert [cell_words(cell) for cell in lost] == ["diverged", "no pairs"]
    assert shown.name == "sensitivity"


def test_the_description_names_what_changes() -> None:
    alt = SENSITIVITY.alt(sensitivity_of())
    assert alt.endswith("Another verdict than the default's: C5 with other reading, C5 with wild reading.")
    assert SENSITIVITY.alt(Sensitivity(sensitivity_of().cells[-2:])).endswith("No verdict changes.")


def test_drawing_again_gives_the_same_bytes() -> None:
    assert SENSITIVITY.render(sensitivity_of()) == SENSITIVITY.render(sensitivity_of())


def test_cells_are_sorted_by_scenario_and_claim() -> None:
    cells = sensitivity_of().by_claim
    assert [(cell.claim.id, cell.alternative) for cell in cells[:4]] == [
        ("C5", DEFAULT),
        ("C5", "other reading"),
        ("C5", "wild reading"),
        ("C5", "never run"),
    ]
    assert [cell.scenario for cell in cells[-2:]] == ["Cart pole", "Cart pole"]


def test_differences_in_another_unit_have_no_percent_and_no_colour() -> None:
    sensitivity = sensitivity_of()
    first = sensitivity.cells[0]
    absolute = first.claim._replace(difference=first.claim.difference._replace(mean=12.0, relative=False))
    mixed = Sensitivity((first._replace(claim=absolute), *sensitivity.cells[1:]))
    maze = draw_sensitivity(mixed).axes[0]
    assert maze.texts[0].get_text() == "+12.00"
    assert np.allclose(maze.patches[0].get_facecolor()[:3], COLOURS(0.5)[:3], atol=0.01)
    assert "without a percent sign" in SENSITIVITY.caption(mixed)
    assert "without a percent sign" not in SENSITIVITY.caption(sensitivity)
