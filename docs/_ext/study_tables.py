"""The directive ``study-tables``: every table and key that a study file may hold, read off the
classes that check study files.
"""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from saltus.study.spec import Study, StudyTable
from saltus.study.tables.toml import toml

#: What the types of keys are called.
_WORDS = {int: "whole number", float: "number", str: "text", bool: "true or false"}
_UNIONS = (typing.Union, types.UnionType)


# -- tables ----------------------------------------------------------------------------------------
def tables(
    model: type[StudyTable] = Study, place: str = ""
) -> Iterator[tuple[str, type[StudyTable]]]:
    """(place such as ``[[basins.map]]``, class) of every table, the outer ones first; a table that
    has its place already isn't repeated.
    """
    for name, field in model.model_fields.items():
        path = f"{place}.{name}" if place else name
        for inner, one in _tables_in(field.annotation, path):
            if place and one.__doc__ and one.__doc__.startswith("[method]"):
                continue  # the methods are described once, under [method]
            yield inner, one
            yield from tables(one, path if "<" not in inner else inner.strip("[]"))


def _tables_in(
    annotation: Any, path: str, form: str = "[{}]"
) -> Iterator[tuple[str, type[StudyTable]]]:
    """The tables that a key may hold."""
    if isinstance(annotation, type) and issubclass(annotation, StudyTable):
        yield form.format(path), annotation
    elif typing.get_origin(annotation) in (list, tuple):
        yield from _tables_in(typing.get_args(annotation)[0], path, "[[{}]]")
    elif typing.get_origin(annotation) is dict:
        yield from _tables_in(typing.get_args(annotation)[1], f"{path}.<name>")
    else:
        for part in typing.get_args(annotation):
            yield from _tables_in(part, path, form)


# -- keys ------------------------------------------------------------------------------------------
def type_text(annotation: Any) -> str:
    """What a key may hold, in words."""
    origin, inside = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation is type(None):
        return ""
    if isinstance(annotation, type) and issubclass(annotation, StudyTable):
        return "table"
    if annotation in _WORDS:
        return _WORDS[annotation]
    if origin is typing.Literal:
        return " or ".join(f"`{toml(value)}`" for value in inside)
    if origin is typing.Annotated:
        return type_text(inside[0])
    if origin in (list, tuple):
        return f"list of {_listed(inside[0])}"
    if origin is dict:
        return f"table of {_listed(inside[1])}"
    if origin in _UNIONS:
        if {float, str} <= set(inside):  # what spec.py calls a Quantity
            inside = tuple(part for part in inside if part not in (float, str))
            return " or ".join(["quantity", *dict.fromkeys(filter(None, map(type_text, inside)))])
        return " or ".join(dict.fromkeys(filter(None, map(type_text, inside))))
    return "anything"


def _listed(annotation: Any) -> str:
    """The same, for many of it."""
    text = type_text(annotation)
    if " or " in text:
        return text
    first, _, rest = text.partition(" of ")
    many = {"quantity": "quantities", "anything": "anything"}.get(first, f"{first}s")
    return f"{many} of {rest}" if rest else many


def _default(field: FieldInfo) -> str:
    """What holds where a key isn't given."""
    if field.is_required():
        return "*needed*"
    if field.default is PydanticUndefined or field.default in (None, ""):
        return "-"
    return "-" if isinstance(field.default, StudyTable) else f"`{toml(field.default)}`"


def key_rows(model: type[StudyTable]) -> list[tuple[str, str, str, str]]:
    """(key, type, default, meaning with an example) of every key of a table."""
    rows = []
    for name, field in model.model_fields.items():
        text = _cell(field.description or "")
        if field.examples:
            text += f" Example: `{_cell(toml(field.examples[0]))}`"
        rows.append(
            (f"`{name}`", _cell(type_text(field.annotation)), _cell(_default(field)), text.strip())
        )
    if model.model_config.get("extra") == "allow":
        rows.append(("*any parameter*", "quantity", "-", 'Its value. Example: `force = "4 N"`'))
    return rows


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def markdown() -> str:
    """All tables as Markdown."""
    blocks = []
    for place, model in tables():
        rows = key_rows(model)
        named = model.model_fields["name"].annotation if "name" in model.model_fields else None
        title = (
            f"{place} name = {toml(typing.get_args(named)[0])}"
            if typing.get_origin(named) is typing.Literal
            else place
        )
        summary = (model.__doc__ or "").strip().split(": ", 1)[-1]
        body = [f"| {' | '.join(row)} |" for row in rows]
        blocks.append(
            "\n".join(
                [
                    f"### `{title}`",
                    "",
                    summary[:1].upper() + summary[1:],
                    "",
                    "| key | holds | default | meaning |",
                    "|---|---|---|---|",
                    *body,
                ]
            )
        )
    return "\n\n".join(blocks) + "\n"


# -- Sphinx ----------------------------------------------------------------------------------------
class StudyTables(SphinxDirective):
    """Every table of a study file."""

    def run(self) -> list[nodes.Node]:
        """See docutils."""
        return self.parse_text_to_nodes(markdown(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """What Sphinx calls."""
    app.add_directive("study-tables", StudyTables)
    return {"parallel_read_safe": True}
