"""A whole equation as LLVM IR: the functions of its generated head for lanes and registers, the
trigonometry that they call, and its constants.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache

from saltus.codegen import templates
from saltus.codegen.expression_ir import INTEGER, NUMBER, Value, literal
from saltus.codegen.function_ir import Helpers, Signature, function_ir
from saltus.codegen.head import Constant
from saltus.codegen.head_text import Function, function_of, functions_of
from saltus.codegen.interface import REAL, WHOLE, Interface

#: Functions whose arrays hold a lane in each row; arrays of the others hold numbers.
OF_LANES = ("jets", "rates")


def _part_by_part(function: Function, signature: Signature, lanes: int, name: str) -> str:
    """A function that calls another for a few lanes of each row at a time."""
    arguments, lines = function.arguments, []
    for first in range(0, signature.row, lanes):
        places = [f"%{argument}.{first}" for argument in arguments]
        lines += [
            f"{place} = getelementptr i8, ptr %{argument}, i64 {8 * first}"
            for place, argument in zip(places, arguments, strict=True)
        ]
        lines.append(f"call void @saltus_{name}({', '.join(f'ptr {one}' for one in places)})")
    given = ", ".join(f"ptr %{argument}" for argument in arguments)
    body = "".join(f"  {line}\n" for line in [*lines, "ret void"])
    return f"define void @saltus_{function.name}({given}) {signature.attributes} {{\n{body}}}\n"


@cache
def _trigonometry(lanes: int) -> tuple[str, frozenset[str]]:
    """sincos, turned and two_product of kernels/trigonometry.py, and their declarations."""
    tree = templates.tree_of(templates.text("trigonometry"))
    numbers = _numbers_of(tree)
    vector, declared = f"<{lanes} x double>", set[str]()
    pair, doubles = f"{{ {vector}, {vector} }}", "{ double, double }"
    kinds = {
        "sincos": ((vector,), pair),
        "two_product": ((REAL, REAL), doubles),
        "turned": ((REAL, REAL, WHOLE), REAL),
    }
    texts = [
        function_ir(
            function_of(node),
            Signature(*kinds[node.name], "alwaysinline nounwind"),
            lanes,
            numbers,
            declared,
            {},
        )
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name in kinds
    ]
    return "\n".join(texts), frozenset(declared)


def _numbers_of(tree: ast.Module) -> dict[str, Value]:
    """The named numbers of a module, single or in tuples."""
    found: dict[str, Value] = {}
    tuples: dict[str, list[float]] = {}
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Tuple(elts=elements)):
                tuples[name] = [ast.literal_eval(e) for e in elements]
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                found[name] = Value(NUMBER, literal(ast.literal_eval(value)))
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=value):
                values = (
                    tuples[value.id]
                    if isinstance(value, ast.Name)
                    else [ast.literal_eval(e) for e in value.elts]  # type: ignore[attr-defined]
                )
                found |= {
                    name.id: Value(NUMBER, literal(v))  # type: ignore[attr-defined]
                    for name, v in zip(names, values, strict=True)
                }
    return found


def equation_ir(
    functions: str,
    sizes: tuple[tuple[str, int], ...],
    interface: Interface,
    lanes: int,
    register: int | None = None,
) -> str:
    """The functions of a head as LLVM IR, named ``saltus_NAME``.

    Those of lanes work off one register after the other, by the same code: with all lanes at once
    it is so long that a step doesn't fit the cache of instructions. docs/decisions/0051.

    Parameters
    ----------
    functions : str
        Text of the head's functions.
    sizes : tuple of tuple (name, value)
        Its whole numbers.
    interface : Interface
        The functions and names that the templates use.
    lanes : int
        Trajectories in a row.
    register : int, optional
        Number of them in a register. Default: all.
    """
    part = min(register or lanes, lanes)
    shared, declared = _trigonometry(part)
    known = {name: Value(INTEGER, str(int(value))) for name, value in sizes}
    needed = set(declared)
    tables, bodies = functions_of(functions)
    texts, made = [], set[str]()
    for table in tables:
        name, kind, text = _table_ir(table)
        known[name] = Value(kind, f"@saltus_{name}")
        texts.append(text)
    for name, arguments in interface.functions.items():
        of_lanes, function = name in OF_LANES, bodies[name]
        width, attributes = (part, "nounwind alignstack(64)") if of_lanes else (lanes, "nounwind")
        signature = Signature(
            arguments,
            "i64" if name in interface.truths else "void",
            attributes,
            lanes if of_lanes else 1,
        )
        if width < signature.row:
            texts.append(_part_by_part(function, signature, width, f"part_of_{name}"))
            function = function._replace(name=f"part_of_{name}")
            signature = signature._replace(attributes=f"noinline {attributes}")
        helpers: Helpers = {other: None for other in bodies if other not in interface.functions}
        texts.append(function_ir(function, signature, width, known, needed, helpers))
        for helper, given in helpers.items():
            if given is not None and helper not in made:
                made.add(helper)
                loops = any(str(one).startswith("for ") for one in bodies[helper].body)
                own = f"noinline {attributes}" if loops else attributes
                signature = Signature(given, "void", own, signature.row)
                texts.append(function_ir(bodies[helper], signature, width, known, needed, {}))
    return "\n".join([shared, *texts, *sorted(needed)]) + "\n"


def _table_ir(node: ast.Assign) -> tuple[str, str, str]:
    """Name, kind and LLVM constant of a table that stands between the functions of a head."""
    (target,) = node.targets
    assert isinstance(target, ast.Name)
    entries = ast.literal_eval(node.value)
    whole = all(isinstance(one, int) for one in entries)
    kind, type_ = ("integers", WHOLE) if whole else ("numbers", REAL)
    listed = ", ".join(f"{type_} {one if whole else literal(one)}" for one in entries)
    text = f"@saltus_{target.id} = internal constant [{len(entries)} x {type_}] [{listed}]"
    return target.id, kind, text


def constants_ir(constants: Mapping[str, Constant], interface: Interface) -> str:
    """The sizes and tables of an equation as LLVM constants ``saltus_NAME``."""
    lines = []
    for name, value in constants.items():
        if isinstance(value, tuple):
            kind = interface.tables[name]
            entries = ", ".join(f"{kind} {literal(x) if kind == REAL else int(x)}" for x in value)
            lines.append(f"@saltus_{name} = constant [{len(value)} x {kind}] [{entries}]")
        elif isinstance(value, float):
            lines.append(f"@saltus_{name} = constant double {literal(value)}")
        else:
            lines.append(f"@saltus_{name} = constant i64 {int(value)}")
    return "\n".join(lines) + "\n"
