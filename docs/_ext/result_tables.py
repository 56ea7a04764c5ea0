"""The directive ``result-tables``: every variable of every result, read off the tables that results
are made and checked by.
"""

from __future__ import annotations

from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from saltus.results.dataset import schema


def markdown() -> str:
    """A section for each kind of result."""
    return "\n\n".join("\n".join(_section(kind)) for kind in schema.NAMES) + "\n"


def _section(kind: str) -> Iterator[str]:
    makers = " and ".join(f"`sl.{name}`" for name in schema.KINDS[kind].makers.split(" or "))
    yield f"## {kind.replace('_', ' ').capitalize()}"
    yield ""
    yield f"From {makers}."
    yield ""
    yield "| variable | dims | unit | meaning |"
    yield "|---|---|---|---|"
    for name, one in schema.KINDS[kind].variables.items():
        unit = {"": "text" if one.dtype == "str" else "", "1": ""}.get(one.units, one.units)
        yield (
            f"| `{name}` | {_cell(', '.join(one.dims))} | {_cell(unit)} | {_cell(one.long_name)} |"
        )


def _cell(text: str) -> str:
    """A text that neither ends a cell nor begins a tag."""
    return text.replace("<", "&lt;").replace("|", "\N{DIVIDES}")


class ResultTables(SphinxDirective):
    """Every table of results."""

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        return self.parse_text_to_nodes(markdown(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("result-tables", ResultTables)
    return {"parallel_read_safe": True}
