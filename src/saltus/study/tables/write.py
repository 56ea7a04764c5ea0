"""Tables of a study file written as TOML text, so that reading gives them back: the same keys in
the same order, every number to its last bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from saltus.errors import StudyError, shown
from saltus.fence import has_control
from saltus.study.tables.parts import Quantity
from saltus.study.tables.toml import toml
from saltus.units import from_si

#: Longest line [characters] on which a table stands in braces; longer ones have a heading.
LINE = 100


def with_unit(value: float, unit: str) -> Quantity:
    """A number in SI as a study file writes it: ``0.0004, "m"`` gives ``"0.4 mm"``, and a number
    without dimension stays one. All its digits are kept.
    """
    return float(value) if unit in ("", "1") else from_si(float(value), unit, None)


def with_units(values: Mapping[str, float], units: Mapping[str, str]) -> dict[str, Quantity]:
    """Numbers in SI by name, as a study file writes them."""
    return {name: with_unit(value, units.get(name, "")) for name, value in values.items()}


def write(tables: Mapping[str, Any]) -> str:
    """Tables as TOML text.

    Parameters
    ----------
    tables : mapping of str to table
        As a study file holds them, such as ``{"study": {"name": "Rig"}, "system": {"model":
        "delangre", "force": "4 N"}}``: texts, numbers, booleans, lists and mappings of these.
        What is None is left out.

    Returns
    -------
    str
        ``tomllib.loads`` gives the tables back, and :func:`saltus.study.read.parse` the study.

    Raises
    ------
    StudyError
        If something else stands in them, or a text holds a control character.
    """
    lines = list(_table((), _plain(tables, "")))
    return "\n".join(lines).strip("\n") + "\n"


def _plain(value: Any, place: str) -> Any:
    """The value of plain types, without what is None."""
    if isinstance(value, Mapping):
        return {
            _text(name, place): _plain(one, f"{place}.{name}".strip("."))
            for name, one in value.items()
            if one is not None
        }
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(one, place) for one in value]
    if isinstance(value, bool | int | float):
        return value
    if isinstance(value, str):
        return _text(value, place)
    raise StudyError(
        f"[{place}] a study file holds texts, numbers, lists and tables, not {shown(value)}."
    )


def _text(value: Any, place: str) -> str:
    if not isinstance(value, str) or has_control(value) or not _is_unicode(value):
        raise StudyError(f"[{place}] must be plain text, not {shown(value)}.")
    return value


def _is_unicode(value: str) -> bool:
    """True for a text that a file in UTF-8 can hold."""
    return not any("\ud800" <= one <= "\udfff" for one in value)


def _table(path: tuple[str, ...], table: dict[str, Any]) -> Iterator[str]:
    """The lines of a table below its heading. Keys stay in order: a heading ends the table that it
    stands in, so it is for tables behind the last line of that one.
    """
    names = list(table)
    headed = len(names)
    while headed and _may_have_heading(table[names[headed - 1]]):
        headed -= 1
    while headed < len(names) and path and _fits(names[headed], table[names[headed]]):
        headed += 1
    for name in names[:headed]:
        yield from _line(name, table[name])
    for name in names[headed:]:
        inner, value = (*path, name), table[name]
        title = ".".join(map(_key, inner))
        for one in value if isinstance(value, list) else [value]:
            lines = list(_table(inner, one))
            if isinstance(value, list):
                yield from ("", f"[[{title}]]")
            elif not lines or lines[0]:  # a heading below it makes it too
                yield from ("", f"[{title}]")
            yield from lines


def _may_have_heading(value: Any) -> bool:
    tables = value if isinstance(value, list) else [value]
    return bool(tables) and all(isinstance(one, dict) for one in tables)


def _fits(name: str, value: Any) -> bool:
    """True for a table that is short enough for a line, and holds no other table."""
    if not isinstance(value, dict) or any(isinstance(one, dict) for one in value.values()):
        return False
    return len(f"{_key(name)} = {toml(value)}") <= LINE


def _line(name: str, value: Any) -> Iterator[str]:
    """A key and its value: on one line, but for a long list."""
    line = f"{_key(name)} = {toml(value)}"
    if len(line) <= LINE or not isinstance(value, list):
        yield line
        return
    yield f"{_key(name)} = ["
    row = "   "
    for one in value:
        item = f" {toml(one)},"
        if len(row) + len(item) > LINE and row.strip():
            yield row
            row = "   "
        row += item
    yield row
    yield "]"


def _key(name: str) -> str:
    """A key, in quotes where it must be."""
    return toml({name: 0})[2:-6]
