"""Boundaries are found, merged however they are written, oriented and named; what is no boundary is
refused.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from saltus.contact.boundaries import find_guards
from saltus.contact.guards import bits_in
from saltus.errors import TraceError
from saltus.language import abs, cos, max, min, piecewise
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.language.expression import And, Bit, Not, Or
from saltus.language.text import to_text

X, V, T = ex.state("x"), ex.state("v"), ex.TIME
P, Q, R = (ex.parameter(name) for name in "pqr")


def guards_of(*field):
    return find_guards(field)[1]


def described(guard):
    return (
        guard.name,
        to_text(guard.gap),
        guard.state,
        None if guard.boundary is None else to_text(guard.boundary),
    )


@pytest.mark.parametrize(
    ("condition", "gap", "boundary", "payload"),
    [
        (X > P, "x - p", "p", Bit(0)),
        (X >= P, "x - p", "p", Bit(0)),
        (X < P, "x - p", "p", Not(Bit(0))),
        (P > X, "x - p", "p", Not(Bit(0))),
        (X < -P, "x - (-p)", "-p", Not(Bit(0))),
        (X + P > 0, "x - (-p)", "-p", Bit(0)),
        (X - P - Q > 0, "x - (p + q)", "p + q", Bit(0)),
        (P - X > Q, "x - (p - q)", "p - q", Not(Bit(0))),
        (-P + Q + X > 0, "x - (p - q)", "p - q", Bit(0)),
        (2 * X > P, "x - p/2", "p/2", Bit(0)),
        (-2 * X > P, "x - (-p/2)", "-p/2", Not(Bit(0))),
        (3 * (X - P) > 0, "x - p", "p", Bit(0)),
        ((P - X) / 3 > 0, "x - p", "p", Not(Bit(0))),
        (X + X > P + X, "x - p", "p", Bit(0)),
        (X > 0, "x", "0", Bit(0)),
        (X > 1.5, "x - 1.5", "1.5", Bit(0)),
        (~(X > P), "x - p", "p", Not(Bit(0))),
        (~(X < P), "x - p", "p", Bit(0)),
    ],
)
def test_a_level_of_one_state_points_upwards(condition, gap, boundary, payload):
    (field,), (guard,) = find_guards([ex.select(condition, V, 0)])
    assert (to_text(guard.gap), guard.state, to_text(guard.boundary)) == (gap, "x", boundary)
    assert field.payload == payload


@pytest.mark.parametrize(
    ("condition", "gap", "payload"),
    [
        (X - V > P, "x - v - p", Bit(0)),
        (-P > X - V, "x - v - (-p)", Not(Bit(0))),
        (P * X > Q, "p*x - q", Bit(0)),
        (P * cos(T) < X, "x - p*cos(t)", Bit(0)),
        (X**2 > P, "x**2 - p", Bit(0)),
        (X * V > 0, "x*v", Bit(0)),
    ],
)
def test_other_boundaries_keep_their_gap(condition, gap, payload):
    (field,), (guard,) = find_guards([ex.select(condition, V, 0)])
    assert (to_text(guard.gap), guard.state, guard.boundary) == (gap, None, None)
    assert field.payload == payload


@st.composite
def rewritten(draw, left, right, depth=4):
    """A comparison left > right, written in another way. Its numbers are dyadic, so that folding
    them doesn't round.
    """
    for _ in range(draw(st.integers(0, depth))):
        other = draw(st.sampled_from([X, V, P, Q, T, ex.constant(0.75), X * V]))
        factor = draw(st.sampled_from([0.25, 0.5, 2.0, 8.0]))
        match draw(st.integers(0, 6)):
            case 0:
                left, right = left + other, right + other
            case 1:
                left, right = left - other, right - other
            case 2:
                left, right = factor * left, right * factor
            case 3:
                left, right = left / factor, right / factor
            case 4:
                left, right = -right, -left
            case 5:
                left, right = left - right, ex.constant(0)
            case 6:
                left, right = other * factor + left, right + factor * other
    return draw(st.sampled_from([left > right, right < left, ~(right > left), ~(left <= right)]))


@given(st.data())
def test_one_boundary_is_one_guard_however_it_is_written(data):
    left, right = data.draw(
        st.sampled_from([(X, P), (X - V, P), (X * V + P, 2 * Q), (X, P * cos(T))])
    )
    first, second = (data.draw(rewritten(left, right)) for _ in range(2))
    (a, b), guards = find_guards(
        [piecewise((1, first), otherwise=-1), piecewise((1, second), otherwise=-1)]
    )
    assert len(guards) == 1
    assert a is b
    values = {"x": 0.3, "v": -1.2}, {"p": 0.7, "q": -0.4}
    gap, difference = evaluate(
        [guards[0].gap, left - right], t=0.2, states=values[0], values=values[1]
    )
    (side,) = evaluate([a], bits=[gap > 0])
    assert side == np.sign(difference)


def test_equal_numbers_under_different_names_stay_two_guards():
    assert [guard.name for guard in guards_of(piecewise((X, X < -P), (V, X > Q), otherwise=0))] == [
        "p",
        "q",
    ]


def test_order_is_that_of_reading():
    inner = piecewise((1, V > P), otherwise=0)
    guards = guards_of(
        piecewise((inner, X > Q), (2, X > R), otherwise=0), piecewise((1, V > P), otherwise=X)
    )
    assert [guard.name for guard in guards] == ["q", "p", "r"]


def test_names_are_unique():
    guards = guards_of(
        piecewise((1, X < -P), (2, X > P), (3, V > P), (4, X - V > P + Q), otherwise=0)
    )
    assert [guard.name for guard in guards] == [
        "x = -p", "x = p", "v = p", "x - v = p + q",
    ]  # fmt: skip
    assert [guard.name for guard in guards_of(abs(X) + piecewise((1, X > P), otherwise=0))] == [
        "x = 0",
        "p",
    ]
    assert [guard.name for guard in guards_of(piecewise((1, X - V > P), otherwise=0))] == ["p"]


def test_long_names_are_cut_and_stay_unique():
    def deep(start):
        for number in range(40):
            start = start * V**2 + number
        return start

    first, second = guards_of(
        piecewise((1, deep(X**2) > P * Q), (2, deep(X**3) > P * Q), otherwise=0)
    )
    assert second.name == first.name + "'"
    assert len(first.name) < 200


def test_comparisons_inside_functions_and_products_are_found():
    (field,), guards = find_guards(
        [
            cos(piecewise((X, X > P), otherwise=0))
            * V
            / (-Q + piecewise((1, P - X < 0), otherwise=2))
        ]
    )
    assert [guard.name for guard in guards] == ["p"]
    on = ex.select(Bit(0), X, 0)
    assert field is ex.elementary("cos", on) * V / (-Q + ex.select(Bit(0), 1, 2))


def test_a_boundary_inside_a_gap_comes_before_it():
    (field,), guards = find_guards([piecewise((abs(X) - P, abs(X) > P), otherwise=0)])
    assert [described(guard) for guard in guards] == [
        ("x = 0", "x", "x", "0"),
        ("p", "piecewise((x, guard0 > 0), otherwise=-x) - p", None, None),
    ]
    assert bits_in([guards[1].gap]) == {0}
    for x in (-2.0, -0.5, 0.5, 2.0):
        bits = [x > 0]
        bits.append(evaluate([guards[1].gap], states={"x": x}, values={"p": 1.0}, bits=bits)[0] > 0)
        (value,) = evaluate([field], states={"x": x}, values={"p": 1.0}, bits=bits)
        assert value == (abs(x) - 1.0 if abs(x) > 1 else 0.0)


@given(x=st.floats(-3, 3), v=st.floats(-3, 3))
def test_nested_extremes_keep_their_value(x, v):
    law = max(min(X, V), min(abs(X) - 1, 2 - V))
    (field,), guards = find_guards([law])
    bits = []
    for guard in guards:
        (gap,) = evaluate([guard.gap], states={"x": x, "v": v}, bits=bits)
        bits.append(gap > 0)
    assert evaluate([field], states={"x": x, "v": v}, bits=bits) == evaluate(
        [law], states={"x": x, "v": v}
    )


def test_conditions_that_are_certain_are_folded():
    always, never = X + 1 - X > 0, X - X - 2 > 0
    field, guards = find_guards(
        [
            piecewise((X, always), otherwise=V),
            piecewise((X, never), otherwise=V),
            piecewise((X, always & (V > 0)), otherwise=0),
            piecewise((X, (V > 0) & always), otherwise=0),
            piecewise((X, never | (V > 0)), otherwise=0),
            piecewise((X, never & (V > 0)), otherwise=0),
            piecewise((X, ~never), otherwise=0),
            piecewise((X, (V > 0) & ~(-V > 0)), otherwise=0),
        ]
    )
    on = ex.select(Bit(0), X, 0)
    assert field == (X, V, on, on, on, ex.constant(0), X, on)
    assert len(guards) == 1


def test_a_boundary_on_which_nothing_depends_is_left_out():
    assert guards_of(piecewise((X, X > Q), otherwise=X)) == ()
    # the branches become equal only when X > P and P < X are known to be one boundary
    same = piecewise(
        (piecewise((X, X > P), otherwise=V), V > Q), otherwise=piecewise((X, P < X), otherwise=V)
    )
    twice = piecewise((1, (abs(V) > R) & ~(X > P) | (V > 3)), otherwise=2)
    (first, second), guards = find_guards([same, twice])
    assert [guard.name for guard in guards] == ["p", "v = 0", "r", "v = 3"]
    assert first is ex.select(Bit(0), X, V)
    assert second is ex.select(Or(And(Bit(2), Not(Bit(0))), Bit(3)), 1, 2)
    assert bits_in([guards[2].gap]) == {1}


@pytest.mark.parametrize(
    ("condition", "teaches"),
    [
        (cos(T * T) > 0, "depends on time only, and its times can't be solved for"),
        (T * T > P, "sl.table"),
        (P > Q, "depends on parameters only"),
        (X + P - X > Q, "depends on parameters only"),
        (X + P > P + X, "compares equal things"),
        (piecewise((1, X > 0), otherwise=-1) > 0, "only through another condition"),
    ],
)
def test_what_is_no_boundary_is_refused(condition, teaches):
    with pytest.raises(TraceError, match=teaches):
        find_guards([piecewise((X, condition), otherwise=V)])
