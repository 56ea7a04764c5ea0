"""The directive ``measured``: the tables that a benchmark wrote to docs/comparison/, with machine,
date and command.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

#: Where benchmarks write.
FOLDER = Path(__file__).resolve().parent.parent / "comparison"


def cell(value: str | float | None, form: str) -> str:
    """A value as its column writes it; a dash for none."""
    if value is None:
        return "-"
    return (
        value.replace("|", "\\|")
        if isinstance(value, str)
        else format(int(value) if form == "d" else value, form)
    )


def table(one: dict[str, Any]) -> str:
    """A table as Markdown, its first column in words and the others to the right."""
    columns = one["columns"]
    lines = [[column["heading"] for column in columns], ["---", *("--:" for _ in columns[1:])]]
    lines += [
        [cell(value, column["form"]) for value, column in zip(row, columns, strict=True)]
        for row in one["rows"]
    ]
    return "\n".join([f"**{one['title']}**", "", *(f"| {' | '.join(line)} |" for line in lines)])


def markdown(record: dict[str, Any]) -> str:
    """A record as Markdown: its tables, then where they come from."""
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    origin = (
        f"*{record['setting']} Measured on {record['date']} on {record['machine']}, Python "
        f"{record['python']}, {versions}, by* "
    )
    notes = [f"Left out: {what}." for what in record["left_out"]]
    return (
        "\n\n".join(
            [
                *(table(one) for one in record["tables"] if one["rows"]),
                f"{origin}`{record['command']}`.",
                *notes,
            ]
        )
        + "\n"
    )


class Measured(SphinxDirective):
    """What one benchmark measured."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        file = FOLDER / f"{self.arguments[0]}.json"
        if not file.exists():
            raise self.error(
                f"docs/comparison/{file.name} isn't there: `python -m benchmarks` writes it."
            )
        self.env.note_dependency(str(file))
        return self.parse_text_to_nodes(markdown(json.loads(file.read_text(encoding="utf-8"))))


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("measured", Measured)
    return {"parallel_read_safe": True}
