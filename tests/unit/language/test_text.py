"""Expressions as text: what is written means what was traced."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from saltus.language import expression as ex
from saltus.language import functions
from saltus.language.operations import ELEMENTARY
from saltus.language.text import Writer, to_text

X, V, P = ex.state("x"), ex.state("v"), ex.parameter("p")
SCOPE = {name: getattr(functions, name) for name in (*ELEMENTARY, "pi", "piecewise")}
SCOPE |= {"x": X, "v": V, "p": P, "q": ex.parameter("q"), "t": ex.TIME}


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (X + (V + P), "x + (v + p)"),
        (X + V + P, "x + v + p"),
        (X - (V - P), "x - (v - p)"),
        (X * (V + P), "x*(v + p)"),
        (X / (V * P), "x/(v*p)"),
        (X * (V / P), "x*(v/p)"),
        (-(X**2), "-x**2"),
        ((-X) ** 2, "(-x)**2"),
        (-(X * P), "-(x*p)"),
        (X - (-P), "x - (-p)"),
        (-P - X, "-p - x"),
        (X * -2, "x*(-2)"),
        ((2 * math.pi * P) ** 2, "(2*pi*p)**2"),
        (X**-1, "x**(-1)"),
        (7e8 * X + 1e-3, "7e8*x + 0.001"),
        (ex.elementary("sin", X * P), "sin(x*p)"),
        (
            ex.select(X > P, X, ex.select(X < -P, V, 0)),
            "piecewise((x, x > p), (v, -p > x), otherwise=0)",
        ),
        (ex.select((X > P) & ~(V > 0), X, 0), "piecewise((x, (x > p) & (v < 0)), otherwise=0)"),
        (ex.select(~((X > P) & (V > 0)), X, 0), "piecewise((x, (x < p) | (v < 0)), otherwise=0)"),
        (ex.select(ex.Bit(2), X, 0), "piecewise((x, guard2 > 0), otherwise=0)"),
    ],
)
def test_text(expression, text):
    assert to_text(expression) == text


@given(data=st.data())
def test_text_read_by_python_gives_the_same_expression(expressions, data):
    expression = data.draw(expressions)
    text = to_text(expression, limit=10**9)
    again = ex.as_expr(eval(text, dict(SCOPE)))
    assert to_text(again, limit=10**9) == text


def test_text_grows_with_the_graph_not_with_the_tree():
    power = X + P
    for _ in range(60):
        power = power * power + P
    assert "..." in repr(power)
    assert len(repr(power)) < 1000
    writer = Writer(shared=[power], taken=["s1"])
    final = writer.text(power)
    assert sum(map(len, writer.lines)) + len(final) < 10_000
    scope = dict(SCOPE, x=0.3, p=-0.4)
    exact = 0.3 - 0.4
    for _ in range(60):
        exact = exact * exact - 0.4
    for line in writer.lines:
        name, _, text = line.partition(" = ")
        assert name != "s1"
        scope[name] = eval(text, scope)
    assert eval(final, scope) == exact
