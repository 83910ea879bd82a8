"""A page in headless Chromium: what it says and asks for is noted; its width and what axe finds can be asked.

Tests of pages take the fixture ``visit``::

    def test_the_slider_moves_by_keyboard(visit: VisitMaker, report: str) -> None:
        page = visit(report).page
        page.get_by_role("slider").press("ArrowRight")

Its visits are closed after the test, which fails if a page wrote to the console, raised an error or asked for anything
that is not its own.
"""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any, Literal, get_args
from urllib.parse import urlsplit

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, ConsoleMessage, Request

WIDTHS = (360, 768, 1440)  # a phone, a tablet upright, a desk
Scheme = Literal["light", "dark"]
SCHEMES: tuple[Scheme, ...] = get_args(Scheme)
_HEIGHT = 900
_ALOUD = ("serious", "critical")
_OF_THE_THEME = "[PST]: "  # what the site's theme always writes
_NAMES = ("chromium", "chromium-browser", "google-chrome")

_TOO_WIDE = """() => {
    const room = document.documentElement.clientWidth;
    const scrolls = box => {
        for (let outer = box.parentElement; outer && outer !== document.body; outer = outer.parentElement)
            if (["auto", "scroll"].includes(getComputedStyle(outer).overflowX)) return true;
        return false;
    };
    const told = box => [...box.childNodes].some(child => child.nodeType === Node.TEXT_NODE && child.data.trim());
    const seen = box => box.checkVisibility({visibilityProperty: true, opacityProperty: true});
    const wide = [...document.body.querySelectorAll("*")].filter(
        box => box.getBoundingClientRect().right > room + 1 && told(box) && seen(box) && !scrolls(box));
    const page = document.documentElement.scrollWidth;
    if (page <= room && !wide.length) return [];
    return [`${page} wide where ${room} is the screen:`, ...wide.slice(0, 8).map(
        box => `<${box.tagName.toLowerCase()} class="${box.getAttribute("class")}"> ${box.textContent.slice(0, 50)}`)];
}"""


def chromium() -> str | None:
    """Return the path of the system's Chromium, or None where there is none."""
    return next(filter(None, map(shutil.which, _NAMES)), None)


def must_have_a_browser() -> bool:
    """Say whether a missing browser is a failure: so it is where the tests decide what is accepted."""
    return os.environ.get("CI", "") not in ("", "0", "false")


class Visit:
    """One page in one colour scheme, and everything that it said or asked for.

    Attributes
    ----------
    page : playwright.sync_api.Page
        To look, click and type.
    troubles : list of str
        Console messages, errors of scripts, requests for something else than the page's own, failed ones included.
    """

    def __init__(
        self, browser: Browser, url: str, *, scheme: Scheme = "light", width: int = 1440, scripts: bool = True
    ):
        self.troubles: list[str] = []
        self._own = url if url.startswith("file:") else "{0.scheme}://{0.netloc}/".format(urlsplit(url))
        self.page = browser.new_page(
            color_scheme=scheme, viewport={"width": width, "height": _HEIGHT}, java_script_enabled=scripts
        )
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.troubles.append(f"error: {error}"))
        self.page.on("request", self._asked)
        self.go(url)

    def _said(self, message: ConsoleMessage) -> None:
        if message.text.startswith(_OF_THE_THEME):
            return
        self.troubles.append(f"console: {message.type}: {message.text}")

    def _asked(self, request: Request) -> None:
        own = request.url == self._own if self._own.startswith("file:") else request.url.startswith(self._own)
        if not own and urlsplit(request.url).scheme not in ("data", "blob"):
            self.troubles.append(f"request: {request.url}")

    def go(self, url: str) -> None:
        """Open another page in the same tab."""
        self.page.goto(url)

    def resize(self, width: int) -> None:
        """Make the window that wide, and wait until the page is laid out anew."""
        self.page.set_viewport_size({"width": width, "height": _HEIGHT})
        self.page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def too_wide(self, width: int) -> list[str]:
        """Return what a window of that width cuts off, or scrolls the whole page for; nothing where all fits."""
        self.resize(width)
        found: list[str] = self.page.evaluate(_TOO_WIDE)
        return found

    def axe(self, *rules: str) -> list[str]:
        """Return what axe finds serious or critical, by all its rules or those named: what, how often, where first."""
        # Told to look at nothing but violations, axe takes a quarter of the time.
        options = {"resultTypes": ["violations"], "preload": False} | ({"runOnly": list(rules)} if rules else {})
        found: list[dict[str, Any]] = Axe().run(self.page, options=options).response["violations"]
        return [_line(rule) for rule in found if rule["impact"] in _ALOUD]

    def close(self) -> None:
        """Close the tab."""
        self.page.close()


VisitMaker = Callable[..., Visit]


def _line(rule: dict[str, Any]) -> str:
    first = rule["nodes"][0]
    wrong = [one["message"] for one in (*first["any"], *first["all"], *first["none"])]
    return f"{rule['id']} ({rule['impact']}), {len(rule['nodes'])} times, first {first['target'][0]}: {wrong[:1]}"


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder on the loopback address for as long as the context lasts, and give its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
