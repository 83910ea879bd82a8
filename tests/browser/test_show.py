"""The page of `tuckerl show` in a browser: read by mouse and keyboard, searched, and still without scripts."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.browser.visit import VisitMaker
from tuckerl.reports.inspect import inspect_tensor, write_inspection

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

NAMES = ("<b>up</b>", "down & out", "stay")


@pytest.fixture(scope="module")
def listed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Give the address of a page of 30 states without a layout; in state s, action s % 3 is the best by s."""
    q = np.zeros((30, 3, 2, 1))
    q[np.arange(30), np.arange(30) % 3, :, 0] = np.arange(30)[:, np.newaxis]
    inspection = inspect_tensor(q, (3, 3, 1, 1), title="<i>states</i>", action_names=NAMES)
    return write_inspection(inspection, tmp_path_factory.mktemp("listed")).as_uri()


def rows_of(page: Page) -> list[str]:
    return [row.split("\t")[0] for row in page.locator("table.states tbody tr").all_inner_texts()]


def test_a_boards_cells_are_read_by_mouse_and_keyboard(visit: VisitMaker, written: Callable[[str], str]) -> None:
    page = visit(written("show")).page
    readout = page.locator("#policy .readout")
    expect(readout).to_contain_text("row 0, column 3 (state 3)")
    board = page.get_by_role("application")
    board.press("ArrowRight")
    board.press("ArrowDown")
    expect(readout).to_contain_text("row 1, column 4 (state 40)")
    page.get_by_role("combobox", name="Agent").select_option("agent 2")
    expect(readout).to_contain_text("Q(s, a) of agent 2")
    box = board.bounding_box()
    assert box is not None
    board.hover(position={"x": 0.5 * box["width"] / 36, "y": 2.5 * box["height"] / 39})
    expect(readout).to_contain_text("row 2, column 0 (state 72)")


def test_sliders_move_through_windows_and_episodes_by_keyboard(
    visit: VisitMaker, written: Callable[[str], str]
) -> None:
    page = visit(written("show")).page
    windows = page.get_by_role("slider", name="Window", exact=True)
    expect(page.locator("#weights .readout")).to_contain_text("After episode 20:")
    before = page.locator("#copied line.cursor").get_attribute("x1")
    windows.press("ArrowLeft")
    expect(page.locator("#weights .readout")).to_contain_text("After episode 15:")
    assert page.locator("#copied line.cursor").get_attribute("x1") != before
    page.get_by_role("slider", name="Episode of the window").press("ArrowRight")
    expect(page.locator("#state-loadings .live")).to_contain_text("episode 16")


def test_states_are_searched_sorted_and_turned_over(visit: VisitMaker, listed: str) -> None:
    page = visit(listed).page
    assert rows_of(page) == [str(state) for state in range(15)]
    page.get_by_role("button", name="Next").click()
    assert rows_of(page)[-1] == "29"
    page.get_by_role("button", name="value").press("Enter")
    assert rows_of(page)[:2] == ["29", "28"]
    page.get_by_label("Search states").fill("out")
    assert rows_of(page) == [str(state) for state in range(28, 0, -3)]
    page.get_by_label("Search states").fill("7")
    assert rows_of(page) == ["7"]
    page.get_by_role("button", name="7", exact=True).focus()
    expect(page.locator(".readout")).to_contain_text("down & out (greedy)")


def test_markup_in_names_is_text(visit: VisitMaker, listed: str) -> None:
    page = visit(listed).page
    assert page.locator("h1").inner_text() == "<i>states</i>"
    expect(page.locator("table.states")).to_contain_text("<b>up</b>")
    assert page.locator("main b, h1 i").count() == 0


def test_still_figures_and_a_table_remain_without_scripts_and_on_paper(visit: VisitMaker, listed: str) -> None:
    still, live = ("#policy .still svg", "#policy .live")
    plain = visit(listed, scripts=False).page
    printed = visit(listed).page
    assert not printed.locator(still).is_visible()
    printed.emulate_media(media="print")
    for page in (plain, printed):
        assert page.locator(still).is_visible()
        assert not page.locator(live).is_visible()
        assert page.locator(".states-first tbody tr").count() == 29
        assert page.locator(".states-first").is_visible()


def test_a_page_is_small(listed: str) -> None:
    assert Path(listed.removeprefix("file://")).stat().st_size < 300_000
