"""Systems as plain data, and their fingerprint. Data, not code: reading it runs nothing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from saltus.contact.guards import Guard, Law, bits_in, expressions_of, is_hold
from saltus.errors import SaltusError, among, shown
from saltus.language.clocks import affine, switch
from saltus.language.expression import (
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
from saltus.language.names import (
    why_no_name,
    why_no_output,
    why_no_text,
    why_no_title,
    why_not_together,
)
from saltus.language.operations import ARITHMETIC, FUNCTIONS
from saltus.language.tables import Table
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.named_outputs import NO_OUTPUTS, NamedOutputs
from saltus.units import check_declared

#: Version of the data's meaning, for systems without a law of contact.
FORMAT = "saltus-system/1"
#: Version for systems with a law of contact.
WITH_LAWS = "saltus-system/2"
#: Bound of the numbers of guards in conditions, well above those that any system has.
MOST_BITS = 1000
#: Entries of a law's data by content: tuples of expressions, single expressions or None, others.
_TUPLES = ("reset", "settled", "normal", "direction")
_SINGLE = ("constraint", "drive", "pivot", "limit", "restitution", "friction", "remaining", "mass")
_PLAIN = ("kind", "side", "partner", "zeros")

_OPERANDS = {"const": 0, "param": 0, "state": 0, "time": 0, "select": 2, "mod": 2, "table": 1}
_OPERANDS |= {name: one.operands for name, one in (ARITHMETIC | FUNCTIONS).items() if one.operands}


def to_dict(system: EquationsOfMotion) -> dict[str, Any]:
    """A system as JSON-able data; floats are exact."""
    return {
        "format": _format(system),
        "name": system.name,
        "description": system.description,
        "source": system.source,
        "values": dict(system.values),
        "units": dict(system.units),
        **({"made": system.made} if system.made else {}),
        **({"outputs": _outputs_data(system.outputs)} if len(system.outputs) else {}),
        **_equations(system),
    }


def _outputs_data(outputs: NamedOutputs) -> dict[str, Any]:
    """The outputs, which the generated code doesn't depend on."""
    nodes, index = _nodes([*outputs.formulas, *_boundaries(outputs.guards)])
    return {
        "names": list(outputs.names),
        "units": list(outputs.units),
        "first": outputs.first,
        "nodes": nodes,
        "formulas": [index[one] for one in outputs.formulas],
        "guards": [_guard_data(guard, index) for guard in outputs.guards],
    }


def _boundaries(guards: Iterable[Guard]) -> list[Expr]:
    """The gaps of guards, and the levels of states that some of them are."""
    found = []
    for guard in guards:
        found += [guard.gap] if guard.boundary is None else [guard.gap, guard.boundary]
    return found


def _nodes(roots: Iterable[Expr]) -> tuple[list[Any], dict[Expr, int]]:
    """The nodes below the roots as data, and the number of each."""
    index: dict[Expr, int] = {}
    nodes = []
    for node in walk(*roots):
        index[node] = len(index)
        payload = _condition_data(node.payload, index) if node.op == "select" else node.payload
        if isinstance(payload, Table):
            payload = payload.to_data()
        nodes.append([node.op, [index[child] for child in node.args], payload])
    return nodes, index


def _guard_data(guard: Guard, index: Mapping[Expr, int]) -> list[Any]:
    return [
        guard.name,
        index[guard.gap],
        guard.state,
        None if guard.boundary is None else index[guard.boundary],
        *([_law_data(guard.law, index)] if guard.law else []),
    ]


def _format(system: EquationsOfMotion) -> str:
    return WITH_LAWS if any(guard.law for guard in system.guards) else FORMAT


def _equations(system: EquationsOfMotion) -> dict[str, Any]:
    """The part that the generated code depends on."""
    roots = [*system.field, *_boundaries(system.guards)]
    for guard in system.guards:
        roots += guard.law.expressions() if guard.law else ()
    nodes, index = _nodes(roots)
    return {
        "states": list(system.states),
        "parameters": list(system.values),
        "forced_at": system.forced_at,
        "nodes": nodes,
        "field": [index[root] for root in system.field],
        "guards": [_guard_data(guard, index) for guard in system.guards],
    }


def _law_data(law: Law, index: Mapping[Expr, int]) -> dict[str, Any]:
    """The entries of a law that hold anything; expressions by their numbers."""
    data = {name: getattr(law, name) for name in _PLAIN}
    if law.support >= 0:
        data["support"] = law.support
    if law.levels:
        data["levels"] = [index[one] for one in law.levels]
    data |= {name: [index[one] for one in getattr(law, name)] for name in _TUPLES}
    single = {name: getattr(law, name) for name in _SINGLE}
    return data | {name: index[one] for name, one in single.items() if one is not None}


def fingerprint(system: EquationsOfMotion) -> str:
    """SHA-256 of the equations: field, guards, names of states and parameters, and the source of
    the period. Values, name and source don't count.
    """
    data = {"format": _format(system), **_equations(system)}
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
    if not isinstance(data, Mapping) or not among(data.get("format"), (FORMAT, WITH_LAWS)):
        found = data.get("format") if isinstance(data, Mapping) else type(data).__name__
        raise SaltusError(
            f"this isn't a system written by this version of saltus (format {shown(found)}, "
            f"expected {FORMAT!r} or {WITH_LAWS!r}). Trace it again."
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
    nodes = _read_nodes(data["nodes"], names)
    places = [
        *data["field"],
        *(guard[1] for guard in data["guards"]),
        *(guard[3] for guard in data["guards"] if guard[3] is not None),
    ]
    _require(
        all(0 <= place < len(nodes) for place in places),
        "a derivative or a boundary stands in no node",
    )
    guards = tuple(
        Guard(
            name,
            nodes[gap],
            state,
            None if boundary is None else nodes[boundary],
            _law(*law, nodes=nodes, states=len(states), guards=len(data["guards"])),
        )
        for name, gap, state, boundary, *law in data["guards"]
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
    holds = {number for number, guard in enumerate(guards) if is_hold(guard)}
    for number, guard in enumerate(guards):
        if number not in holds:
            known = set(range(number)) | holds
            _require(bits_in([guard.gap]) <= known, "a gap depends on a later guard")
        if guard.law is not None and guard.law.partner >= 0:
            partner = guards[guard.law.partner].law
            _require(
                partner is not None
                and partner.partner == number
                and (partner.kind == "hold") != (number in holds),
                "a hold guard and its owner don't name each other",
            )
    _require(
        bits_in([*field, *expressions_of(guards)]) <= set(range(len(guards))),
        "a condition names an unknown guard",
    )
    _require(
        data["forced_at"] is None or data["forced_at"] in parameters, "forced_at is no parameter"
    )
    made = data.get("made", 0)
    _require(type(made) is int and 0 <= made < len(states) + 1, "its made states are no number")
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
        "made": made,
        "outputs": _outputs(data.get("outputs"), names, len(guards)),
    }


def _read_nodes(data: Any, names: Mapping[str, set[str]]) -> list[Expr]:
    nodes: list[Expr] = []
    for op, args, payload in data:
        _require(
            len(args) == _OPERANDS[op] and all(0 <= i < len(nodes) for i in args),
            f"wrong operands of {op!r}",
        )
        nodes.append(_node(op, tuple(nodes[i] for i in args), payload, names, nodes))
    return nodes


def _outputs(
    data: Mapping[str, Any] | None, names: Mapping[str, set[str]], after: int
) -> NamedOutputs:
    """The outputs from their data, checked; they stand behind the guards of the system."""
    if data is None:
        return NO_OUTPUTS
    titles, nodes = tuple(data["names"]), _read_nodes(data["nodes"], names)
    for name in titles:
        _require(why_no_output(name) is None, f"{shown(name)} is no name of an output")
        _require(name not in names["state"] | names["param"], f"{shown(name)} stands twice")
    _require(len(set(titles)) == len(titles), "an output stands twice")
    _require(len(data["units"]) == len(data["formulas"]) == len(titles), "an output isn't whole")
    places = [*data["formulas"], *(i for one in data["guards"] for i in (one[1], one[3]))]
    _require(
        all(0 <= i < len(nodes) for i in places if i is not None), "an output stands in no node"
    )
    guards = tuple(
        Guard(str(name), nodes[gap], state, None if boundary is None else nodes[boundary])
        for name, gap, state, boundary in data["guards"]
    )
    formulas = tuple(nodes[i] for i in data["formulas"])
    for number, guard in enumerate(guards, start=after):
        _require(bits_in([guard.gap]) <= set(range(number)), "a gap depends on a later guard")
    _require(
        bits_in(formulas) <= set(range(after + len(guards))), "an output names an unknown guard"
    )
    units = tuple(
        check_declared(unit, name) for unit, name in zip(data["units"], titles, strict=True)
    )
    return NamedOutputs(titles, units, formulas, guards, after, bool(data["first"]))


def _law(
    data: Mapping[str, Any] | None = None,
    *,
    nodes: Sequence[Expr],
    states: int,
    guards: int,
) -> Law | None:
    """The law of a guard from its data, checked."""
    if data is None:
        return None
    levels = data.get("levels", [])
    expressions = [*levels, *(i for name in _TUPLES for i in data[name])]
    expressions += [data[name] for name in _SINGLE if name in data]
    _require(all(0 <= i < len(nodes) for i in expressions), "a law stands in no node")
    kind, side, partner, zeros = (data[name] for name in _PLAIN)
    support = data.get("support", -1)
    _require(
        among(kind, ("impact", "jump", "surface", "hold"))
        and all(type(number) is int for number in (side, partner, zeros, support))
        and abs(side) <= 1
        and -1 <= partner < guards
        and -1 <= support < guards
        and 1 <= zeros <= 3
        and (partner < 0) == (kind == "jump"),
        "a law isn't one of contact",
    )
    several: dict[str, Any] = {name: tuple(nodes[i] for i in data[name]) for name in _TUPLES}
    _require(all(len(one) in (0, states) for one in several.values()), "a law has other states")
    single: dict[str, Any] = {name: nodes[data[name]] for name in _SINGLE if name in data}
    needed = {"impact": (*_SINGLE[:3], "restitution"), "surface": _SINGLE[:4]}.get(kind, ())
    rows = {"impact": _TUPLES, "surface": _TUPLES[1:], "jump": _TUPLES[:1]}.get(kind, ())
    _require(
        all(name in single for name in needed) and all(several[name] for name in rows),
        "a law isn't whole",
    )
    several["levels"] = tuple(nodes[i] for i in levels)
    return Law(kind, side, partner, zeros=zeros, support=support, **several, **single)


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
    if (
        kind == "bit"
        and len(parts) == 1
        and isinstance(parts[0], int)
        and 0 <= parts[0] < MOST_BITS
    ):
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
