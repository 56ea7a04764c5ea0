"""The explorer's page in the system's Chromium; where there is none these tests are left out, and
pytest says so. SALTUS_CHROMIUM names another one, SALTUS_PICTURES a folder for what they see.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import saltus as sl
from explorer_page import PATIENCE, Seen, opened, small

CHROMIUM = os.environ.get("SALTUS_CHROMIUM") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: Drawing by software: a GPU that is emulated is twenty times as slow.
DRAWING = (
    "--disable-gpu-compositing", "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas",
    "--no-sandbox",
)  # fmt: skip
#: A page's waits for a hand to rest are a tenth as long: no hand rests here.
HURRIED = """{ const wait = setTimeout;
  window.setTimeout = (what, time, ...more) => wait(what, time / 10, ...more) }"""
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


@pytest.fixture(scope="session")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright isn't installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(DRAWING))
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def rig():
    """Two attractors of one period, found in a fifth of a second."""
    return sl.models.delangre("a", force="1.5 N", frequency="10 Hz")


@pytest.fixture(scope="session")
def explored(rig):
    with opened(rig) as explorer:
        yield explorer


@pytest.fixture
def see(browser):
    """Opens a page in a window of its own: ``see(address, width=..., **options)``."""
    contexts, pages = [], []

    def open_page(
        address, width=1400, height=900, rest=True, before=None, patience=PATIENCE, hurried=True,
        **options,
    ):  # fmt: skip
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        if hurried:
            context.add_init_script(HURRIED)
        contexts.append(context)
        seen = Seen(context.new_page(), patience)
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


@pytest.fixture
def seen(see, explored):
    return see(small(explored))


@pytest.fixture(scope="session")
def web(tmp_path_factory):
    """The page's sources with what builds them, fetched anew by the lock file."""
    if shutil.which("npm") is None:
        pytest.skip("no Node on this machine: what is built from web/ isn't compared")
    sources = Path(__file__).parents[2] / "web"
    if not sources.is_dir():
        pytest.skip("no sources of the page here: these tests are run in a checkout")
    copy = tmp_path_factory.mktemp("page") / "web"
    shutil.copytree(sources, copy, ignore=shutil.ignore_patterns("node_modules"))
    got = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"],
        cwd=copy, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    if got.returncode:
        pytest.skip(f"npm can't fetch what builds the page: {got.stderr[-200:]}")
    return copy
