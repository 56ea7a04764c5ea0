"""Split long straight-line functions into blocks: LLVM's time grows faster than the length of a
function.

A value that a later block needs goes through memory; the operations and their order are the same,
so not a digit changes.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from saltus.errors import TraceError

#: Most lines of a function that isn't split, and lines of a block.
WHOLE, LENGTH = 1000, 60
#: Most bytes of the stack for shared values of blocks: threads have 8 MB on Linux, and less
#: elsewhere.
MAX_STACK = 4_000_000

_VALUE = re.compile(r"%r\d+\b")


class Line(NamedTuple):
    """One line of IR; its value and the type of that, "" if it has none."""

    text: str
    name: str
    type: str


def in_blocks(
    name: str, result: str, parameters: str, attributes: str, lines: list[Line], lanes: int
) -> str:
    """The text of a function ``result name(parameters)`` with these lines, the last of which
    returns.

    One that branches stays whole: a block could leave itself only, not the function.
    """
    head = f"{result} @{name}({parameters}) {attributes} {{\n"
    if (
        len(lines) <= WHOLE
        or result != "void"
        or any(line.text.startswith("br ") for line in lines)
    ):
        return f"define {head}" + "".join(f"  {line.text}\n" for line in lines) + "}\n"
    blocks = [lines[i : i + LENGTH] for i in range(0, len(lines), LENGTH)]
    slots = _slots(blocks)
    texts, calls = [], []
    plain = re.sub(r"\S+ (%\w+)", r"\1", parameters)
    for i, block in enumerate(blocks):
        body = _one_block(block, i, slots, lanes, last=i == len(blocks) - 1)
        texts.append(
            f"define internal void @{name}.{i}({parameters}, ptr %kept) noinline "
            f"{attributes} {{\n{body}}}\n"
        )
        given = ", ".join(
            f"{kind} {value}"
            for kind, value in zip(_kinds(parameters), plain.split(", "), strict=True)
        )
        calls.append(f"  call void @{name}.{i}({given}, ptr %kept)\n")
    places = sum(slot.width for slot in slots.values())
    if 8 * places * lanes > MAX_STACK:
        raise TraceError(
            f"the equation is too long to be compiled: {len(lines)} operations, whose values take "
            f"{8e-6 * places * lanes:.1f} MB of the "
            f"stack; at most {MAX_STACK / 1e6:.0f} MB are used. Couple fewer states, or take a "
            f"lower order or fewer lanes, such as "
            "sl.Taylor(12, lanes=4)."
        )
    memory = f"  %kept = alloca [{max(places, 1) * lanes} x double], align 64\n"
    return "\n".join(texts) + f"define {head}" + memory + "".join(calls) + "  ret void\n}\n"


def _kinds(parameters: str) -> list[str]:
    return [one.split()[0] for one in parameters.split(", ")]


class _Slot(NamedTuple):
    """Memory of a value: its index, its type, the block that computes it."""

    place: int
    type: str
    block: int

    @property
    def width(self) -> int:
        """Slots of the value: two for a pair of vectors, as of sine and cosine."""
        return max(self.type.count("double"), 1)


def _slots(blocks: list[list[Line]]) -> dict[str, _Slot]:
    """Slots of the values that another block than their own uses."""
    home = {
        line.name: (i, line.type) for i, block in enumerate(blocks) for line in block if line.name
    }
    slots: dict[str, _Slot] = {}
    place = 0
    for i, block in enumerate(blocks):
        for line in block:
            for used in _VALUE.findall(line.text):
                if home[used][0] != i and used not in slots:
                    slots[used] = _Slot(place, home[used][1], home[used][0])
                    place += slots[used].width
    return slots


def _one_block(block: list[Line], i: int, slots: dict[str, _Slot], lanes: int, last: bool) -> str:
    """The lines of a block: values of other blocks are loaded at their first use, values that
    others use are stored.
    """
    out, here = [], set()
    for line in block:
        for used in _VALUE.findall(line.text):
            if used in slots and slots[used].block != i and used not in here:
                here.add(used)
                out += _load(used, slots[used], lanes)
        out.append(line.text)
        if line.name in slots:
            out += _store(line.name, slots[line.name], lanes)
    if not last:
        out.append("ret void")
    return "".join(f"  {line}\n" for line in out)


def _load(name: str, slot: _Slot, lanes: int) -> list[str]:
    place = f"%at{name[2:]}"
    return [_address(place, slot, lanes), f"{name} = load {slot.type}, ptr {place}, align 8"]


def _store(name: str, slot: _Slot, lanes: int) -> list[str]:
    place = f"%to{name[2:]}"
    return [_address(place, slot, lanes), f"store {slot.type} {name}, ptr {place}, align 8"]


def _address(place: str, slot: _Slot, lanes: int) -> str:
    return f"{place} = getelementptr i8, ptr %kept, i64 {8 * lanes * slot.place}"
