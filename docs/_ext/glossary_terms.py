"""The glossary's table, made into terms that pages can link to; in the repository docs/glossary.md
stays a plain table.
"""

from __future__ import annotations

import re

from sphinx.application import Sphinx

#: The page.
PAGE = "glossary"
_ROW = re.compile(r"^\| (\*\*.+?) \| (.+) \|$")
_TERM = re.compile(r"\*\*(.+?)\*\*")


def terms(text: str) -> list[tuple[list[str], str]]:
    """(words, meaning) of every row of the table; what stands behind the words, ``**event** (of a
    branch)``, begins the meaning.
    """
    rows = (_ROW.match(line) for line in text.splitlines())
    return [
        (_TERM.findall(row[1]), f"{row[1].rpartition('**')[2].strip()} {row[2]}".strip())
        for row in rows
        if row
    ]


def as_glossary(text: str) -> str:
    """The page with a glossary directive in place of its table."""
    lines = [line for line in text.splitlines() if not line.startswith("|")]
    entries = "\n\n".join("\n".join(words) + f"\n  {meaning}" for words, meaning in terms(text))
    return "\n".join(lines).rstrip() + f"\n\n```{{glossary}}\n{entries}\n```\n"


def _rewrite(_app: Sphinx, page: str, source: list[str]) -> None:
    if page == PAGE:
        source[0] = as_glossary(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.connect("source-read", _rewrite)
    return {"parallel_read_safe": True}
