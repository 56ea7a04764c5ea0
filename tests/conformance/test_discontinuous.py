"""Rules 1 and 10: forces that jump. The right-hand side sees a frozen mode, so closed forms hold to
rounding across every jump.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import EPS, contacts, lab, slider

# these tests look at the status themselves
pytestmark = [
    pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning"),
    pytest.mark.usefixtures("exact_method"),
]


@pytest.mark.parametrize("preload", [4.0, 1e3, 0.01, 3.0000000001])
def test_preload_turns_a_body_round(preload):
    """Free flight at speed 1 into a region with a constant force back: in at 1, out 2 / preload
    later at the same speed.
    """
    run = sl.simulate(
        lab.with_values(preload=preload), (0.0, 1.0), t_end=1.0 + 3.0 / preload, samples=8
    )
    into, out = contacts(run)
    assert (into.time, into.velocity, into.after) == (1.0, 1.0, 1)
    assert out.time - 1.0 == pytest.approx(
        2 / preload, rel=4 * EPS * preload + 4 * EPS, abs=4 * EPS
    )
    assert out.velocity == pytest.approx(-1.0, rel=4 * EPS)
    assert (out.before, out.after) == (1, 0)


def test_force_that_pushes_through():
    """A preload of -3: the force jumps forward at the boundary; x = 1 + s + 3 s^2 / 2 beyond, no
    return.
    """
    run = sl.simulate(lab.with_values(preload=-3.0), (0.0, 1.0), t_end=3.0, samples=8)
    (only,) = contacts(run)
    assert (only.time, only.direction) == (1.0, 1)
    assert float(run.end_x) == 1 + 2 + 6


def test_dashpot_in_contact_only():
    """Damping that begins at the boundary: v = exp(-2 s) beyond it, never stopping, never coming
    back.
    """
    run = sl.simulate(lab.with_values(dashpot=2.0), (0.0, 1.0), t_end=11.0, samples=100)
    (only,) = contacts(run)
    assert only.time == 1.0
    assert float(run.end_v) == pytest.approx(math.exp(-20.0), rel=1e-13)
    assert float(run.end_x) == pytest.approx(1 + (1 - math.exp(-20.0)) / 2, abs=4 * EPS)


def test_spring_and_dashpot_contact_lasts_as_in_the_books():
    """A Kelvin-Voigt contact left at x = 0 lasts pi / wd, with restitution exp(-zeta wn pi / wd):
    R12a, zeta = 0.05 gives 0.854467893.
    """
    wn, zeta = 20.0, 0.05
    wd = wn * math.sqrt(1 - zeta**2)
    run = sl.simulate(
        lab.with_values(stiffness=wn**2, dashpot=2 * zeta * wn), (0.0, 1.0), t_end=3.0, samples=8
    )
    into, out = contacts(run)
    assert out.time - into.time == pytest.approx(math.pi / wd, abs=4 * EPS)
    assert -out.velocity == pytest.approx(0.85446789300675647, abs=16 * EPS)


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
def test_relay_that_crosses(friction):
    """Coulomb friction weaker than the drive wherever the velocity turns: slips both ways, never
    slides; crossings as by hand.
    """
    run = sl.simulate(slider.with_values(friction=friction), (0.1,), periods=20, samples=1)
    found = contacts(run)
    assert (str(run.status.values), len(found)) == ("ok", 40)
    assert [c.direction for c in found] == [-1, 1] * 20
    before, v, side = 0.0, 0.1, 1
    for c in found:
        change = 2 * (math.sin(2 * math.pi * c.time) - math.sin(2 * math.pi * before)) / (
            2 * math.pi
        ) - friction * side * (c.time - before)
        assert abs(v + change) < 8 * EPS * (1 + c.time)
        assert c.velocity == pytest.approx(
            2 * math.cos(2 * math.pi * c.time) - friction * side, abs=1e-13
        )
        before, v, side = c.time, 0.0, -side


@pytest.mark.parametrize("friction", [1.9, 1.95, 1.99, 5.0])
def test_relay_that_sticks(friction):
    """Coulomb friction stronger than the drive where the velocity first turns: the block sticks,
    exactly at rest, until the drive is as strong as the friction.
    """
    run = sl.simulate(slider.with_values(friction=friction), (0.3,), periods=1, samples=1)
    found = contacts(run)
    stuck = found[0]
    assert (str(run.status.values), stuck.guard, stuck.kind) == ("ok", "belt held", "hold")
    turned = 0.3 + math.sin(2 * math.pi * stuck.time) / math.pi - friction * stuck.time
    assert abs(turned) < 4 * EPS
    if friction > 2:  # the drive is never that strong
        assert (len(found), float(run.end_v)) == (1, 0.0)
        return
    released = found[1]
    angle = math.acos(friction / 2)  # |2 cos(2 pi t)| = friction, first at t = 1/2 - angle/(2 pi)
    assert (released.guard, released.kind) == ("belt held", "release")
    assert released.time == pytest.approx(0.5 - angle / (2 * math.pi), abs=1e-14)


def test_a_body_pressed_onto_a_jump_slides():
    """Lift 1 towards the boundary, preload 3 back: a body that arrives bounces ever lower, v_n+1 =
    v_n, in contact 1 / 2 as long as out.
    """
    run = sl.simulate(
        lab.with_values(lift=1.0, preload=3.0, boundary=0.0), (-0.5, 0.0), t_end=20.0, samples=1
    )
    found = contacts(run)
    assert [c.time for c in found[:4]] == pytest.approx([1.0, 2.0, 4.0, 5.0], abs=1e-13)
    assert all(abs(abs(c.velocity) - 1) < 1e-13 for c in found)


def test_accumulating_contacts_end_by_name():
    """With a dashpot too, the bounces shrink without end: the run stops with a named status before
    its end, or crosses it; never NaN.
    """
    system = lab.with_values(lift=1.0, preload=3.0, boundary=0.0, dashpot=1.0)
    run = sl.simulate(system, (-0.5, 0.0), t_end=40.0, samples=1, method=sl.Taylor(max_events=500))
    assert str(run.status.values) in ("sliding", "budget_events", "resting", "graze_unresolved")
    assert abs(float(run.end_x)) < 1e-2
    assert np.isfinite([float(run.end_x), float(run.end_v), float(run.end_time)]).all()
    assert int(run.mode_violations) == 0
