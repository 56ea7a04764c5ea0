"""The table of operations, and everybody who reads it or has rules of his own: an operation that is
missing in one place fails here.
"""

import math
import re

import numpy as np
import pytest

import saltus as sl
from saltus import language
from saltus.codegen.jets import JetCode
from saltus.language import expression as ex
from saltus.language import foreign
from saltus.language.derivatives import differentiate
from saltus.language.evaluate import evaluate
from saltus.language.latex import LatexWriter
from saltus.language.operations import ARITHMETIC, ELEMENTARY, FUNCTIONS
from saltus.language.text import to_text
from saltus.system import formula

X, V = ex.state("x"), ex.state("v")
#: Everything with a node, of states.
NODES = {
    **{name: ex.Expr(name, (X, V)[: one.operands]) for name, one in ARITHMETIC.items()},
    **{name: ex.elementary(name, X) for name in ELEMENTARY},
}
AT = {"x": 0.6, "v": 2.0}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_is_public_and_for_formulas(name):
    public = getattr(sl, name)
    assert name in sl.__all__
    assert name in language.__all__
    assert public is getattr(language, name)
    assert formula.FUNCTIONS[name] is public
    assert f"sl.{name}" in re.findall(r"sl\.\w+", ex.OWN_FUNCTIONS)
    assert public.__doc__


@pytest.mark.parametrize("name", [name for name, one in FUNCTIONS.items() if one.numpy])
def test_numpy_s_function_of_traced_values_is_ours(name):
    theirs, ours = getattr(np, FUNCTIONS[name].numpy), getattr(sl, name)
    places = (X, V)[: theirs.nin]
    assert repr(theirs(*places)) == repr(ours(*places[: 1 if name == "heaviside" else 2]))
    assert foreign.UFUNCS[theirs.__name__] is ours


@pytest.mark.parametrize("name", [name for name, one in ARITHMETIC.items()])
def test_arithmetic_is_python_s_and_numpy_s(name):
    one = ARITHMETIC[name]
    places = (X, ex.constant(3.0))[: one.operands]
    node = one.python(*places)
    assert (node.op, node.args) == (name, places)
    assert getattr(np, one.numpy)(*places) is node


@pytest.mark.parametrize("name", NODES)
def test_a_node_has_a_value_a_text_and_a_derivative(name):
    node = NODES[name]
    value, slope = evaluate([node, differentiate(node, X)], states=AT)
    h = 1e-5
    low, high = (evaluate([node], states=AT | {"x": AT["x"] + step})[0] for step in (-h, h))
    assert slope == pytest.approx((high - low) / (2 * h), rel=1e-8)
    scope = {"x": AT["x"], "v": AT["v"], **{one: getattr(sl, one) for one in FUNCTIONS}}
    assert eval(to_text(node), scope) == pytest.approx(value, rel=1e-15)
    written = LatexWriter().text(node)
    assert written.count("{") == written.count("}")
    assert "x" in written


@pytest.mark.parametrize("name", ELEMENTARY)
def test_an_elementary_function_is_python_s_of_numbers_and_has_a_rule_of_series(name):
    assert ex.elementary(name, 0.6).payload == getattr(math, name)(0.6)
    assert getattr(sl, name)(X) is NODES[name]
    assert LatexWriter().text(NODES[name]).startswith("\\")
    assert hasattr(JetCode, f"_{name}")


@pytest.mark.parametrize("name", NODES)
def test_a_node_is_kept_and_read(name):
    @sl.system(states=("x", "v"))
    def one(t, x, v):
        return [v, ex.substituted(NODES[name], {X: x, V: v})]

    again = sl.System.from_dict(one.to_dict())
    assert again.field == one.field
