"""A report that is explored: its controls by mouse and keyboard, on paper and without scripts."""

import re
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, expect

from tests.browser.visit import Visit, VisitMaker
from tests.reports.examples import SCENARIO, claim, study_of, tables_of
from tuckerl.reports.report import write_report
from tuckerl.studies.summary import Path as Walked
from tuckerl.studies.summary import summarise

pytestmark = pytest.mark.slow

EVIL = "<b>dyna-h</b>"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A page of runs of which one diverged, with a variant whose name has markup in it."""
    study = study_of()
    _, (summary,) = summarise(study, tables_of())
    way = (np.array([0, 9, 18]), np.array([0, 9]))
    named = tuple(replace(one, name=EVIL) if one.name == "dyna-h" else one for one in SCENARIO.variants)
    curves = tuple(one._replace(variant=EVIL) if one.variant == "dyna-h" else one for one in summary.curves)
    summary = summary._replace(
        scenario=replace(SCENARIO, variants=named), curves=curves, paths=(Walked("dyna-ht-1", way[1], way),)
    )
    folder = tmp_path_factory.mktemp("report")
    return write_report(study_of(summary.scenario), [claim()], [summary], folder).as_uri()


def row(figure: Locator, name: str) -> Locator:
    return figure.locator(".legend tr").filter(has=figure.page.get_by_role("button", name=name, exact=True))


def test_pointing_at_a_line_says_mean_interval_and_n(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    stage = figure.locator(".stage")
    stage.scroll_into_view_if_needed()
    stage.hover(position={"x": 500, "y": 60})
    expect(figure.locator(".tip")).to_have_text(
        re.compile(r"^.+, episode \d+: [\d,.]+ \[[\d,.]+, [\d,.]+\], n = [23]$")
    )
    assert figure.locator("path.faded").count() > 0
    figure.page.mouse.move(0, 0)
    expect(figure.locator(".tip")).to_be_hidden()


def test_a_base_can_be_chosen_and_an_episode_by_keyboard(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    expect(row(figure, EVIL).locator("td").nth(2)).to_have_text("\N{EN DASH}")
    figure.get_by_label("constant-1", exact=True).press("Space")
    expect(row(figure, "constant-1").locator("td").nth(2)).to_have_text("\N{EN DASH}")
    expect(figure.get_by_role("columnheader", name="steps saved against constant-1")).to_be_visible()
    slider = figure.get_by_role("slider")
    before = row(figure, "dyna-ht-1").text_content()
    slider.press("ArrowLeft")
    assert slider.get_attribute("aria-valuetext") == "19"
    assert row(figure, "dyna-ht-1").text_content() != before


def test_a_line_can_be_hidden_by_keyboard_and_keeps_the_focus(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    lines = figure.locator(".stage path.mean")
    before = lines.count()
    button = figure.get_by_role("button", name="dyna-ht-3", exact=True)
    button.press("Enter")
    expect(button).to_have_attribute("aria-pressed", "false")
    expect(button).to_be_focused()
    assert lines.count() == before - 2


def test_a_run_can_be_found_and_looked_at(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    figure.get_by_text("Find a run").click()
    figure.get_by_role("searchbox").fill("diverged")
    expect(figure.get_by_text("1 of 3 runs")).to_be_visible()
    figure.get_by_role("button", name="Run 2").press("Enter")
    expect(figure.get_by_label("one run")).to_be_checked()
    expect(row(figure, "dyna-ht-1").locator("td").first).to_have_text("\N{EN DASH} ")
    figure.get_by_label("means and single runs").check()
    assert figure.locator("path.single").count() > 0


def test_axes_can_be_logarithmic(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    path = figure.locator(".stage path.mean").first
    before = path.get_attribute("d")
    figure.get_by_label("episodes", exact=True).check()
    assert path.get_attribute("d") != before


def test_the_paths_of_episodes_are_shown_by_a_slider(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig10")
    expect(figure.locator("td")).to_have_text("1 step, goal not reached (paper: 83)")
    figure.get_by_role("slider").press("Home")
    expect(figure.locator("td")).to_have_text("2 steps")
    assert len((figure.locator("polyline").get_attribute("points") or "").split()) == 3


def test_names_are_texts(visit: VisitMaker, report: str) -> None:
    figure = visit(report).page.locator("#fig11")
    expect(figure.get_by_role("button", name=EVIL, exact=True)).to_be_visible()
    assert figure.locator(".legend b").count() == 0


def test_one_figure_is_seen_at_a_time(browser: Browser, visit: VisitMaker, report: str) -> None:
    page = visit(report).page
    still, live = page.locator("#fig11 .still"), page.locator("#fig11 .live")
    expect(live).to_be_visible()
    expect(still).to_be_hidden()
    page.emulate_media(media="print")
    expect(still).to_be_visible()
    expect(live).to_be_hidden()
    plain = visit(report, scripts=False).page
    expect(plain.locator("#fig11 .still")).to_be_visible()
    expect(plain.get_by_role("link", name="Download the data as CSV").first).to_be_visible()


def test_a_table_and_the_runs_can_be_downloaded(visit: VisitMaker, report: str) -> None:
    page = visit(report).page
    with page.expect_download() as table:
        page.get_by_role("button", name="Download as CSV: The paper's claims").click()
    assert table.value.path().read_text().splitlines()[0].startswith("Id,Claim,Does it hold?,")
    page.locator("#fig11").get_by_text("Find a run").click()
    with page.expect_download() as runs:
        page.locator("#fig11").get_by_role("button", name="Download all of these runs").click()
    assert runs.value.path().read_text().splitlines()[1].startswith(f"{EVIL},0,1,")


def test_axe_finds_nothing_serious_while_it_is_explored(visit: VisitMaker, report: str) -> None:
    opened: Visit = visit(report)
    opened.page.locator("#fig11").get_by_text("Find a run").click()
    assert opened.axe() == []
    assert opened.too_wide(360) == []
