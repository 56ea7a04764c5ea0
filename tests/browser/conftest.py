"""The explorer's page in the system's Chromium; where there is none these tests are left out, and
pytest says so. SALTUS_CHROMIUM names another one, SALTUS_PICTURES a folder for what they see.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import pytest

import saltus as sl

CHROMIUM = os.environ.get("SALTUS_CHROMIUM") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: Drawing by software: a GPU that is emulated is twenty times as slow.
DRAWING = (
    "--disable-gpu-compositing", "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas",
    "--no-sandbox",
)  # fmt: skip
#: How long a page may take before a test gives it up [s]; no test asserts how long it took.
PATIENCE = 60.0
#: What the console may say: that the line is lost, where a test cuts it.
CUT = "WebSocket connection to"


def pytest_collection_modifyitems(items):
    here = Path(__file__).parent
    for item in items:
        if item.path.parent == here:
            item.add_marker("browser")


def pytest_runtest_setup(item):
    if CHROMIUM is None and item.path.name != "test_bundle.py":
        pytest.skip("no Chromium on this machine: SALTUS_CHROMIUM may name one")


class Seen:
    """A page of the explorer, as a test sees and moves it."""

    def __init__(self, page):
        self.page, self.said = page, []
        page.on("console", lambda message: self.said.append(message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))

    def get(self, text, argument=None):
        """The value of an expression in the page."""
        return self.page.evaluate(text, argument)

    def until(self, text, argument=None):
        """Ask again and again: waiting in the page needs eval, which its policy forbids."""
        end = time.monotonic() + PATIENCE
        while not (value := self.page.evaluate(text, argument)):
            if time.monotonic() > end:
                words = self.page.inner_text("body")
                raise AssertionError(f"not in {PATIENCE:g} s: {text}\n{self.said}\n{words[:600]}")
            time.sleep(0.01)
        return value

    def rest(self):
        """Wait until everything that was asked is answered, and drawn."""
        self.until("!!window.explorer && explorer.rests")
        self.get("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def text(self, at):
        return self.page.inner_text(at)

    def place(self, at, x, y):
        """Pixel of the window at data of a canvas: #map-canvas, #responses-canvas."""
        box = self.page.locator(at).bounding_box()
        of = {"#map-canvas": "map", "#responses-canvas": "responses"}[at]
        px, py = self.get(f"([x, y]) => explorer.{of}.pixel([x, y])", [x, y])
        return box["x"] + px, box["y"] + py

    def keep(self, name):
        """A picture for whoever looks at them, if SALTUS_PICTURES names a folder."""
        if folder := os.environ.get("SALTUS_PICTURES"):
            self.page.screenshot(path=Path(folder) / f"{name}.png")


@pytest.fixture(scope="session")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright isn't installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(DRAWING))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def rig():
    return sl.models.delangre("b", force="4 N", frequency="15 Hz")


@pytest.fixture(scope="session")
def explored(rig):
    with opened(rig) as explorer:
        yield explorer


@contextmanager
def opened(system, **options):
    explorer = sl.explore(system, browser=False, **options)
    try:
        yield explorer
    finally:
        explorer.close()


@pytest.fixture
def see(browser):
    """Opens a page in a window of its own: ``see(address, width=..., **options)``."""
    contexts, pages = [], []

    def open_page(address, width=1400, height=900, rest=True, before=None, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        seen = Seen(context.new_page())
        pages.append(seen)
        if before is not None:
            before(seen.page)
        seen.page.goto(address)
        if rest:
            seen.rest()
        return seen

    yield open_page
    for context in contexts:
        context.close()
    said = [text for seen in pages for text in seen.said if CUT not in text]
    assert not said, said  # the console stays empty


def small(explorer, **view):
    """Address of a small map, so that tests are short."""
    return f"{explorer.url}&view={quote(json.dumps({'size': 50, 'periods': 30, **view}))}"


@pytest.fixture
def seen(see, explored):
    return see(small(explored))
