"""Messages on errors in a study file: the place, the fault, and what to write instead."""

from __future__ import annotations

import re
from collections.abc import Iterator
from tomllib import TOMLDecodeError
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import ValidationError

from saltus.errors import closest, nearest, shown
from saltus.study.spec import QUESTIONS, Study
from saltus.study.tables.methods import METHODS
from saltus.study.tables.parts import StudyTable
from saltus.study.tables.toml import cut, toml

#: Keys and indices on the way from the study to a value.
Place = tuple[int | str, ...]
#: Parts of a place that name the branch of a union, not a key.
_BRANCHES = re.compile(r"float|str|(list|dict)\[.*\]|function-.*")
_BARE_QUANTITY = re.compile(
    r"\s*([\w.-]+)\s*=\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?\s*[A-Za-zµ][^#\"']*?)\s*(?:#.*)?"
)
_EXPECTED = {
    "int_type": "a whole number",
    "float_type": "a number",
    "string_type": "text in quotes",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
}


_SWEPT = (
    'Write [frequency_response] with frequency = { first = "2 Hz", last = "30 Hz", count = 281 }.'
)
_DRAWN = (
    'Write [scatter] with uncertain.gap = { normal = ["1 mm", "0.1 mm"] }. '
    'Lists are a batch, one value for each trajectory: [simulate] with values = { gap = ["1 mm", '
    '"1.1 mm"] }. In Python: sl.simulate(..., values={"gap": array}).'
)
#: Tables that people write, and what is written here.
_ELSEWHERE = {
    **dict.fromkeys(
        ("monte_carlo", "montecarlo", "sensitivity", "ensemble", "sampling", "parameters_sweep"),
        _DRAWN,
    ),
    **dict.fromkeys(
        ("identification", "calibration", "least_squares", "regression"),
        'Write [fit] with measured = "measured.csv" and free.gap = ["0.1 mm", "2 mm"].',
    ),
    **dict.fromkeys(
        ("continuation", "arclength"), 'Write [branches] with vary.gap = ["1 mm", "2 mm"].'
    ),
    **dict.fromkeys(("sweep", "frf", "resonance"), _SWEPT),
    **dict.fromkeys(("solver", "integrator"), 'Write [method] with name = "Taylor".'),
    **dict.fromkeys(
        ("parameters", "values", "model", "equations"),
        "Write [system]: its keys are the parameters.",
    ),
    **dict.fromkeys(
        ("events", "contacts"),
        "Contacts are comparisons in the rates of [system]; [poincare] records other crossings.",
    ),
    **dict.fromkeys(
        ("plot", "pictures", "output"),
        "Pictures and tables are made of every question; saltus plot draws others.",
    ),
    "units": 'Write [system.units], such as x = "m".',
}


def _instead(place: Place) -> str:
    """Suggest what to write for a key or a table that doesn't exist."""
    key, known = str(place[-1]), list(_known(place[:-1]))
    if len(place) == 1 and key in _ELSEWHERE:
        return _ELSEWHERE[key]
    there = [name for name, table in QUESTIONS.items() if key in table.model_fields]
    question = QUESTIONS.get(str(place[0]))
    if (
        there
        and question is not None
        and _table(place[:-1]) is question
        and not closest(key, known, 0.7)
    ):
        return f"It is a key of {', '.join(f'[{name}]' for name in there)}."
    return nearest(key, known)


def syntax_fault(error: TOMLDecodeError, text: str) -> str:
    """Sentence on text that isn't TOML: the line, and the correction if the fault is a common
    one.
    """
    place = re.search(r"line (\d+)", str(error))
    number = int(place[1]) if place else text.rstrip().count("\n") + 1
    lines = text.split("\n")
    line = lines[min(number, len(lines)) - 1].strip()
    if re.match(r"Cannot (overwrite|declare|mutate)|Duplicate", str(error)):
        return (
            f"line {number}: {shown(line)} gives again what stands in the file already. Keep one "
            f"of the two."
        )
    quantity = _BARE_QUANTITY.fullmatch(line)
    if quantity:
        return f'line {number}: {shown(line)} needs quotes. Write {quantity[1]} = "{quantity[2]}".'
    return f"line {number}: {shown(line)} isn't TOML: {str(error).split(' (at')[0]}."


def content_faults(error: ValidationError, data: Any = None) -> list[str]:
    """Sentences on the faults of a TOML file that isn't a study; ``data`` is its content."""
    faults: dict[Place, list[dict[str, Any]]] = {}
    for detail in error.errors():
        place = tuple(
            part
            for part in detail["loc"]
            if not (isinstance(part, str) and _BRANCHES.fullmatch(part))
        )
        faults.setdefault(place, []).append(dict(detail))
    return [_fault(place, details, data) for place, details in faults.items()]


def _path(place: Place, data: Any) -> list[str]:
    """Place in words. Tables of an array are counted from 1, ``lyapunov 2``; a single table has no
    number.
    """
    path: list[str] = []
    for part in place:
        if isinstance(part, int):
            if isinstance(data, list) and path:
                path[-1] += f" {part + 1}"
                data = data[part] if part < len(data) else None
        elif part not in METHODS:
            path.append(str(part))
            data = data.get(part) if isinstance(data, dict) else None
    return path


def _fault(place: Place, details: list[dict[str, Any]], data: Any) -> str:
    first, kind = details[0], details[0]["type"]
    path = _path(place, data)
    *tables, key = path or [""]
    where = f"[{'.'.join(tables)}] " if tables else ""
    if kind == "extra_forbidden":
        return (
            f"{where or 'the file '}has no {'key' if tables else 'table'} {key!r}. "
            f"{_instead(place)}"
        )
    if kind == "missing":
        return (
            f"{where}needs {key!r}." + _example(place)
            if tables
            else (f"a table [{key}] is missing.")
        )
    if kind == "union_tag_invalid":
        given = str(first["ctx"]["tag"])
        alike = [name for name in METHODS if name.lower() == given.lower()]
        return (
            f"[{'.'.join(path)}] name = {cut(given)} is no method. "
            f"{nearest(alike[0] if alike else given, METHODS)}"
        )
    if kind == "union_tag_not_found":
        names = " or ".join(f'name = "{name}"' for name in METHODS)
        return f"[{'.'.join(path)}] needs 'name'. Write {names}."
    if kind == "value_error":
        return (
            f"[{'.'.join(path)}] {first['ctx']['error']}." if path else f"{first['ctx']['error']}."
        )
    if len(details) > 1:
        finite = any(detail["type"] == "finite_number" for detail in details)
        expected = (
            "a finite number"
            if finite
            else ('a plain number, or text with a unit, such as "0.4 mm"')
        )
    elif kind in ("too_short", "too_long"):
        return (
            f"{where}{key} = {cut(first['input'])} must have "
            f"{first['msg'].split('have ')[1].split(' after')[0]}."
        ) + _example(place)
    elif kind == "list_type" and len(place) == 1:
        expected = "a table"
    else:
        expected = _EXPECTED.get(kind, first["msg"].removeprefix("Input should be "))
    return f"{where}{key} = {cut(first['input'])} must be {expected}." + _example(place)


def _table(place: Place) -> type[StudyTable] | None:
    """The class of the table at a place in a study."""
    inside: Any = Study
    for part in place:
        inside = METHODS.get(str(part)) or _inside(inside, part)
    return next((one for one in _parts(inside) if _is_table(one)), None)


def _inside(kind: Any, part: int | str) -> Any:
    """Type of the value at a key or an index of a table, list or mapping; None if there is none."""
    for branch in _parts(kind):
        if _is_table(branch):
            field = branch.model_fields.get(str(part))
            return field.annotation if field is not None else None
        if get_origin(branch) in (list, dict):
            return get_args(branch)[-1]
    return None


def _parts(kind: Any) -> Iterator[Any]:
    """Members of a union type, or the type itself."""
    if get_origin(kind) is Annotated:
        yield from _parts(get_args(kind)[0])
    elif get_origin(kind) in (Union, UnionType):
        for one in get_args(kind):
            yield from _parts(one)
    else:
        yield kind


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, StudyTable)


def _known(place: Place) -> Iterator[str]:
    table = _table(place)
    yield from table.model_fields if table else ()


def _example(place: Place) -> str:
    table = _table(place[:-1])
    field = table.model_fields.get(str(place[-1])) if table else None
    return (
        f" For example: {place[-1]} = {toml(field.examples[0])}"
        if field is not None and field.examples
        else ""
    )
