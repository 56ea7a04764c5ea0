"""Comparisons of roots: the same sides as written, and a series where the root is zero."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import saltus as sl
from saltus.contact.boundaries import find_guards
from saltus.language import expression as ex
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.language.roots import with_root, without_root, zero_where_idle
from saltus.system import gap_units

X, Y, Z, D, C = *map(ex.state, "xyz"), *map(ex.parameter, "dc")
R = sl.hypot(X, Y)
SPHERE = sl.sqrt(X * X + Y * Y + Z * Z)

#: Gaps that are compared with zero, and the texts of their boundaries.
GAPS = {
    "sqrt(x*x + y*y) > d": R - D,
    "d - sqrt": D - R,
    "c*sqrt(x*x + y*y) > d": C * R - D,
    "sqrt(x*x + y*y + z*z) > d + c": SPHERE - D - C,
    "sqrt(x*x + y*y) > 0.25": R - 0.25,
    "sqrt(x*x + y*y) > -d": R + D,
    "in parts of d": 1 - R / D,
    "a factor": C * (R - D),
    "a force": C * (R - D) / R,
    "another force": 1 - D / R,
    "two roots": R - 2 * sl.hypot(Y, Z),
}
numbers = st.floats(-2, 2).filter(lambda one: one == 0 or abs(one) > 1e-3)
signed = numbers.filter(bool)


def values_of(expressions, x, y, z, d, c):
    return evaluate(expressions, states={"x": x, "y": y, "z": z}, values={"d": d, "c": c})


@pytest.mark.parametrize("gap", GAPS.values(), ids=GAPS)
@given(x=numbers, y=numbers, z=numbers, d=signed, c=signed)
def test_sides_are_those_of_the_gap_as_written(gap, x, y, z, d, c):
    """Whatever the signs of what a root is compared with."""
    was, new = values_of([gap, without_root(gap)], x, y, z, d, c)
    if np.isfinite(was) and abs(was) > 1e-9:
        assert np.sign(new) == np.sign(was)


@pytest.mark.parametrize("gap", GAPS.values(), ids=GAPS)
def test_its_derivatives_are_finite_at_rest(gap):
    new = without_root(gap)
    assert not any(node.op == "sqrt" and ex.varies(node) for node in ex.walk(new))
    assert np.isfinite(values_of(gradient(new, "xyz"), 0.0, 0.0, 0.0, 0.5, 0.7)).all()


@given(d=st.floats(0.1, 2), angle=st.floats(0, 6), off=st.floats(-1e-4, 1e-4))
def test_it_is_the_distance_beside_the_boundary(d, angle, off):
    """``(r**2 - d**2)/(2*d) = (r - d)*(1 + (r - d)/(2*d))``."""
    r = d * (1 + off)
    (gap,) = values_of([without_root(R - D)], r * np.cos(angle), r * np.sin(angle), 0, d, 1)
    assert gap == pytest.approx(d * off * (1 + off / 2), abs=1e-15)


def test_a_clearance_of_zero_is_a_boundary_too():
    (gap,) = values_of([without_root(R - D)], 0.3, 0.4, 0.0, 0.0, 1.0)
    assert gap > 0


@pytest.mark.parametrize("gap", [R - Z, R, R + sl.hypot(Y, Z) - D, X - D, R - D * sl.cos(ex.TIME)])
def test_others_stay_as_they_are(gap):
    assert without_root(gap) is gap
    assert with_root(gap) is gap


@pytest.mark.parametrize("gap", [R - D, 2 * (D - R), R - 0.25, C * R - D, (R - D) / C])
def test_it_is_read_back_as_it_was_written(gap):
    was, back = values_of([gap, with_root(without_root(gap))], 0.3, 0.7, 0.0, 0.5, 0.8)
    assert back == pytest.approx(was, rel=1e-15)


def test_a_boundary_is_found_once_and_called_as_it_is_written():
    pieces = sl.piecewise((1, R > D), (2, 2 * R < 2 * D), otherwise=0) + sl.max(R - D, 0)
    _, (guard,) = find_guards([pieces])
    assert guard.name == "d"
    system = sl.system(states="x y z", units={"x": "m", "y": "m"})(
        lambda t, x, y, z, *, d="1 mm", w="2 m": (
            sl.piecewise((1, (sl.hypot(x, y) > d) & (sl.hypot(x, y) < d + w)), otherwise=0), 0, 0
        )
    )  # fmt: skip
    assert "sqrt(x*x + y*y) = d + w" in str(system)
    assert gap_units(system)[:2] == ["m", "m"]
    assert sl.System.from_dict(system.to_dict()).guards[1].gap is system.guards[1].gap


@given(x=signed, y=signed, d=signed)
def test_products_with_idle_pieces_keep_their_values(x, y, d):
    pull = sl.max(R - D, 0.0)
    for force in (
        pull * X / R,
        -pull * (X / R),
        C * pull / R * X,
        sl.freeplay(R, stiffness=C, gap=D) / R,
    ):
        (field,), guards = find_guards([force])
        bits = [
            evaluate([guard.gap], states={"x": x, "y": y}, values={"d": d})[0] > 0
            for guard in guards
        ]
        at = {"states": {"x": x, "y": y}, "values": {"d": d, "c": 3.0}, "bits": bits}
        was, new = evaluate([field, *zero_where_idle([field])], **at)
        assert new == was


def test_products_with_idle_pieces_are_zero_at_rest():
    (field,), _ = find_guards([sl.max(R - D, 0.0) * X / R])
    at = {"states": {"x": 0.0, "y": 0.0}, "values": {"d": 1.0}, "bits": [False]}
    assert np.isnan(evaluate([field], **at)[0])
    assert evaluate(zero_where_idle([field]), **at) == [0.0]
