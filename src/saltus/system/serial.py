"""Systems as plain data, and their fingerprint. Data, not code: reading it runs nothing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError, among, shown
from saltus.system.clocks import affine, switch
from saltus.system.expression import (
    ELEMENTARY,
    And,
    Bit,
    Condition,
    Expr,
    Not,
    Or,
    Relation,
    constant,
    varies,
    walk,
)
from saltus.system.guards import Guard, Law, bits_in
from saltus.system.names import why_no_name, why_no_text, why_no_title, why_not_together
from saltus.system.tables import Table
from saltus.units import check_declared

if TYPE_CHECKING:
    from saltus.system.system import System

#: Changes whenever the meaning of the data does.
FORMAT = "saltus-system/1"

_OPERANDS = {
    "const": 0,
    "param": 0,
    "state": 0,
    "time": 0,
    "add": 2,
    "sub": 2,
    "mul": 2,
    "div": 2,
    "neg": 1,
    "pow": 2,
    "select": 2,
}
_LAW_FIELDS = tuple(Law.__dataclass_fields__)
_LAW_KINDS = ("impact", "jump", "surface", "hold")
_OPERANDS |= {"mod": 2, "table": 1}
_OPERANDS |= dict.fromkeys(ELEMENTARY, 1)


def to_dict(system: System) -> dict[str, Any]:
    """A system as JSON-able data; floats are exact."""
    return {
        "format": FORMAT,
        "name": system.name,
        "description": system.description,
        "source": system.source,
        "values": dict(system.values),
        "units": dict(system.units),
        **_equations(system),
    }


def _equations(system: System) -> dict[str, Any]:
    """The part that the generated code depends on."""
    roots = [*system.field]
    for guard in system.guards:
        roots += [guard.gap] if guard.boundary is None else [guard.gap, guard.boundary]
        roots += guard.law.expressions if guard.law else ()
    index: dict[Expr, int] = {}
    nodes = []
    for node in walk(*roots):
        index[node] = len(index)
        payload = _condition_data(node.payload, index) if node.op == "select" else node.payload
        if isinstance(payload, Table):
            payload = payload.to_data()
        nodes.append([node.op, [index[child] for child in node.args], payload])
    laws = [_law_data(guard.law, index) if guard.law else None for guard in system.guards]
    return ({"laws": laws} if any(laws) else {}) | {
        "states": list(system.states),
        "parameters": list(system.values),
        "forced_at": system.forced_at,
        "nodes": nodes,
        "field": [index[root] for root in system.field],
        "guards": [
            [
                guard.name,
                index[guard.gap],
                guard.state,
                None if guard.boundary is None else index[guard.boundary],
            ]
            for guard in system.guards
        ],
    }


def _law_data(law: Law, index: Mapping[Expr, int]) -> dict[str, Any]:
    """A law, its expressions by the numbers of their nodes."""
    data: dict[str, Any] = {}
    for name in _LAW_FIELDS:
        value = getattr(law, name)
        if isinstance(value, Expr):
            value = {"node": index[value]}
        elif isinstance(value, tuple):
            value = [index[one] for one in value]
        data[name] = value
    return data


def fingerprint(system: System) -> str:
    """SHA-256 of the equations: field, guards, names of states and parameters, and what sets the
    period. Not of values, name or source.
    """
    data = {"format": FORMAT, **_equations(system)}
    data["forced_at_unit"] = system.units[system.forced_at] if system.forced_at else None
    data["nodes"] = [
        [op, args, payload.hex() if isinstance(payload, float) else payload]
        for op, args, payload in data["nodes"]
    ]
    return hashlib.sha256(
        json.dumps(data, sort_keys=True, separators=(",", ":")).encode()
    ).hexdigest()


def _condition_data(condition: Condition, index: Mapping[Expr, int]) -> list[Any]:
    match condition:
        case Bit(guard):
            return ["bit", guard]
        case Relation(gap):
            return ["switch", index[gap]]
        case Not(inner):
            return ["not", _condition_data(inner, index)]
        case And(left, right):
            return ["and", _condition_data(left, index), _condition_data(right, index)]
        case Or(left, right):
            return ["or", _condition_data(left, index), _condition_data(right, index)]
    raise TypeError(condition)


# -- reading ---------------------------------------------------------------------------------------
def arguments(data: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of System from :func:`to_dict`'s data.

    Raises
    ------
    SaltusError
        If the data isn't a system of this format: every node, name and number is checked, because
        code is generated from it.
    """
    if not isinstance(data, Mapping) or not among(data.get("format"), (FORMAT,)):
        found = data.get("format") if isinstance(data, Mapping) else type(data).__name__
        raise SaltusError(
            f"this isn't a system written by this version of saltus (format {shown(found)}, "
            f"expected {FORMAT!r}). Trace it again."
        )
    try:
        return _read(data)
    except (
        KeyError,
        IndexError,
        TypeError,
        ValueError,
        AttributeError,
        ArithmeticError,
        RecursionError,
    ) as error:
        why = " ".join(str(error).split())[:300]
        raise SaltusError(
            f"the data of a system is damaged ({type(error).__name__}: {why}). Trace "
            f"the system again."
        ) from error


def _read(data: Mapping[str, Any]) -> dict[str, Any]:
    states, parameters = tuple(data["states"]), list(data["parameters"])
    for name in (*states, *parameters):
        _require(why_no_name(name) is None, f"{shown(name)} is no name: {why_no_name(name)}")
    _require(
        why_no_title(data["name"]) is None,
        f"{shown(data['name'])} is no name of a system: {why_no_title(data['name'])}",
    )
    for name in ("description", "source"):
        _require(
            why_no_text(data[name]) is None, f"its {name} can't be used: {why_no_text(data[name])}"
        )
    _require(
        why_not_together(states) is None,
        f"its states have ambiguous names: {why_not_together(states)}",
    )
    _require(len({*states, *parameters}) == len(states) + len(parameters), "a name stands twice")
    names = {"state": set(states), "param": set(parameters)}
    nodes: list[Expr] = []
    for op, args, payload in data["nodes"]:
        _require(
            len(args) == _OPERANDS[op] and all(0 <= i < len(nodes) for i in args),
            f"wrong operands of {op!r}",
        )
        nodes.append(_node(op, tuple(nodes[i] for i in args), payload, names, nodes))
    places = [
        *data["field"],
        *(gap for _, gap, _, _ in data["guards"]),
        *(level for *_, level in data["guards"] if level is not None),
    ]
    _require(
        all(0 <= place < len(nodes) for place in places),
        "a derivative or a boundary stands in no node",
    )
    laws = [
        None if law is None else _law(law, nodes, len(states), len(data["guards"]))
        for law in data.get("laws", [None] * len(data["guards"]))
    ]
    guards = tuple(
        Guard(name, nodes[gap], state, None if boundary is None else nodes[boundary], law)
        for (name, gap, state, boundary), law in zip(data["guards"], laws, strict=True)
    )
    field = tuple(nodes[i] for i in data["field"])
    _require(len(field) == len(states), "the number of derivatives and of states differ")
    for guard in guards:
        _require(
            why_no_text(guard.name) is None,
            f"{shown(guard.name)} is no name of a boundary: {why_no_text(guard.name)}",
        )
    _require(
        all(guard.state is None or guard.state in states for guard in guards),
        "a guard names an unknown state",
    )
    for number, guard in enumerate(guards):
        held = bool(guard.law and guard.law.kind == "hold")
        known = set(range(len(guards) if held else number))
        _require(bits_in([guard.gap]) <= known, "a gap depends on a later guard")
        if guard.law:
            bits = bits_in(guard.law.expressions)
            _require(bits <= set(range(len(guards))), "a law names an unknown guard")
    _require(bits_in(field) <= set(range(len(guards))), "a condition names an unknown guard")
    _require(
        data["forced_at"] is None or data["forced_at"] in parameters, "forced_at is no parameter"
    )
    return {
        "name": data["name"],
        "description": data["description"],
        "source": data["source"],
        "states": states,
        "values": {name: float(data["values"][name]) for name in parameters},
        "units": {
            name: check_declared(data["units"][name], name) for name in (*states, *parameters)
        },
        "forced_at": data["forced_at"],
        "field": field,
        "guards": guards,
    }


def _law(data: Mapping[str, Any], nodes: Sequence[Expr], states: int, guards: int) -> Law:
    values: dict[str, Any] = {}
    for name in _LAW_FIELDS:
        value = data[name]
        if isinstance(value, Mapping):
            value = nodes[_place(value["node"], nodes)]
        elif isinstance(value, list):
            _require(len(value) in (0, states), "a law has another number of states")
            value = tuple(nodes[_place(one, nodes)] for one in value)
        elif name in ("side", "partner", "zeros"):
            known = isinstance(value, int) and -1 <= value < max(guards, 4)
            _require(known, "a law names an unknown guard")
        values[name] = value
    _require(values["kind"] in _LAW_KINDS, f"unknown law {shown(values['kind'])}")
    return Law(**values)


def _place(number: Any, nodes: Sequence[Expr]) -> int:
    _require(isinstance(number, int) and 0 <= number < len(nodes), "a law stands in no node")
    return int(number)


def _node(
    op: str,
    args: tuple[Expr, ...],
    payload: Any,
    names: Mapping[str, set[str]],
    nodes: Sequence[Expr],
) -> Expr:
    if op == "const":
        return constant(payload)
    if op in names:
        _require(payload in names[op], f"unknown {op} {shown(payload)}")
        return Expr(op, args, str(payload))
    if op == "select":
        return Expr(op, args, _condition(payload, nodes))
    if op == "table":
        _require(affine(args[0]) is not None, "a table is not of time")
        return Expr(op, args, Table.from_data(payload))
    if op == "mod":
        _require(affine(args[0]) is not None and not varies(args[1]), "a remainder is not of time")
    return Expr(op, args)


def _condition(data: Sequence[Any], nodes: Sequence[Expr]) -> Condition:
    kind, *parts = data
    if kind == "bit" and len(parts) == 1 and isinstance(parts[0], int) and parts[0] >= 0:
        return Bit(parts[0])
    if (
        kind == "switch"
        and len(parts) == 1
        and isinstance(parts[0], int)
        and 0 <= parts[0] < len(nodes)
    ):
        condition = switch(nodes[parts[0]])
        if isinstance(condition, Relation):
            return condition
    inner = [_condition(part, nodes) for part in parts] if kind in ("not", "and", "or") else []
    if kind == "not" and len(inner) == 1:
        return Not(inner[0])
    if kind in ("and", "or") and len(inner) == 2:
        return (And if kind == "and" else Or)(*inner)
    raise ValueError(f"unknown condition {shown(kind)}")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(what)
