"""The explorer's page in a browser, as tests see and move it."""

from __future__ import annotations

import json
import os
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import saltus as sl

#: How long a page may take before a test gives it up [s]; no test asserts how long it took.
PATIENCE = 60.0


class Seen:
    """A page of the explorer, as a test sees and moves it."""

    def __init__(self, page, patience=PATIENCE):
        self.page, self.said, self.patience = page, [], patience
        page.on("console", lambda message: self.said.append(message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))

    def get(self, text, argument=None):
        """The value of an expression in the page."""
        return self.page.evaluate(text, argument)

    def until(self, text, argument=None):
        """Ask again and again: waiting in the page needs eval, which its policy forbids."""
        end = time.monotonic() + self.patience
        while not (value := self.page.evaluate(text, argument)):
            if time.monotonic() > end:
                words = self.page.inner_text("body")
                raise AssertionError(
                    f"not in {self.patience:g} s: {text}\n{self.said}\n{words[:600]}"
                )
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


@contextmanager
def opened(system, **options):
    explorer = sl.explore(system, browser=False, **options)
    try:
        yield explorer
    finally:
        explorer.close()


def small(explorer, **view):
    """Address of a small map, so that tests are short."""
    return f"{explorer.url}&view={quote(json.dumps({'size': [40, 40], 'periods': 30, **view}))}"
