"""Forces of friction that become negative on the way: where they do, by closed forms. What fades
out or vanishes goes on.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning, TraceError
from saltus.flow import engine

STEPS = (
    sl.ODE23(1e-6, 1e-9), sl.ODE45(1e-8, 1e-11), sl.ODE113(1e-8, 1e-11), sl.ODE15s(1e-8, 1e-11),
    *(sl.RK4(2e-3, way) for way in ("henon", "inverse", "bisect", "ignore")),
    sl.ODE45(1e-8, 1e-11, events="ignore"),
)  # fmt: skip
steps = pytest.mark.parametrize("method", STEPS, ids=lambda one: one.label)
every = pytest.mark.parametrize("method", [sl.Taylor(), *STEPS], ids=lambda one: one.label)
#: Terms whose difference is below this part of them count as equal.
ROUNDING = 1e-9


@sl.system(states="x v")
def block(t, x, v, *, slip=1.0, fading=0.5, lubricant=0.0, pull=0.0):
    """A sliding block of mass 1."""
    return v, pull - sl.friction(v, slip=slip - fading * t - lubricant * v)


@sl.system(states="x v")
def stuck(t, x, v, *, slip=1.0, stick=1.2):
    return v, 0.1 - sl.friction(v, slip=slip * sl.cos(t), stick=stick * sl.cos(t))


@sl.system(states="x y u v")
def rough(t, x, y, u, v, *, friction=0.5, fading=1.0):
    """A block on a floor whose coefficient of friction falls."""
    floor = sl.impact(
        y > 0, -v, restitution=0.0, inertia=(1.0, 1.0), friction=friction - fading * t,
        slip_velocity=u,
    )  # fmt: skip
    return u, v, 0.0, -10.0, floor


def run(system, start, t_end, method=None, **more):
    return sl.simulate(
        system, start, t_end=t_end, method=method, samples=4, time_errors="local", **more
    )


def ended(system, start, t_end, method=None):
    """A run that ends with the status of a negative friction."""
    with pytest.warns(SaltusWarning, match="invalid_friction"):
        found = run(system, start, t_end, method)
    assert set(np.atleast_1d(found["status"].values)) == {"invalid_friction"}
    return found


# -- where it becomes negative ---------------------------------------------------------------------
def test_a_force_that_falls_with_time_ends_the_motion_where_it_is_zero():
    """v = 3 - t + t^2/4 until 2; samples behind it are missing."""
    found = ended(block, (0.0, 3.0), 6.0)
    assert float(found.end_time) == pytest.approx(2.0, rel=4 * ROUNDING)
    assert float(found.end_v) == pytest.approx(2.0, rel=1e-15)
    assert np.isfinite(found["v"].values).tolist() == (found["time"].values <= 2.0).tolist()


@pytest.mark.nojit
def test_a_force_that_falls_with_the_speed():
    """v' = 2 + v/2 from 0.1 until 1 - v/2 is zero."""
    system = block.with_values(fading=0.0, lubricant=0.5, pull=3.0)
    found = ended(system, (0.0, 0.1), 6.0)
    assert float(found.end_time) == pytest.approx(2 * math.log(6 / 4.1), rel=4 * ROUNDING)
    assert float(found.end_v) == pytest.approx(2.0, rel=4 * ROUNDING)


@pytest.mark.nojit
def test_a_force_that_holds_is_watched_too():
    """It sticks under a pull of 0.1 until 1.2 cos(t) is less; the force is zero at pi/2."""
    found = ended(stuck, (0.0, 0.0), 6.0)
    assert found["contact_kind"].values.tolist() == ["release"]
    assert found["contact_time"].values == pytest.approx([math.acos(0.1 / 1.2)], rel=1e-14)
    assert float(found.end_time) == pytest.approx(math.pi / 2, rel=4 * ROUNDING)


@pytest.mark.nojit
@pytest.mark.parametrize(("height", "falls"), [(0.0, 0.0), (0.05, 0.1), (0.8, 0.4)])
def test_a_coefficient_of_a_rough_contact(height, falls):
    """0.5 - t, met at the time at which it rests: u' = -10 (0.5 - t) from there to 0.5."""
    found = ended(rough, (0.0, height, 20.0, 0.0), 6.0)
    assert float(found.end_time) == pytest.approx(0.5, rel=4 * ROUNDING)
    assert float(found.end_u) == pytest.approx(20.0 - 5.0 * (0.5 - falls) ** 2, rel=1e-14)
    found = ended(rough, (0.0, 1.8, 20.0, 0.0), 6.0)  # it is negative as the block lands, at 0.6
    assert float(found.end_time) == pytest.approx(0.6, rel=1e-14)
    assert float(found.end_u) == 20.0


def test_a_coefficient_counts_while_the_contact_rests():
    """In flight it does nothing, and from 0.5 on it is that of the next flight."""
    found = run(rough, (0.0, 1.8, 20.0, 0.0), 0.55)
    assert str(found.status.values) == "ok"


@every
def test_a_force_that_jumps_below_zero_and_one_that_is_negative_from_the_start(method):
    @sl.system(states="x v")
    def worn(t, x, v, *, when=1.0):
        return v, -sl.friction(v, slip=sl.piecewise((-0.5, t > when), otherwise=0.5))

    for when in (1.0, -1.0):
        found = ended(worn.with_values(when=when), (0.0, 3.0), 2.0, method)
        late = 0.0 if when < 0 else getattr(method, "step", 1e-12 if method.exact else 0.2)
        assert max(when, 0.0) <= float(found.end_time) <= max(when, 0.0) + late
        assert int(found.steps) > 0 if when > 0 else int(found.steps) == 0


@steps
def test_the_other_methods_end_at_the_first_step_past_it(method):
    found = ended(block, (0.0, 3.0), 6.0, method)
    end = float(found.end_time)
    assert 2.0 < end <= 2.0 + 1.01 * getattr(method, "step", 0.6)
    assert float(found.end_v) == pytest.approx(3.0 - end + end**2 / 4, abs=1e-5)


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
@every
def test_it_is_the_same_in_any_pieces(method, monkeypatch):
    start = {"x": np.zeros(4), "v": np.array([1.2, 3.0, 9.0, 1.5])}
    whole = run(block, start, 3.0, method)
    assert whole["status"].values.tolist() == ["invalid_friction"] * 4
    monkeypatch.setattr(engine, "SLICE", 7)
    assert whole.equals(run(block, start, 3.0, method, threads=1))


# -- what goes on ----------------------------------------------------------------------------------
@every
def test_friction_that_fades_out_with_a_contact_goes_on(method):
    """A spring that presses a slider comes off it and back. The force is written as a difference
    that rounding may make negative, and of which nobody can tell that it isn't.
    """

    @sl.system(states="x y v w")
    def pressed(t, x, y, v, w, *, stiffness=37.0):
        force = sl.piecewise((stiffness * x - stiffness * y, x > y), otherwise=0.0)
        return v, w, -force - x, force - y - sl.friction(w - 5.0, slip=0.4 * force)

    found = run(pressed, (1000.5, 1000.0, 1.0, 0.5), 6.0, method)
    assert str(found.status.values) == "ok"
    assert len(set(found["mode"].values.tolist())) > 1


@pytest.mark.nojit
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # 0/0, as machine code has it
@every
def test_a_force_of_nothing_is_none(method):
    found = run(block.with_values(slip=0.0, fading=0.0), (0.0, 3.0), 0.2, method)
    assert str(found.status.values) == "ok"
    assert float(found.end_v) == 3.0


@pytest.mark.parametrize("stick", [0.0, 0.3])
def test_without_friction_in_motion_there_is_no_ratio_to_that_at_rest(stick):
    @sl.system(states="x v")
    def oscillator(t, x, v, *, slip=0.1, stick=0.4):
        return v, -x - sl.friction(v, slip=slip, stick=stick)

    with pytest.raises(ParameterError, match="slip is 0, and what a contact holds at rest"):
        run(oscillator.with_values(slip=0.0, stick=stick), (1.0, 0.0), 4.0)


@every
def test_a_force_that_touches_zero_goes_on(method):
    """v' = -(1 + cos(t)) up to 4: zero at pi."""

    @sl.system(states="x v")
    def wave(t, x, v, *, slip=1.0):
        return v, -sl.friction(v, slip=slip + slip * sl.cos(t))

    found = run(wave, (0.0, 6.0), 4.0, method)
    assert str(found.status.values) == "ok"
    assert float(found.end_v) == pytest.approx(6.0 - 4.0 - math.sin(4.0), abs=1e-5)


def test_a_force_of_rounding_errors_is_none():
    """cos(t)^2 + sin(t)^2 - 1, of states."""

    @sl.system(states="a b v")
    def turning(t, a, b, v):
        return -b, a, -sl.friction(v, slip=a * a + b * b - 1.0)

    found = run(turning, (1.0, 0.0, 1.0), 20.0)
    assert str(found.status.values) == "ok"
    assert float(found.end_v) == pytest.approx(1.0, abs=1e-12)


# -- what is known before --------------------------------------------------------------------------
def test_a_negative_force_of_parameters_is_refused():
    @sl.system(states="x v")
    def plain(t, x, v, *, slip=1.0, load=1.0):
        return v, -sl.friction(v, slip=slip * load)

    for bad in ({"slip": -0.5}, {"slip": -1.0, "load": 0.5}):
        with pytest.raises(ParameterError, match=r"slip = -0\.5 is negative.*subtract sl.friction"):
            run(plain.with_values(**bad), (0.0, 1.0), 1.0)
    with pytest.raises(ParameterError, match="slip = -2 is negative"):
        run(plain, (0.0, 1.0), 1.0, values={"load": np.array([1.0, -2.0])})
    found = run(plain, (0.0, 1.0), 0.5, values={"slip": np.array([0.0, 1.0])})
    assert found["end_v"].values.tolist() == [1.0, 0.5]
    with pytest.raises(TraceError, match=r"slip = -0\.5 is negative"):

        @sl.system(states="x v")
        def wrong(t, x, v):
            return v, -sl.friction(v, slip=-0.5)


def test_two_forces_at_one_velocity_are_watched_one_by_one():
    @sl.system(states="x v")
    def pads(t, x, v, *, one=1.0, other=2.0):
        return v, -sl.friction(v, slip=one - t) - sl.friction(2 * v, slip=other, stick=1.5 * other)

    found = ended(pads, (0.0, 9.0), 3.0)
    assert float(found.end_time) == pytest.approx(1.0, rel=4 * ROUNDING)
    with pytest.raises(ParameterError, match="slip = -2 is negative"):
        run(pads.with_values(other=-2.0), (0.0, 9.0), 3.0)


def test_what_is_made_of_a_system_watches_its_friction():
    """A copy from data, and a smooth stand-in of another boundary."""

    @sl.system(states="x v")
    def stopped(t, x, v, *, wall=20.0, slip=1.0):
        stop = sl.piecewise((x - wall, x > wall), otherwise=0.0)
        return v, -stop - sl.friction(v, slip=slip - 0.5 * t)

    smooth = sl.regularise(stopped, width={"wall": 0.01})
    for system in (smooth, sl.System.from_dict(stopped.to_dict())):
        found = ended(system, (0.0, 3.0), 6.0)
        assert float(found.end_time) == pytest.approx(2.0, rel=8 * ROUNDING)
