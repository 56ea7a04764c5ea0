"""Statements that were translated before: the same instructions again, with other operands.

A head is a long list of lines of few shapes, such as ``s12 = fma(s3, s4, s11)``. One of each shape
goes through Python's parser and through expression_ir.py; of the others only the operands are
read.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from saltus.codegen.blocks import Line
from saltus.codegen.expression_ir import Value

#: Most shapes that are kept.
MAX_KNOWN = 20_000
#: The name that a statement assigns, in its shape.
TARGET = "assigned"

_SIMPLE = re.compile(r"(?:(\w+) = |store\(|\w+\[[^\]]*\] \+?= ).*")
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
_OPERAND = re.compile(r"\bo(\d+)_([a-z]+)\b")
_VALUE = re.compile(r"%r(\d+)\b")


class Shape(NamedTuple):
    """A statement without the numbers of its values: all that its instructions depend on.

    Attributes
    ----------
    text : str
        The statement with ``o0_lane``, ``o1_number``, ... for values in registers, numbered as
        they come, and :data:`TARGET` for the name that it assigns.
    fixed : tuple of (str, Value)
        Its other names, and what they mean.
    lanes, row : int
        See :class:`saltus.codegen.expression_ir.Expressions`.
    """

    text: str
    fixed: tuple[tuple[str, Value], ...]
    lanes: int
    row: int


class Recorded(NamedTuple):
    """The translation of a shape.

    Attributes
    ----------
    lines : tuple of Line
        Its instructions, with ``{i}`` for the number of the i-th value: first come the operands.
    value : Value, optional
        What the target is afterwards, with ``{i}`` likewise.
    declared : frozenset of str
        Declarations that it needs.
    """

    lines: tuple[Line, ...]
    value: Value | None
    declared: frozenset[str]


_KNOWN: dict[Shape, Recorded] = {}


def read(
    statement: str, names: Mapping[str, Value], lanes: int, row: int
) -> tuple[str | None, Shape, list[str]] | None:
    """The name that a statement assigns, its shape, and the numbers of its values in registers;
    None for a statement that isn't simple: of several lines, or no assignment.
    """
    simple = _SIMPLE.fullmatch(statement)
    if simple is None:
        return None
    numbers: list[str] = []
    fixed: list[tuple[str, Value]] = []
    meaning = names.get

    def replaced(found: re.Match[str]) -> str:
        name = found[0]
        value = meaning(name)
        if value is None:  # of an array or a function
            return name
        kind, text = value
        number = text[2:]
        if text[:2] == "%r" and number.isdigit():
            numbers.append(number)
            return f"o{len(numbers) - 1}_{kind}"
        fixed.append((name, value))
        return name

    target = simple[1]
    if target is None:
        text = _NAME.sub(replaced, statement)
    else:
        text = f"{TARGET} = {_NAME.sub(replaced, statement[len(target) + 3 :])}"
    return target, Shape(text, tuple(fixed), lanes, row), numbers


def recorded(
    shape: Shape,
    translated: Callable[[str, dict[str, Value], int], tuple[list[Line], Value | None, set[str]]],
) -> Recorded:
    """The translation of a shape, made now if it is new.

    Parameters
    ----------
    shape : Shape
        The statement's.
    translated : callable
        ``(text, names, count)`` to the lines of a statement, numbered from ``count`` on, to the
        value of the target and to declarations.
    """
    known = _KNOWN.get(shape)
    if known is None:
        operands = _OPERAND.findall(shape.text)
        names = {f"o{i}_{kind}": Value(kind, f"%r{i}") for i, kind in operands}
        meanings = names | dict(shape.fixed)
        lines, value, declared = translated(shape.text, meanings, len(operands))
        known = Recorded(
            tuple(line._replace(text=_open(line.text)) for line in lines),
            value and Value(value.kind, _open(value.text)),
            frozenset(declared),
        )
        if len(_KNOWN) >= MAX_KNOWN:
            _KNOWN.clear()
        _KNOWN[shape] = known
    return known


def _open(text: str) -> str:
    """A text with ``{i}`` for the number of a value."""
    return _VALUE.sub(r"%r{\1}", text.replace("{", "{{").replace("}", "}}"))


def lines_of(known: Recorded, numbers: list[str], first: int) -> tuple[list[Line], Value | None]:
    """The lines for the operands of these numbers, from number ``first`` on, and the value of the
    target.
    """
    places = [*numbers, *map(str, range(first, first + len(known.lines)))]
    count = len(numbers)
    lines = [
        Line(text.format(*places), name and f"%r{places[count + i]}", type_)
        for i, (text, name, type_) in enumerate(known.lines)
    ]
    value = known.value and Value(known.value.kind, known.value.text.format(*places))
    return lines, value
