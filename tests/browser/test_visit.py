"""A page with everything wrong: the tests of pages would see each of it."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser.visit import Visit, VisitMaker, served

pytestmark = pytest.mark.slow

BAD = """<!doctype html><html lang="en"><title>Bad</title><body><main><h1>Bad</h1>
<style>@media (prefers-color-scheme: dark) { body { background: #111; color: #222 } }</style>
<p style="width: 700px">Wide</p><div style="overflow: auto"><p style="width: 2000px">Wide, and kept</p></div>
<div style="overflow: hidden"><p style="width: 2000px">Cut off</p></div>
<img src="missing.png"><script>console.log("I say something"); undefined.x</script></main></body></html>"""


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    page = tmp_path_factory.mktemp("bad") / "bad.html"
    page.write_text(BAD)
    return page


def test_what_a_page_says_and_asks_for_is_noted(bad: Path, browser: Browser) -> None:
    visit = Visit(browser, bad.as_uri())
    noted = "\n".join(visit.troubles)
    for expected in (
        "console: log: I say something",
        "error: Cannot read properties",
        "request: file:///",
        "missing.png",
    ):
        assert expected in noted
    visit.close()


def test_a_site_may_ask_for_what_is_its_own_and_there(bad: Path, browser: Browser) -> None:
    with served(bad.parent) as address:
        visit = Visit(browser, f"{address}bad.html", scripts=False)
        (missing,) = visit.troubles
        assert "404" in missing
        visit.close()


def test_what_makes_the_page_wide_or_is_cut_off_is_too_wide(bad: Path, browser: Browser) -> None:
    visit = Visit(browser, bad.as_uri())
    assert visit.too_wide(2200) == []
    size, *boxes = visit.too_wide(360)
    assert size.endswith("wide where 360 is the screen:")
    assert [box.split(">")[1] for box in boxes] == [" Wide", " Cut off"]
    visit.close()


def test_axe_finds_an_image_without_text_and_too_little_contrast_in_the_dark(bad: Path, browser: Browser) -> None:
    light, dark = (Visit(browser, bad.as_uri(), scheme=scheme) for scheme in ("light", "dark"))
    assert [one.split(" ")[0] for one in light.axe()] == ["image-alt"]
    assert light.axe("color-contrast") == []
    assert [one.split(" ")[0] for one in dark.axe("color-contrast")] == ["color-contrast"]
    for visit in (light, dark):
        visit.close()


def test_a_good_page_passes(visit: VisitMaker, tmp_path: Path) -> None:
    page = tmp_path / "good.html"
    page.write_text('<!doctype html><html lang="en"><title>Good</title><main><h1>Good</h1></main></html>')
    good = visit(page.as_uri())
    assert good.axe() == []
    assert good.too_wide(360) == []
