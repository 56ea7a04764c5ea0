"""The notes on decisions are reached from their list, not from the sidebar: a hundred of them would
stand in that of every page, and take a fifth of the time of a build without notebooks (0124).
"""

from __future__ import annotations

from sphinx.application import Sphinx

#: How their pages begin; ``decisions/README`` is the list.
NOTES = "decisions/0"


def _set_aside(_app: Sphinx, page: str, source: list[str]) -> None:
    """Tell Sphinx that no table of contents has the page."""
    if page.startswith(NOTES):
        source[0] = f"---\norphan: true\n---\n\n{source[0]}"


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.connect("source-read", _set_aside)
    return {"parallel_read_safe": True}
