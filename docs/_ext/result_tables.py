"""The directive ``result-tables``: every variable of every result, read off the tables that results are made and checked by."""

from __future__ import annotations

from collections.abc import Iterator

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from saltus.results.dataset import schema
from saltus.results.dataset.variable import Variable

#: What stands in a batch or a map before the dims of one trajectory, by kind of result.
_BATCHES = (schema.TRAJECTORY, schema.STROBOSCOPE, schema.SECTION, schema.SPECTRUM, schema.IMPACTS, schema.ENERGY)
#: What a result holds beside its table, by kind.
_BESIDE = {
    schema.TRAJECTORY: "Each state under its own name along `time`, at the contacts as `contact_<state>`, at the end as `end_<state>`.",
    schema.STROBOSCOPE: "Each state under its own name along `period`.",
    schema.SECTION: "Each state under its own name along `crossing`.",
    schema.BASINS: "The two states of the map as dims, and the points of the attractors as `attractor_<state>` (attractor, phase).",
    schema.ATTRACTORS: "The starts as `start_<state>`, and the points of the attractors as `attractor_<state>` (attractor, phase).",
    schema.RESPONSES: "The parameters as dims, of each response as `response_<parameter>`; its points as `response_<state>` (response, "
    "phase); a diagram's sampled values as `sample_<state>` (response, sample). What has no dim below has those of the parameters and "
    "`start`.",
    schema.SPECTRUM: "`<state>_amplitude` and `<state>_phase` of each state along `frequency`.",
    schema.AGREEMENT: "The two states of the maps as dims.",
}


def markdown() -> str:
    """A section for each kind of result."""
    return "\n\n".join("\n".join(_section(kind, table)) for kind, table in schema.TABLES.items()) + "\n"


def _section(kind: str, table: dict[str, Variable]) -> Iterator[str]:
    makers = " and ".join(f"`sl.{name}`" for name in schema.MAKERS[kind].split(" or "))
    yield f"## {kind.replace('_', ' ').capitalize()}"
    yield ""
    yield " ".join(filter(None, [f"From {makers}.", _BESIDE.get(kind, ""), _batch(kind)]))
    yield ""
    yield "| variable | dims | unit | meaning |"
    yield "|---|---|---|---|"
    for name, one in table.items():
        unit = {"": "text" if one.dtype == "str" else "", "1": ""}.get(one.units, one.units)
        yield f"| `{name}` | {', '.join(one.dims)} | {_cell(unit)} | {_cell(one.long_name)} |"


def _cell(text: str) -> str:
    """A text that neither ends a cell nor begins a tag."""
    return text.replace("<", "&lt;").replace("|", "\N{DIVIDES}")


def _batch(kind: str) -> str:
    return "A batch adds the dim `trajectory` in front." if kind in _BATCHES else ""


class ResultTables(SphinxDirective):
    """Every table of results."""

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        return self.parse_text_to_nodes(markdown(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("result-tables", ResultTables)
    return {"parallel_read_safe": True}
