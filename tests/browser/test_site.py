"""The documentation site as `make docs` builds it, in a browser: no network, in every window, in light and dark."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser.visit import SCHEMES, Scheme, Visit, must_have_a_browser, served
from tuckerl.learners import LEARNERS

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"
BUILT = DOCS / "_build"
OF_EACH_KIND = ("index", "faq", "algorithms/q-learning", "reference/solving")  # short ones: axe takes its time

Kept = Callable[[str, Scheme], Visit]


@pytest.fixture(scope="module")
def site(browser: Browser) -> Iterator[str]:
    if not (BUILT / "index.html").exists():
        missing = "the site is not built: `make docs` builds it into docs/_build"
        pytest.fail(missing) if must_have_a_browser() else pytest.skip(missing)
    with served(BUILT) as address:
        yield address


@pytest.fixture(scope="module")
def tab(site: str, browser: Browser) -> Iterator[Visit]:
    """Return a tab to leaf through the site with."""
    tab = Visit(browser, site)
    yield tab
    tab.close()


def test_no_page_asks_for_anything_outside_or_is_wider_than_a_phone(site: str, tab: Visit) -> None:
    written = [page.relative_to(DOCS) for kind in ("md", "ipynb") for page in DOCS.rglob(f"*.{kind}")]
    pages = [page.with_suffix(".html").as_posix() for page in written if page.parts[0] != "_build"]
    tab.resize(360)
    found = {}
    for page in pages:
        tab.troubles.clear()
        tab.go(site + page)
        found[page] = [*tab.troubles, *tab.too_wide(360)]
    assert {page: troubles for page, troubles in found.items() if troubles} == {}


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("page", OF_EACH_KIND)
def test_a_page_fits_and_axe_finds_nothing_serious(page: str, scheme: Scheme, site: str, tab: Visit) -> None:
    tab.troubles.clear()
    tab.page.emulate_media(color_scheme=scheme)
    tab.go(f"{site}{page}.html")
    assert [line for width in (768, 1440) for line in tab.too_wide(width)] == []
    assert tab.axe(*([] if scheme == "light" else ["color-contrast"])) == []
    assert tab.troubles == []


@pytest.mark.parametrize("width", [1024, 1440])
def test_the_header_is_one_row_of_five_groups(width: int, site: str, tab: Visit) -> None:
    tab.go(site)
    tab.resize(width)
    links = [link for link in tab.page.locator(".bd-header .navbar-nav a.nav-link").all() if link.is_visible()]
    assert [link.inner_text().strip() for link in links] == ["Start", "Guide", "Algorithms", "Results", "Reference"]
    boxes = [box for link in links if (box := link.bounding_box())]
    assert len({round(box["y"]) for box in boxes}) == 1
    assert all(box["height"] < 60 and box["x"] + box["width"] <= width for box in boxes)


def test_formulas_are_mathml_in_the_font_of_the_site(site: str, tab: Visit) -> None:
    tab.go(f"{site}algorithms/q-learning.html")
    assert "←" in (tab.page.locator(".formula math").first.text_content() or "")
    tab.page.evaluate("document.fonts.ready")
    loaded = tab.page.evaluate("[...document.fonts].filter(one => one.status == 'loaded').map(one => one.family)")
    assert "STIX Two Math" in "".join(loaded)


def test_every_learner_is_in_the_contents_and_shows_its_parameters(site: str, tab: Visit) -> None:
    tab.resize(1440)
    tab.go(f"{site}reference/learners.html")
    contents = tab.page.locator("nav.page-toc").inner_text()
    for name in (entry[0] for entry in LEARNERS):
        assert name in contents
        signature = tab.page.locator(f'dt[id="tuckerl.{name}"]').inner_text()
        for parameter in ("gamma", "n_agents", "seed"):
            assert f"{parameter}=" in signature, (name, signature)


def test_a_property_says_what_it_is_and_no_type_that_is_none(site: str, tab: Visit) -> None:
    tab.go(f"{site}reference/learners.html")
    told = tab.page.locator('dt[id="tuckerl.training.learner.Learner.problem"] + dd').inner_text()
    assert told.startswith("What is played: arrays")
    assert "Type" not in told
