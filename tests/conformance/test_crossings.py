"""Rules 3 and 4: every crossing inside a step is found, once, and none is invented - however many,
however close.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import EPS, contacts, lab, pair, quartic, quartic_with_roots

# these tests look at the status themselves
pytestmark = [
    pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning"),
    pytest.mark.usefixtures("exact_method"),
]

PARABOLA = lab.with_values(lift=-2.0)  # x = 2 t - t^2 from (0, 2): its top is 1, at t = 1
DEPTHS = 10.0 ** -np.arange(5, 13)


# -- two crossings in one step ---------------------------------------------------------------------
@pytest.mark.parametrize("t_end", [1.7, 2.0, 3.0, 50.0])
def test_two_crossings_in_one_step(t_end):
    """x'' = -2, boundary 0.999: events at 1 -+ sqrt(0.001), wherever the step ends."""
    run = sl.simulate(PARABOLA.with_values(boundary=0.999), (0.0, 2.0), t_end=t_end, samples=4)
    into, out = contacts(run)
    assert abs(into.time - 0.9683772233983162) < 4e-15
    assert abs(out.time - 1.0316227766016839) < 4e-15
    assert (into.direction, out.direction, into.after, out.after) == (1, -1, 1, 0)
    assert into.velocity == pytest.approx(2 * math.sqrt(0.001), rel=1e-14)


@pytest.mark.parametrize("t_end", [1.7, 2.0, 3.0, 50.0])
def test_two_crossings_a_millionth_apart(t_end):
    """Boundary 1 - 1e-12: still two, at 1 -+ sqrt(1 - boundary) to what rounding of the gap (4 ulp)
    leaves at that speed.
    """
    boundary = 1 - 1e-12
    run = sl.simulate(PARABOLA.with_values(boundary=boundary), (0.0, 2.0), t_end=t_end, samples=4)
    into, out = contacts(run)
    half = math.sqrt(1 - boundary)
    assert abs(into.time - (1 - half)) < 4 * EPS / (2 * half)
    assert abs(out.time - (1 + half)) < 4 * EPS / (2 * half)
    assert (str(run.status.values), int(run.events)) == ("ok", 2)


def test_near_miss():
    """Boundary 1 + 1e-12: no event, and the smallest margin is that of the boundary as a double."""
    run = sl.simulate(PARABOLA.with_values(boundary=1 + 1e-12), (0.0, 2.0), t_end=2.0, samples=4)
    assert (contacts(run), str(run.status.values)) == ([], "ok")
    assert float(run.smallest_gap_margin) == pytest.approx((1 + 1e-12) - 1, abs=EPS)


@pytest.mark.parametrize("start", [0.0, 0.3, -7.0, 0.999])
@pytest.mark.parametrize("sign", [1, -1])
def test_shallow_grazes_of_a_parabola(start, sign):
    """Depths 1e-5 ... 1e-12 below the top: two events each, at -+ sqrt(depth); above it: none, and
    the margin is the depth.
    """
    speed = 2 * math.sqrt(1 - start)
    boundary = 1 - sign * DEPTHS
    run = sl.simulate(
        PARABOLA, (start, speed), t_end=50.0, samples=2, values={"boundary": boundary}
    )
    top = start + (speed / 2) ** 2  # the top of this parabola, rounded
    rounding = 8 * EPS * max(1, abs(start))
    for i, edge in enumerate(boundary):
        found = contacts(run, i)
        if sign < 0:
            assert found == []
            assert float(run.smallest_gap_margin[i]) == pytest.approx(edge - top, abs=rounding)
            continue
        half = math.sqrt(top - edge)
        assert [c.direction for c in found] == [1, -1]
        for contact, time in zip(found, (speed / 2 - half, speed / 2 + half), strict=True):
            assert abs(contact.time - time) < rounding / half + 2 * EPS * speed
    assert set(run.status.values.tolist()) == {"ok"}


def _first_swing(s, omega, sigma, wd):
    """How far a damped oscillator has come down from a maximum of height 1, a time s after (or
    before) it.
    """
    bend = 2 * math.sin(wd * s / 2) ** 2 - sigma / wd * math.sin(wd * s)
    return bend * math.exp(-sigma * s) - math.expm1(-sigma * s)


def _bisect(function, low, high):
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) * function(low) > 0 else (low, middle)
    return low


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_shallow_grazes_of_the_rig(side, sign):
    """The rig, free (no force, no cubic): after half a swing from 5 mm its top is known; boundaries
    1e-5 ... 1e-12 m in or out of it.
    """
    wn, zeta, start = 10 * math.pi, 0.03, 5e-3
    sigma, wd = zeta * wn, wn * math.sqrt(1 - zeta**2)
    top_time, top = math.pi / wd, start * math.exp(-sigma * math.pi / wd)
    edge = top - sign * DEPTHS
    gaps = (
        {"upper_gap": edge, "lower_gap": 1.0}
        if side == "upper"
        else {"upper_gap": 1.0, "lower_gap": edge}
    )
    rig = sl.models.delangre("c", cubic=0.0, force=0.0, frequency=5.0)
    run = sl.simulate(
        rig, (-start if side == "upper" else start, 0.0), periods=3, samples=2, values=gaps
    )
    for i, depth in enumerate(top - edge):
        found = contacts(run, i)
        if sign < 0:
            assert found == []
            assert float(run.smallest_gap_margin[i]) == pytest.approx(
                -depth, rel=1e-14, abs=16 * EPS * top
            )
            continue
        before = _bisect(
            lambda s, depth=depth: top * _first_swing(s, wn, sigma, wd) - depth, -0.02, 0.0
        )
        rate = math.sqrt(2 * depth * wn**2 * top)
        assert [(c.guard, c.kind) for c in found] == [(f"{side}_gap", "crossing")] * 2
        assert abs(found[0].time - (top_time + before)) < 16 * EPS * start / rate + 1e-16
        assert found[1].time > top_time
        assert abs(found[1].velocity) == pytest.approx(abs(found[0].velocity), rel=0.1)
    assert set(run.status.values.tolist()) == {"ok"}
    assert not run.mode_violations.any()


# -- many crossings in one step --------------------------------------------------------------------
def _check_roots(starts, roots, t_end, tolerance):
    run = sl.simulate(quartic, np.array(starts), t_end=t_end, samples=2)
    for i, wanted in enumerate(roots):
        wanted = sorted(root for root in wanted if 0 < root < t_end)
        found = contacts(run, i)
        assert len(found) == len(wanted), (i, wanted, [c.time for c in found])
        assert np.abs(np.array([c.time for c in found]) - wanted).max(initial=0) < tolerance
    assert set(run.status.values.tolist()) == {"ok"}
    assert not run.mode_violations.any()


@pytest.mark.parametrize("t_end", [4.0, 5.0, 6.0, 7.3, 64.0])
def test_four_crossings_in_one_step(t_end):
    """x = (t-1)(t-2)(t-3)(t-4) is flat exactly at 2.5, which is the middle of the step for t_end =
    5.
    """
    run = sl.simulate(quartic, quartic_with_roots(1, 2, 3, 4), t_end=t_end, samples=2)
    found = contacts(run)
    assert [round(c.time, 12) for c in found] == [1.0, 2.0, 3.0, 4.0]
    assert [c.direction for c in found] == [-1, 1, -1, 1]


@pytest.mark.parametrize("t_end", [1.0, 1.1, 2.0])
def test_every_choice_of_four_crossings_on_a_grid(t_end):
    """Roots at eighths: the middles of steps and of their halves fall on roots and on extrema."""
    grid = [i / 8 for i in range(1, 8)]
    roots = [
        *itertools.combinations(grid, 4),
        *((a, b, -0.5, 1.5) for a, b in itertools.combinations(grid, 2)),
    ]
    _check_roots([quartic_with_roots(*r) for r in roots], roots, t_end, 1e-12)


def test_random_crossings_in_one_step():
    """1000 quartics with random roots at least 1e-3 apart (a root's error is rounding over the
    slope there).
    """
    rng = np.random.default_rng(4)
    roots = np.sort(rng.uniform(-0.2, 1.2, (2000, 4)), axis=1)
    roots = roots[(np.diff(roots, axis=1) > 1e-3).all(axis=1) & (np.abs(roots) > 1e-3).all(axis=1)][
        :1000
    ]
    _check_roots([quartic_with_roots(*r) for r in roots], roots.tolist(), 1.25, 1e-7)


@pytest.mark.parametrize("root", [0.5, 0.375, 1.0, 0.625])
def test_crossing_without_speed(root):
    """A triple root: the gap crosses with no velocity and no acceleration. One crossing, close by
    (cube root of rounding), flagged.
    """
    run = sl.simulate(quartic, quartic_with_roots(root, root, root, 5.0), t_end=2.0, samples=2)
    found = contacts(run)
    assert [c.direction for c in found if c.before != c.after] == [-1]
    assert all(abs(c.time - root) < 1e-4 for c in found)
    assert int(run.mode[-1]) == 0
    assert int(run.mode_violations) == 0
    assert all(abs(c.time - root) <= c.error for c in found if c.before != c.after)


def _expected(level, x, v, t_end):
    """Times and directions at which x cos t + v sin t meets a level below which it starts."""
    size, top = math.hypot(x, v), math.atan2(v, x)
    if size <= level:
        return [], 1.0
    half = math.acos(level / size)
    found = [(top + side * half + 2 * math.pi * k, -side) for k in range(-1, 3) for side in (-1, 1)]
    return sorted(one for one in found if 0 < one[0] <= t_end), math.sqrt(size**2 - level**2)


@pytest.mark.parametrize("apart", [None, 0.3, 1e-2, 1e-3, 1e-4, 1e-7, 1e-12])
def test_crossings_of_several_gaps_in_one_step(apart):
    """Two oscillators at 1 rad/s, boundaries without effect for both and for their distance: every
    crossing of all, at its time.

    A natural step holds several. `apart`: the second oscillator follows the first so much later,
    and crosses as much later.
    """
    rng = np.random.default_rng(12)
    x1, x2 = rng.uniform(-2.5, 0.9, (2, 100))
    v1, v2 = rng.uniform(-3, 3, (2, 100))
    if apart is not None:
        x2, v2 = (
            x1 * math.cos(apart) - v1 * math.sin(apart),
            v1 * math.cos(apart) + x1 * math.sin(apart),
        )
    starts = {"x1": x1, "v1": v1, "x2": x2, "v2": v2}
    run = sl.simulate(pair.with_values(spring=1.0), starts, t_end=6.0, samples=1)
    compared = 0
    for i in range(100):
        found = contacts(run, i)
        assert [c.time for c in found] == sorted(c.time for c in found)
        for guard, x, v in (
            ("stop1", x1[i], v1[i]),
            ("stop2", x2[i], v2[i]),
            ("gap", x1[i] - x2[i], v1[i] - v2[i]),
        ):
            expected, rate = _expected(1.0, x, v, 6.0)
            if x >= 0.999 or abs(math.hypot(x, v) - 1) < 1e-6:
                continue
            times = [(c.time, c.direction) for c in found if c.guard == guard]
            assert [direction for _, direction in times] == [direction for _, direction in expected]
            assert all(
                abs(time - exact) < 1e-14 * (1 + 1 / rate)
                for (time, _), (exact, _) in zip(times, expected, strict=True)
            )
            compared += len(times)
    assert compared > 200


def test_through_both_boundaries_in_one_step():
    """At 100 m/s the rig crosses both contact zones, 0.8 mm apart, within one step: lower boundary,
    then upper, 8 us later.
    """
    rig = sl.models.delangre("a", contact_stiffness=0.0, cubic=0.0, force=0.0, damping_ratio=0.0)
    run = sl.simulate(rig, (-0.01, 100.0), t_end=1e-2, samples=20)
    wn = 10 * math.pi
    times = [
        (math.asin(x * wn / math.hypot(100, 0.01 * wn)) + math.atan2(0.01 * wn, 100)) / wn
        for x in (-4e-4, 4e-4)
    ]
    assert [(c.guard, c.direction) for c in contacts(run)] == [("lower_gap", 1), ("upper_gap", 1)]
    assert [c.time for c in contacts(run)] == pytest.approx(times, abs=1e-17)


# -- one boundary after another --------------------------------------------------------------------
def test_coincident_boundaries():
    """j1 = j2 = 0: two boundaries in one place make a linear spring; T = 0.083563435783617037 s.
    Each crossing is one event of each.
    """
    rig = sl.models.delangre("b", upper_gap=0.0, cubic=0.0, damping_ratio=0.0, force=0.0)
    run = sl.simulate(rig, (0.0, 0.1), t_end=5.0)
    period = 0.083563435783617037
    times = {
        name: [c.time for c in contacts(run) if c.guard == name]
        for name in ("lower_gap", "upper_gap")
    }
    assert times["lower_gap"] == times["upper_gap"]
    wanted = period / 2 * np.arange(1, len(times["lower_gap"]) + 1)
    assert len(wanted) == int(5.0 / (period / 2))
    assert np.abs(np.array(times["lower_gap"]) / wanted - 1).max() < 1e-14
    energy = 0.5 * 3 * run.v**2 + 0.5 * (3 * (10 * math.pi) ** 2 + 1.4e4) * run.x**2
    assert float(np.abs(energy / energy[0] - 1).max()) < 1e-13


@pytest.mark.parametrize("start", [(-1e-3, 0.0), (-1e-6, 0.3), (0.0, 1.0)])
def test_huge_stiffness(start):
    """Kc = 1.4e10 at x = 0, k as the rig, alone: a contact lasts pi / sqrt((k + Kc) / m) =
    4.5988202634e-5 s, at any speed.
    """
    rig = sl.models.delangre(
        "b",
        contact_stiffness=1.4e10,
        lower_gap=1.0,
        upper_gap=0.0,
        cubic=0.0,
        force=0.0,
        damping_ratio=0.0,
    )
    run = sl.simulate(rig, start, t_end=0.5, samples=20)
    found = contacts(run)
    times = [c.time for c in found] if start[0] else [0.0, *(c.time for c in found)]
    contacts_last = np.diff(times)[::2]
    assert len(contacts_last) >= 4
    assert np.abs(contacts_last - 4.5988202634e-5).max() < 1e-15
    assert np.ptp([abs(c.velocity) for c in found]) < 1e-13 * abs(found[0].velocity)
    assert {c.guard for c in found} == {"upper_gap"}


def test_boundary_without_effect():
    """Kc = 0: hundreds of located crossings, and the motion is the linear one (closed form) as
    without them: location does no harm.
    """
    rig = sl.models.delangre(
        "b", contact_stiffness=0.0, cubic=0.0, force=0.0, damping_ratio=0.01, frequency=5.0
    )
    crossed = sl.simulate(rig, (5e-3, 0.2), periods=40, samples=5)
    clear = sl.simulate(
        rig.with_values(lower_gap=1.0, upper_gap=1.0), (5e-3, 0.2), periods=40, samples=5
    )
    assert (int(crossed.events) > 100, int(clear.events)) == (True, 0)
    wn, sigma = 10 * math.pi, 0.1 * math.pi
    wd = math.sqrt(wn**2 - sigma**2)
    t = crossed.time.values
    exact = np.exp(-sigma * t) * (
        5e-3 * np.cos(wd * t) + (0.2 + sigma * 5e-3) / wd * np.sin(wd * t)
    )
    for run in (crossed, clear):
        assert np.abs(run.x.values - exact).max() < 1e-16
    assert int(crossed.mode_violations) == 0


# -- no contact out of nothing ---------------------------------------------------------------------
def test_hitting_a_body_at_rest():
    """Mass 1 hits mass 2, which rests: displacement, velocity and acceleration of mass 2 are zero,
    its jerk isn't. One event, then one half a period later (omega^2 = 2), and momentum is handed
    over.
    """
    run = sl.simulate(
        pair.with_values(stop1=50.0, stop2=50.0, stiffness=1.0),
        (0.0, 1.0, 0.0, 0.0),
        t_end=6.0,
        samples=6,
    )
    found = contacts(run)
    assert [(c.guard, c.kind, c.direction) for c in found] == [
        ("gap", "crossing", 1),
        ("gap", "crossing", -1),
    ]
    assert [c.time for c in found] == pytest.approx([1.0, 1.0 + math.pi / math.sqrt(2)], abs=1e-14)
    assert (float(run.end_v1), float(run.end_v2)) == pytest.approx((0.0, 1.0), abs=1e-14)


def test_hitting_a_body_at_rest_and_a_stop_at_once():
    """As above, mass 1 also meets its own stop at that instant: two events then, none of them a
    graze, none twice.
    """
    system = pair.with_values(stop1=1.0, stop2=50.0, stiffness=1.0, stiffness1=1.0)
    run = sl.simulate(system, (0.0, 1.0, 0.0, 0.0), t_end=2.0, samples=6)
    assert [(c.guard, c.kind, c.direction) for c in contacts(run)] == [
        ("stop1", "crossing", 1),
        ("gap", "crossing", 1),
    ]
    assert (int(run.grazes), int(run.events)) == (0, 2)
    assert float(run.smallest_gap_margin) > 1e-3
