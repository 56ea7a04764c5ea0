"""Derivatives against difference quotients of many digits, and against closed forms."""

import math
import operator

import mpmath
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


OPERATIONS = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv,
    "neg": operator.neg, "pow": operator.pow,
}  # fmt: skip


def by_mpmath(root, point):
    """Values of a node and of all below it, at mpmath's precision."""
    known = {}
    for node in ex.walk(root):
        args = [known[child] for child in node.args]
        if node.op == "const":
            known[node] = mpmath.mpf(node.payload)
        elif node.op in ("param", "state", "time"):
            known[node] = point[node.payload or "t"]
        else:
            known[node] = (OPERATIONS.get(node.op) or getattr(mpmath, node.op))(*args)
    return known[root]


@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_random_expressions_against_differences_of_many_digits(expressions, data):
    expression = data.draw(expressions)
    name = data.draw(st.sampled_from(sorted(LEAVES)))
    point = {key: data.draw(st.floats(-1, 1)) for key in LEAVES}
    with mpmath.workdps(60):
        exactly = {key: mpmath.mpf(value) for key, value in point.items()}
        h = mpmath.mpf(10) ** -18
        ahead, behind = (
            by_mpmath(expression, {**exactly, name: exactly[name] + step}) for step in (h, -h)
        )
        exact = (ahead - behind) / (2 * h)
    assume(abs(exact) < 1e6)
    assert at(differentiate(expression, LEAVES[name]), point) == pytest.approx(
        float(exact), rel=1e-9, abs=1e-9
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
