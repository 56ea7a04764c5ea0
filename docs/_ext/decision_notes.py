"""The notes on decisions get their places in the sidebar; in the repository their list stays a
plain table.
"""

from __future__ import annotations

from sphinx.application import Sphinx

#: The page that lists the notes.
PAGE = "decisions/README"
_NOTES = "\n\n```{toctree}\n:hidden:\n:glob:\n\n0*\n```\n"


def _append(_app: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        source[0] += _NOTES


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.connect("source-read", _append)
    return {"parallel_read_safe": True}
