"""Friction in proportion to the force of a rigid contact: sliding and sticking against closed forms
and an independent solver, and the paradox of Painleve.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import saltus as sl
from saltus.errors import ParameterError, SaltusWarning, TraceError
from saltus.models import painleve_rod


@sl.system(states="x y u v")
def block(t, x, y, u, v, *, gravity=10.0, friction=0.5, pull=0.0, lift=0.0, push=0.0):
    """A block on a rough floor: a force along it that grows with time, and one away from it."""
    floor = sl.impact(
        y > 0, -v, restitution=0.0, inertia=(1.0, 1.0), friction=friction, slip_velocity=u
    )
    return u, v, push + pull * t, lift * t - gravity, floor


def contacts(run):
    return list(zip(run.contact_kind.values, run.contact_time.values, strict=True))


def times(run, kind):
    return run.contact_time.values[run.contact_kind.values == kind]


# -- a block ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_block_slides_to_a_stop_and_stays(way):
    run = sl.simulate(block, (0.0, 0.0, way, 0.0), t_end=1.0, samples=2)
    assert contacts(run) == [("hold", pytest.approx(0.2, rel=1e-15))]
    assert (float(run.end_x), float(run.end_u)) == (pytest.approx(0.1 * way, rel=1e-15), 0.0)


def test_a_block_that_is_pulled_sticks_until_the_pull_is_mu_times_its_weight():
    """Then u' = 5 t - 5."""
    run = sl.simulate(block.with_values(pull=5.0), (0.0, 0.0, 0.0, 0.0), t_end=2.0, samples=2)
    assert contacts(run) == [("release", pytest.approx(1.0, rel=1e-15))]
    assert float(run.end_u) == pytest.approx(2.5, rel=1e-14)
    assert float(run.end_x) == pytest.approx(5 / 6, rel=1e-14)


def test_friction_fades_with_the_force_that_presses():
    """Pull 5 t and weight 10 - 2 t: slips at 5 t = 0.5 (10 - 2 t), lifts off at 5."""
    system = block.with_values(pull=5.0, lift=2.0)
    run = sl.simulate(system, (0.0, 0.0, 0.0, 0.0), t_end=8.0, samples=2)
    assert run.contact_kind.values.tolist() == ["release"] * 2
    assert run.contact_time.values == pytest.approx([5 / 6, 5.0], rel=1e-14)
    slides = 3 * (25 - 25 / 36) - 5 * (5 - 5 / 6)  # the integral of 6 t - 5
    assert float(run.end_u) == pytest.approx(slides + 2.5 * (64 - 25), rel=1e-13)
    assert float(run.end_y) == pytest.approx(3.0**3 / 3, rel=1e-13)


def test_a_block_that_falls_onto_the_floor_goes_on_along_it():
    """The blow takes its fall alone; friction acts from then on, 5 against -2."""
    run = sl.simulate(block, (0.0, 1.0, -2.0, 0.0), t_end=3.0, samples=2)
    falls = math.sqrt(0.2)
    assert contacts(run) == [
        ("impact", pytest.approx(falls, rel=1e-15)),
        ("hold", pytest.approx(falls, rel=1e-15)),
        ("hold", pytest.approx(falls + 0.4, rel=1e-15)),
    ]
    assert float(run.end_x) == pytest.approx(-2 * falls - 0.4, rel=1e-14)


def test_a_block_that_nothing_pushes_along_the_floor_is_lifted_off_it():
    """Its friction holds it with no force at all, up to the end: no graze, nothing unresolved."""
    for start in ((0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)):
        run = sl.simulate(block.with_values(lift=5.0), start, t_end=3.0, samples=2)
        assert str(run.status.values) == "ok"
        assert (int(run.grazes), int(run.grazes_unresolved)) == (0, 0)
        assert times(run, "release") == pytest.approx([2.0, 2.0], rel=1e-14)
        assert (float(run.end_y), float(run.end_x)) == (pytest.approx(5 / 6, rel=1e-13), 0.0)


def test_a_stuck_block_is_struck_loose():
    """Its friction holds what pushes it, not the blow: 3 after it, and 0.5*10 - 2 brings it to a
    stop.
    """

    @sl.system(states="a x y w u v")
    def struck(t, a, x, y, w, u, v, *, push=2.0):
        floor = sl.impact(
            y > 0, -v, restitution=0, inertia={"u": 1.0, "v": 1.0}, friction=0.5, slip_velocity=u
        )
        blow = sl.impact(a < x, w - u, restitution=0.5, inertia=(1.0, 1.0))
        return w, u, v, 0.0, push, -10.0, floor, blow

    run = sl.simulate(struck, (-4.0, 0.0, 0.0, 4.0, 0.0, 0.0), t_end=2.4, samples=2)
    assert contacts(run) == [
        ("impact", 1.0), ("release", 1.0), ("hold", pytest.approx(2.0, rel=1e-15)),
    ]  # fmt: skip
    assert float(run.end_x) == pytest.approx(1.5, rel=1e-14)


def test_a_block_under_its_weight_is_den_hartogs_oscillator():
    """Weight 1 and a coefficient of 1/2 are a friction force of 1/2."""

    @sl.system(states="x y u v", forced_at="frequency")
    def shaken(t, x, y, u, v, *, friction=0.5, frequency="0.5 rad/s"):
        floor = sl.impact(
            y > 0, -v, restitution=0, inertia=(1.0, 1.0), friction=friction, slip_velocity=u
        )
        return u, v, sl.cos(frequency * t) - x, -1.0, floor

    found = sl.attractors(shaken, (0.0, 0.0, 0.0, 0.0))
    exact = sl.attractors(sl.models.den_hartog(frequency=0.5, friction_force=0.5), (0.0, 0.0))
    assert found.attractor_peak.values == pytest.approx(exact.attractor_peak.values, rel=1e-14)
    assert found.attractor_peak.values == pytest.approx([1.3034292041955001], rel=1e-13)
    largest = [max(one.attractor_multiplier_real.values[0]) for one in (found, exact)]
    assert largest[0] == pytest.approx(largest[1], rel=1e-12)


# -- a rod -----------------------------------------------------------------------------------------
def on_the_floor(tilt, slip, turn):
    """A state of the rod whose end slides along the floor."""
    return (
        np.zeros_like(tilt), np.sin(tilt), tilt,
        slip - np.sin(tilt) * turn, np.cos(tilt) * turn, turn,
    )  # fmt: skip


def force(tilt, turn, friction):
    """What friction leaves of the floor's force, p, and what presses the end: the force is their
    quotient. Friction is signed as the end slides.
    """
    left = 1 + 3 * math.cos(tilt) ** 2 + 3 * friction * math.sin(tilt) * math.cos(tilt)
    return left, 1 - math.sin(tilt) * turn**2


@pytest.mark.parametrize(("friction", "slip"), [(0.5, 1.0), (0.5, -1.0), (1.3, -1.0)])
def test_a_sliding_rod_against_an_independent_solver(friction, slip):
    """Up to the end of sliding."""

    def rates(t, state):
        _, _, tilt, u, v, turn = state
        sign = math.copysign(1.0, slip)
        left, pressed = force(tilt, turn, friction * sign)
        n = pressed / left
        turning = -3 * n * (math.cos(tilt) + friction * sign * math.sin(tilt))
        return [u, v, turn, -friction * sign * n, n - 1, turning]

    def slides(t, state):
        return state[3] + math.sin(state[2]) * state[5]

    slides.terminal = True
    start = on_the_floor(0.8, slip, 0.3)
    exact = solve_ivp(
        rates, (0.0, 1.0), start, method="DOP853", rtol=1e-13, atol=1e-14, events=slides
    )
    run = sl.simulate(painleve_rod(friction=friction), start, t_end=exact.t[-1], samples=1)
    ends = [float(run[f"end_{name}"]) for name in run.attrs["states"].split()]
    np.testing.assert_allclose(ends, exact.y[:, -1], atol=1e-11)
    longer = sl.simulate(painleve_rod(friction=friction), start, t_end=1.0)
    if exact.t_events[0].size:
        assert times(longer, "hold")[0] == pytest.approx(exact.t_events[0][0], rel=1e-11)


@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_a_falling_rod_sticks_until_its_end_slips_backward(friction):
    """A rod that pivots about its end, released upright: N = (1 - 3 cos a)^2/4 of its weight, and
    3 sin a (3 cos a - 2)/4 along the floor, a from the vertical.
    """
    began = 0.2
    slips = brentq(
        lambda a: 3 * math.sin(a) * (3 * math.cos(a) - 2) - friction * (1 - 3 * math.cos(a)) ** 2,
        began, 0.6,
    )  # fmt: skip
    turn = -math.sqrt(1.5 * (1 - math.cos(began)))
    start = on_the_floor(math.pi / 2 - began, 0.0, turn)
    run = sl.simulate(painleve_rod(friction=friction), start, t_end=1.0, samples=1)
    first = np.flatnonzero(run.contact_kind.values == "release")[0]
    assert math.pi / 2 - run.contact_tilt.values[first] == pytest.approx(slips, rel=1e-13)
    slip = float(run.end_u) + math.sin(float(run.end_tilt)) * float(run.end_turn)
    assert slip < 0


# -- the paradox -----------------------------------------------------------------------------------
def status(friction, tilt):
    start = on_the_floor(tilt, -1.0, 0.0)
    method = sl.Taylor(max_steps=1000)
    run = sl.simulate(
        painleve_rod(friction=friction), start, t_end=1e-6, samples=1, method=method, progress=False
    )
    return str(run.status.values)


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
def test_the_smallest_friction_that_leads_to_the_paradox():
    """P01: 4/3, at tan(tilt) = 2."""
    with (Path(__file__).parents[1] / "reference" / "laws_friction.csv").open() as file:
        (known,) = (float(row["value"]) for row in csv.DictReader(file) if row["id"] == "P01")
    tilt = math.atan(2.0)
    low, high = 1.3, 1.4
    while high - low > 1e-13:
        middle = (low + high) / 2
        low, high = (low, middle) if status(middle, tilt) == "painleve" else (middle, high)
    assert high == pytest.approx(known, rel=1e-11)
    for beside in (tilt - 0.01, tilt + 0.01):
        assert status(known + 1e-5, beside) == "ok"
    assert status(known + 1e-5, tilt) == "painleve"


def test_a_rod_comes_to_the_paradox_only_where_its_floor_stops_to_press():
    """Genot & Brogliato: a motion that slides comes to the boundary of the paradox, p = 0, only
    where what presses is zero too; a start beyond it is in the paradox at once, or after a flight.
    """
    random, n, friction = np.random.default_rng(3), 300, 1.6
    tilt, turn = random.uniform(0.2, 1.5, n), random.uniform(-2, 2, n)
    names = ("x", "y", "tilt", "u", "v", "turn")
    start = dict(zip(names, on_the_floor(tilt, random.uniform(-3, 0, n), turn), strict=True))
    rod, method = painleve_rod(friction=friction), sl.Taylor(lanes=4)
    with pytest.warns(SaltusWarning, match="Painleve"):
        run = sl.simulate(rod, start, t_end=1.0, samples=20, method=method)
    left = np.array([force(one, 0.0, -friction)[0] for one in tilt])
    paradox, ends = run.status.values == "painleve", run.end_time.values
    assert set(run.status.values.tolist()) == {"ok", "painleve"}
    assert (left[ends == 0] <= 0).all()
    assert paradox[left <= 0].mean() > 0.9
    struck = run.contact_trajectory.values[run.contact_kind.values == "impact"]
    later = np.setdiff1d(np.flatnonzero(paradox & (ends > 0)), struck)
    assert later.size >= 5
    for i in later:
        p, pressed = force(run.end_tilt.values[i], run.end_turn.values[i], -friction)
        assert abs(p) < 1e-10
        assert abs(pressed) < 1e-7
    lowest = (run.y - np.sin(run.tilt)).values
    assert np.nanmin(lowest) > -1e-14


def test_where_nothing_presses_in_the_paradox_there_are_several_motions():
    """A start whose end would leave the floor, or be held by a force that friction makes."""

    @sl.system(states="x y q u v w")
    def lever(t, x, y, q, u, v, w, *, friction=3.0, lift=1.0):
        """p = 2 + friction where it slides to the right, 2 - friction to the left."""
        end = sl.impact(
            y > q, w - v, restitution=0, inertia={"u": 1, "v": 1, "w": 1}, friction=friction,
            slip_velocity=u + w,
        )  # fmt: skip
        return u, v, w, 0.0, lift, 0.0, end

    def of(slip, **values):
        start = (0.0, 0.0, 0.0, slip, 0.0, 0.0)
        return sl.simulate(lever.with_values(**values), start, t_end=0.1, samples=1)

    for lift in (1.0, -1.0):
        with pytest.warns(SaltusWarning, match="or there are several"):
            run = of(-1.0, lift=lift)
        assert (str(run.status.values), float(run.end_time)) == ("painleve", 0.0)
        for slip, friction in ((1.0, 3.0), (-1.0, 1.9)):
            run = of(slip, lift=lift, friction=friction)
            assert str(run.status.values) == "ok"
            height = 0.005 if lift > 0 else 0.0
            assert float(run.end_y - run.end_q) == pytest.approx(height, abs=1e-15)


# -- derivatives, words ----------------------------------------------------------------------------
def test_the_tangent_over_impact_sliding_and_sticking_against_finite_differences():
    from saltus.flow.maps import Stroboscope

    system = block.with_values(pull=0.5, push=1.0)
    map_ = Stroboscope(system, sl.Taylor(), every=1.5)
    start = np.array([[0.1, 0.05, 1.0, -0.3]])
    _, tangent = map_.tangent(start, np.array([1]))
    small = 1e-5
    for i in range(4):
        ends = []
        for sign in (1, -1):
            moved = start[0] + sign * small * (np.arange(4) == i)
            run = sl.simulate(system, moved, t_end=1.5, samples=1)
            ends.append([float(run[f"end_{name}"]) for name in ("x", "y", "u", "v")])
        np.testing.assert_allclose(
            tangent[0][:, i], (np.array(ends[0]) - ends[1]) / (2 * small), atol=1e-8
        )


def rough_floor(slip, **given):
    """A system whose floor slides at ``slip(u)``."""

    @sl.system(states="y u v")
    def one(t, y, u, v):
        sliding = {} if slip is None else {"slip_velocity": slip(u)}
        return v, 0.0, -1.0, sl.impact(y > 0, -v, **given, **sliding)

    return one


@pytest.mark.parametrize(
    ("slip", "changed", "message"),
    [
        (None, {}, "come together"),
        (lambda u: 1.0, {}, "holds a state"),
        (lambda u: u * u, {}, "isn't linear in u"),
        (lambda u: u, {"friction": -0.5}, "never pushes on"),
        (lambda u: u, {"restitution": 0.5}, "without rebound"),
        (lambda u: u, {"inertia": None}, "how they share the impulse"),
        (lambda u: u, {"inertia": {"v": 1.0}}, "no state that friction could act on"),
    ],
)
def test_what_is_wrong_is_said(slip, changed, message):
    given = {"restitution": 0, "inertia": (1.0, 1.0), "friction": 0.5} | changed
    with pytest.raises(TraceError, match=message):
        rough_floor(slip, **given)


def test_two_forces_that_turn_at_one_velocity_are_refused():
    with pytest.raises(TraceError, match="another force or law does too"):

        @sl.system(states="y u v")
        def one(t, y, u, v):
            floor = sl.impact(
                y > 0, -v, restitution=0, inertia=(1, 1), friction=0.5, slip_velocity=u
            )
            return v, -sl.sign(u), -1.0, floor


def test_what_it_does_is_told():
    with pytest.raises(ParameterError, match="never pushes on"):
        block.with_values(friction=-0.1)
    assert "impact with restitution 0 and friction 0.5 at y = 0" in str(block)
    assert "sticks or slides at u = 0 while 'y = 0' rests" in str(block)
    again = sl.System.from_dict(block.to_dict())
    assert (str(again), again.fingerprint()) == (str(block), block.fingerprint())
