"""The browser and the pages that the tests open: all on one worker of pytest-xdist, so that one browser starts."""

import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.browser.subjects import SUBJECTS
from tests.browser.visit import Scheme, Visit, VisitMaker, chromium, must_have_a_browser


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep what needs the browser on one worker."""
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent):
            item.add_marker(pytest.mark.xdist_group("browser"))


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Start the system's Chromium; skip where there is none, and fail where the tests decide what is accepted."""
    path = chromium()
    if path is None:
        missing = "no chromium, chromium-browser or google-chrome on PATH: install Chromium to test pages in it"
        pytest.fail(missing) if must_have_a_browser() else pytest.skip(missing)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def visit(browser: Browser) -> Iterator[VisitMaker]:
    """Open pages for one test; in the end they must have said nothing and asked for nothing."""
    visits: list[Visit] = []

    def opened(url: str, **how: Any) -> Visit:
        visits.append(Visit(browser, url, **how))
        return visits[-1]

    yield opened
    for one in visits:
        one.close()
    assert [one.troubles for one in visits if one.troubles] == []


@pytest.fixture(scope="session")
def kept(browser: Browser) -> Iterator[Callable[[str, Scheme], Visit]]:
    """Open a page in a colour scheme once, for all tests that only look at it."""
    visits: dict[tuple[str, Scheme], Visit] = {}

    def opened(url: str, scheme: Scheme) -> Visit:
        if (url, scheme) not in visits:
            visits[url, scheme] = Visit(browser, url, scheme=scheme)
        return visits[url, scheme]

    yield opened
    for one in visits.values():
        one.close()


@pytest.fixture(scope="session")
def written(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Give the address of the page that a command of :mod:`tests.browser.subjects` writes; each is made once."""
    folder = tmp_path_factory.mktemp("pages")
    return functools.cache(lambda name: SUBJECTS[name](folder / name).as_uri())
