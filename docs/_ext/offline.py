"""Fails the build if a page would load anything from another machine. Links that a reader may
follow are no requests.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util import logging

#: Tags and the attributes that a browser loads by itself.
LOADED = {
    "script": ("src",), "img": ("src", "srcset"), "iframe": ("src",), "source": ("src", "srcset"),
    "link": ("href",), "video": ("src",),
    "audio": ("src",), "embed": ("src",), "object": ("data",), "use": ("href", "xlink:href"),
    "image": ("href", "xlink:href"),
}  # fmt: skip
#: <link> kinds that are only told to those who ask.
_TOLD = {
    "canonical",
    "author",
    "next",
    "prev",
    "search",
    "index",
    "genindex",
    "copyright",
    "license",
}
_ELSEWHERE = re.compile(r"^(https?:|wss?:)?//", re.IGNORECASE)
_STYLE = re.compile(r"(?:url\(\s*|@import\s+)['\"]?((?:https?:)?//[^'\")\s;]+)", re.IGNORECASE)


class _Reader(HTMLParser):
    """Collects what a page loads from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """See HTMLParser."""
        given = {name: value or "" for name, value in attrs}
        if tag == "link" and set(given.get("rel", "").split()) <= _TOLD:
            return
        self.found += [
            given[name] for name in LOADED.get(tag, ()) if _ELSEWHERE.match(given.get(name, ""))
        ]


def requests(folder: Path) -> Iterator[tuple[Path, str]]:
    """(file, address) of everything that the pages and style sheets of a folder load from
    elsewhere.
    """
    for page in sorted(folder.rglob("*.html")):
        reader = _Reader()
        text = page.read_text(encoding="utf-8")
        reader.feed(text)
        yield from ((page, address) for address in (*reader.found, *_STYLE.findall(text)))
    for sheet in sorted(folder.rglob("*.css")):
        yield from (
            (sheet, address) for address in _STYLE.findall(sheet.read_text(encoding="utf-8"))
        )


def _check(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        for file, address in requests(Path(app.outdir)):
            logging.getLogger(__name__).warning(
                "%s loads %s: keep a copy of it in docs/_static", file.name, address
            )


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
