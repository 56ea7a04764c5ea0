"""The directive ``claims``: the verdicts of a replication, from the claims.csv that its full run
wrote, kept in docs/replication/.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FOLDER = Path(__file__).resolve().parent.parent / "replication"


def markdown(file: Path) -> str:
    """The claims as Markdown: a count of the verdicts, then a row for each."""
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    counts = Counter(row["verdict"] for row in rows)
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
    table = ["| figure | what the paper says | verdict |", "|---|---|---|"]
    table += [
        f"| {row['figure']} | {row['what the paper says']} | {row['verdict']} |".replace("\n", " ")
        for row in rows
    ]
    return f"{len(rows)} claims: {told}.\n\n" + "\n".join(table) + "\n"


class Claims(SphinxDirective):
    """The verdicts on one paper."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        file = FOLDER / f"{self.arguments[0]}.csv"
        if not file.exists():
            raise self.error(
                f"docs/replication/{file.name} isn't there: copy claims.csv of "
                f"`saltus reproduce {self.arguments[0]}`."
            )
        self.env.note_dependency(str(file))
        return self.parse_text_to_nodes(markdown(file))


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("claims", Claims)
    return {"parallel_read_safe": True}
