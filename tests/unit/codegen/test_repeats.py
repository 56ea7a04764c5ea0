"""What repeats an earlier statement becomes what it would by itself, instruction by instruction."""

from __future__ import annotations

import ast

import pytest

import saltus as sl
from conformance import systems
from saltus.codegen import head_text, lane_ir, module, repeats
from saltus.codegen.function_ir import Signature, function_ir
from saltus.codegen.interface import ARRAY, REAL, TAYLOR
from saltus.codegen.rates_head import rates_head
from saltus.codegen.taylor_head import taylor_head
from saltus.system.tangent import tangent_system

SYSTEMS = {
    "pair with a tangent": tangent_system(systems.pair),
    "chain": sl.models.chain(),
    "cradle": systems.cradle,
}


def as_trees(text):
    """The tables and functions of a head as Python's parser finds them."""
    body = ast.parse(text).body
    functions = [node for node in body if isinstance(node, ast.FunctionDef)]
    tables = [node for node in body if isinstance(node, ast.Assign)]
    return tables, {node.name: head_text.function_of(node) for node in functions}


def heads(system):
    """(head, interface, lanes) of Taylor's method, of short and long lanes, and of two others."""
    for order, lanes in ((4, 2), (6, 8)):
        yield taylor_head(system, order, lanes), TAYLOR, lanes
    for method in ("ODE45", "ODE15s"):
        interface, _, numbers = module._STEPS[method]
        yield rates_head(system, numbers, method == "ODE15s"), interface, 1


@pytest.mark.parametrize("name", SYSTEMS)
def test_instructions_are_those_of_the_trees(monkeypatch, name):
    """Also of what other systems, other widths of lanes and other methods have left behind."""
    for head, interface, lanes in heads(getattr(SYSTEMS[name], "origin", SYSTEMS[name])):
        sizes = tuple((one, n) for one, n in head.constants.items() if isinstance(n, int))
        given = (head.functions, sizes, interface, lanes, min(lanes, 4))
        short = lane_ir.equation_ir(*given)
        assert lane_ir.equation_ir(*given) == short
        with monkeypatch.context() as patch:
            patch.setattr(lane_ir, "functions_of", as_trees)
            assert lane_ir.equation_ir(*given) == short


def translated(statements, constants=None, lanes=1):
    text = "def jump(a, y):\n" + "".join(f"    {one}\n" for one in statements)
    function = head_text.functions_of(text)[1]["jump"]
    signature = Signature((REAL, ARRAY), "void", "")
    return function_ir(function, signature, lanes, constants or {}, set(), {})


def test_a_name_that_means_something_else_is_no_repetition():
    """A row that is known, a literal in place of a value, a lane in place of a number."""
    two, three = ({"row": lane_ir.Value("integer", n)} for n in ("2", "3"))
    lines = ["b = y[row]", "y[0] = b"]
    assert "i64 16" in translated(lines, two)
    assert "i64 24" in translated(lines, three)
    value, literal, lane = (
        translated([f"b = {given}", "c = b * a", "y[0] = 1.0"], lanes=4)
        for given in ("a * a", "2.0", "splat(a, LANES)")
    )
    assert "fmul double %r0, %a" in value
    assert "fmul double 0x4000000000000000, %a" in literal
    assert "fmul <4 x double>" in lane


def test_shapes_are_forgotten_before_they_are_too_many(monkeypatch):
    monkeypatch.setattr(repeats, "_KNOWN", {})
    monkeypatch.setattr(repeats, "MAX_KNOWN", 3)
    whole = translated([f"y[{i}] = a" for i in range(10)])
    assert 0 < len(repeats._KNOWN) <= 3
    assert whole.count("store double %a") == 10
