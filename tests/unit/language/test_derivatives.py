"""Derivatives against SymPy and against difference quotients."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from saltus.language import expression as ex
from saltus.language.derivatives import differentiate, gradient, gradients, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.operations import ELEMENTARY

X, V, P, Q, T = ex.state("x"), ex.state("v"), ex.parameter("p"), ex.parameter("q"), ex.TIME
LEAVES = {"x": X, "v": V, "p": P, "q": Q, "t": T}


def at(expression, point):
    states = {name: point[name] for name in "xv"}
    values = {name: point[name] for name in "pq"}
    return evaluate([expression], t=point["t"], states=states, values=values, bits=[True, False])[0]


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_random_expressions_against_sympy(expressions, data):
    sympy = pytest.importorskip("sympy")
    symbols = {name: sympy.Symbol(name) for name in LEAVES}
    operations = {
        "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b, "neg": lambda a: -a,
        "pow": lambda a, b: a**b,
    }  # fmt: skip

    def to_sympy(root):
        known = {}
        for node in ex.walk(root):
            args = [known[child] for child in node.args]
            if node.op == "const":
                known[node] = sympy.Rational(node.payload)
            elif node.op in ("param", "state", "time"):
                known[node] = symbols[node.payload or "t"]
            else:
                known[node] = (
                    operations[node.op](*args)
                    if node.op in operations
                    else getattr(sympy, node.op)(*args)
                )
        return known[root]

    expression = data.draw(expressions)
    name = data.draw(st.sampled_from(sorted(LEAVES)))
    point = {key: data.draw(st.integers(-8, 8)) / 8 for key in LEAVES}
    exact = sympy.diff(to_sympy(expression), symbols[name]).evalf(
        40, subs={symbols[key]: sympy.Rational(value) for key, value in point.items()}
    )
    assume(exact.is_real and abs(exact) < 1e6)
    assert at(differentiate(expression, LEAVES[name]), point) == pytest.approx(
        float(exact), rel=1e-9, abs=1e-9
    )


@settings(max_examples=60)
@given(data=st.data())
def test_random_expressions_against_differences(expressions, data):
    expression = data.draw(expressions)
    name = data.draw(st.sampled_from(sorted(LEAVES)))
    point = {key: data.draw(st.floats(-1, 1)) for key in LEAVES}
    h = 1e-4
    samples = [at(expression, {**point, name: point[name] + k * h}) for k in (-2, -1, 1, 2)]
    assume(all(math.isfinite(sample) and abs(sample) < 1e3 for sample in samples))
    fourth_order = (samples[0] - 8 * samples[1] + 8 * samples[2] - samples[3]) / (12 * h)
    second_order = (samples[2] - samples[1]) / (2 * h)
    # otherwise h is too large to say anything
    assume(abs(fourth_order - second_order) < 1e-4 * (1 + abs(fourth_order)))
    assert at(differentiate(expression, LEAVES[name]), point) == pytest.approx(
        fourth_order, rel=1e-4, abs=1e-6
    )


@pytest.mark.parametrize("name", ELEMENTARY)
def test_every_elementary_function(name):
    u = 0.6
    exact = {
        "sqrt": 0.5 / math.sqrt(u), "exp": math.exp(u), "log": 1 / u, "sin": math.cos(u),
        "cos": -math.sin(u), "tan": 1 / math.cos(u) ** 2,
        "atan": 1 / (1 + u * u), "tanh": 1 / math.cosh(u) ** 2,
    }  # fmt: skip
    (value,) = evaluate([differentiate(ex.elementary(name, 3 * X), X)], states={"x": u / 3})
    assert value == pytest.approx(3 * exact[name], rel=1e-14)


@pytest.mark.parametrize(
    ("expression", "exact"),
    [
        (X * V + X, lambda x, v: v + 1),
        (V - X * X, lambda x, v: -2 * x),
        (V / X, lambda x, v: -v / x**2),
        (X / (X + V), lambda x, v: v / (x + v) ** 2),
        ((X - V) / (X * V), lambda x, v: 1 / x**2),
        (-(X**-2), lambda x, v: 2 / x**3),
        (ex.elementary("sin", X**2) / X, lambda x, v: 2 * math.cos(x**2) - math.sin(x**2) / x**2),
    ],
)
def test_sums_products_and_quotients(expression, exact):
    (value,) = evaluate([differentiate(expression, X)], states={"x": 0.7, "v": -1.9})
    assert value == pytest.approx(exact(0.7, -1.9), rel=1e-13)


def test_power_rules():
    (by_base, by_exponent) = evaluate(
        [differentiate(X**P, X), differentiate(X**P, P)], states={"x": 1.7}, values={"p": 2.5}
    )
    assert by_base == pytest.approx(2.5 * 1.7**1.5, rel=1e-14)
    assert by_exponent == pytest.approx(1.7**2.5 * math.log(1.7), rel=1e-14)
    assert differentiate(X**2, X) is 2 * X


def test_the_mode_is_frozen():
    law = ex.select(ex.Bit(0), P * (X - Q), 0)
    assert differentiate(law, X) is ex.select(ex.Bit(0), P, 0)
    assert differentiate(ex.select(ex.Bit(0), X + 1, X - 1), X) is ex.constant(1)


def test_what_does_not_depend_has_derivative_zero():
    assert gradient(P * V, ["x", "v"]) == (ex.constant(0), P)
    assert time_derivative(P * V) is ex.constant(0)
    assert time_derivative(P * T) is P


def test_derivatives_are_taken_with_respect_to_leaves():
    with pytest.raises(ValueError, match="with respect to"):
        differentiate(X * V, X * V)


def test_cost_grows_with_the_graph():
    power = X
    for _ in range(200):
        power = ex.elementary("sin", power) * power
    assert sum(1 for _ in ex.walk(differentiate(power, X))) < 5000
    assert np.isfinite(at(differentiate(power, X), dict.fromkeys(LEAVES, 0.5)))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_gradients_are_the_derivatives_one_by_one(expressions, data):
    a, b = data.draw(expressions), data.draw(expressions)
    pieces = ex.select(ex.Bit(0), a, b)
    roots = [a, a - pieces, (pieces + b) * pieces, a + a, (a - b) + (pieces - a)]
    for root, row in zip(roots, gradients(roots, ["x", "none", "v"]), strict=True):
        one_by_one = [differentiate(root, leaf) for leaf in (X, ex.state("none"), V)]
        for together, alone in zip(row, one_by_one, strict=True):
            assert together is alone or together.payload == alone.payload == 0  # 0 or -0


def test_the_gradient_of_a_sum_takes_a_step_for_each_term():
    def steps(terms):
        total, count = ex.constant(0), []
        for i in range(terms):
            total = total + (i + 0.5) * ex.state(f"x{i}") if i % 3 else total - ex.state(f"x{i}")
        with ex.observed(count.append):
            gradient(total - P, [f"x{i}" for i in range(terms)])
        return len(count)

    assert steps(200) < 2.1 * steps(100)
