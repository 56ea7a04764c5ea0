"""The freeplay law against its definition."""

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from saltus.contact import freeplay
from saltus.contact.boundaries import find_guards
from saltus.errors import TraceError
from saltus.language import expression as ex
from saltus.language import piecewise
from saltus.language.text import to_text

X, V, K, J, C = (
    ex.state("x"),
    ex.state("v"),
    ex.parameter("k"),
    ex.parameter("j"),
    ex.parameter("c"),
)
sizes = st.floats(0, 2)


@given(x=st.floats(-3, 3), v=st.floats(-3, 3), lower=sizes, upper=sizes, c=sizes, preload=sizes)
def test_force(x, v, lower, upper, c, preload):
    force = freeplay(
        x, stiffness=7.0, lower_gap=lower, upper_gap=upper, damping=c, velocity=v, preload=preload
    )
    if x > upper:
        expected = 7 * (x - upper) + c * v
    elif x < -lower:
        expected = 7 * (x + lower) + c * v
    else:
        expected = 0.0
    assert force == pytest.approx(expected + preload, rel=1e-12, abs=1e-12)


@given(x=st.floats(-3, 3), gap=sizes)
def test_a_symmetric_gap_gives_an_odd_force_that_opposes_nothing_inside(x, gap):
    force = freeplay(x, stiffness=7.0, gap=gap)
    assert force == -freeplay(-x, stiffness=7.0, gap=gap)
    assert force * x >= 0
    assert (force == 0) == (abs(x) <= gap)


def test_it_is_the_piecewise_expression_written_out():
    written = piecewise((K * (X + J), X < -J), (K * (X - J), X > J), otherwise=0)
    (short,), guards = find_guards([freeplay(X, stiffness=K, gap=J)])
    assert short is find_guards([written])[0][0]
    assert len(guards) == 2


def test_one_side_and_damping():
    (force,), guards = find_guards([freeplay(X, stiffness=K, upper_gap=J, damping=C, velocity=V)])
    assert to_text(force) == "piecewise((k*(x - j) + c*v, guard0 > 0), otherwise=0)"
    assert [guard.name for guard in guards] == ["j"]


@pytest.mark.parametrize(
    ("arguments", "teaches"),
    [
        ({}, "needs gap="),
        ({"gap": 1, "upper_gap": 1}, "besides"),
        ({"gap": 1, "damping": 2.0}, "velocity="),
        ({"gap": 1, "damping": C}, "velocity="),
    ],
)
def test_errors_teach(arguments, teaches):
    with pytest.raises(TraceError, match=teaches):
        freeplay(X, stiffness=K, **arguments)


def test_numbers_of_any_kind_go_together():
    assert (
        freeplay(
            Decimal("0.5"),
            stiffness=np.longdouble(2),
            upper_gap=np.float32(0.25),
            preload=Decimal(1),
        )
        == 1.5
    )
