"""Derivatives of motions with impacts and rest by the modal flow: Taylor's method, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp, mpf

import impact_orbits
import saltus as sl
from oracles import resting_stops
from saltus.codegen.module import jit_disabled
from saltus.flow.maps import Stroboscope
from two_flows import structure


def compared(system, start, periods):
    """Derivatives by Taylor's method and by modes, at the same ends."""
    assert isinstance(sl.Modal().serving(sl.Modal().tangents(system)), sl.Modal)
    (ends, exact), (others, found) = (
        Stroboscope(system, method).tangent(start, periods) for method in (sl.Taylor(), sl.Modal())
    )
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-11)
    return found, exact


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.slow
def test_random_structures_have_the_derivatives_of_taylor(seed):
    """Stops that move, bodies that strike each other, springs beside them, rest and release."""
    rng = np.random.default_rng([20261126, seed])
    degrees = int(rng.integers(1, 4))
    system = structure(
        rng, degrees, 2, pairs=seed % 4 == 2, soft=seed % 4 == 3, moving=seed % 3 == 2
    )
    start = np.hstack([np.zeros((3, degrees)), rng.normal(0, 0.1, (3, degrees))])
    found, exact = compared(system, start, 1)
    sizes = np.abs(exact).max(axis=(1, 2), keepdims=True)
    assert (np.abs(found - exact) <= 1e-10 * sizes).all()


def test_start_beyond_a_stop_has_no_derivative():
    """One that is beyond it by rounding lies on it."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def stop(t, x, v, *, w=1.0, gap=0.2):
        return v, sl.cos(w * t) - x, sl.impact(x < gap, v, restitution=0.6)

    start = np.array([[0.1, 0.0], [np.nextafter(0.2, 1.0), -0.5], [0.3, 0.0]])
    (_, exact), (_, found) = (
        Stroboscope(stop, method).tangent(start, 1) for method in (sl.Taylor(), sl.Modal())
    )
    assert np.isnan(found).all(axis=(1, 2)).tolist() == [False, False, True]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-12)


def test_contact_that_comes_to_rest_by_chatter_leaves_the_others_free():
    """Two masses, the first of which comes to rest and is released again. The remainder of the
    chatter is completed at 1e-8.
    """

    @sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
    def pair(t, x, y, v, u, *, w=0.3, gap=0.2):
        push = sl.cos(w * t)
        law = sl.impact(x < gap, v, restitution=0.6)
        return v, u, push - x + 0.2 * (y - x) - 0.1 * v, 0.2 * (x - y) - 3.0 * y, law

    start = np.random.default_rng(4).normal(0, 0.1, (1 if jit_disabled() else 4, 4))
    run = sl.simulate(pair, start[0], periods=2, progress=False)
    assert {"impact", "hold", "release"} <= set(run.contact_kind.values.tolist())
    found, exact = compared(pair, start, 2)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("restitution", [pytest.param(0.0, marks=pytest.mark.nojit), 0.3])
def test_bodies_that_stay_together_share_their_momentum(restitution):
    """One comes to rest on the other: both velocities change, by their inertias."""

    @sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
    def pair(t, x, y, v, u, *, w=0.5, gap=0.1):
        law = sl.impact(x < y + gap, v - u, restitution=restitution, inertia={"v": 1.0, "u": 2.0})
        return v, u, 3.0 * sl.cos(w * t) - 4.0 * x, -3.0 * y, law

    start = np.array([[-0.5, 0.3, 0.2, -0.1], [-0.4, 0.2, 0.0, -0.3]])
    run = sl.simulate(pair, start[0], periods=1, progress=False)
    assert "hold" in run.contact_kind.values
    found, exact = compared(pair, start, 1)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=lambda method: method.name)
@pytest.mark.parametrize(
    ("restitutions", "inertia"),
    [
        ((0.8, 0.2), 1.0),
        ((0.99, 0.9), 3.0),
        pytest.param((0.0, 0.0), 0.2, marks=pytest.mark.nojit),
    ],
)
def test_impacts_that_cause_each_other_move_together(restitutions, inertia, method):
    """A body strikes one that rests on a wall, by which that one is struck, and so on at the same
    instant: three times, or more often than are followed one by one. Differences of the flow.
    """

    @sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
    def pair(t, x, y, v, u, *, w=9.0, gap=0.1, wall=0.5):
        masses = {"v": 1.0, "u": inertia}
        body = sl.impact(x < y + gap, v - u, restitution=restitutions[0], inertia=masses)
        law = sl.impact(y < wall, u, restitution=restitutions[1])
        push = 2.0 - 0.3 * y + 0.2 * sl.cos(w * t)
        return v, u, 3.0 * sl.cos(w * t) - 4.0 * x, push, body, law

    start, map_ = np.array([[-0.5, 0.5, 2.2, 0.0]]), Stroboscope(pair, method)
    _, found = map_.tangent(start, 1)
    for j in (0, 2):
        near = start + 1e-4 * np.array([[-2.0], [-1.0], [1.0], [2.0]]) * np.eye(4)[j]
        ends, _ = map_.rows(np.zeros(4, int)).ends(near, 1)
        expected = np.array([1.0, -8.0, 8.0, -1.0]) @ ends / 12e-4
        np.testing.assert_allclose(found[0, :, j], expected, atol=1e-8 * np.abs(found).max())


def test_two_pairs_that_come_to_rest_by_chatter_have_one_instant():
    """Flights between cascades of impacts become too short for the clock. Where both bodies rest at
    the end nothing depends on the start.
    """

    @sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
    def pair(t, x, y, v, u, *, w=9.0, gap=0.1, wall=0.5, inertia=1.0, first=0.5, second=0.5):
        body = sl.impact(x < y + gap, v - u, restitution=first, inertia={"v": 1.0, "u": inertia})
        push = 2.0 - 0.3 * y + 0.2 * sl.cos(w * t)
        law = sl.impact(y < wall, u, restitution=second)
        return v, u, 3.0 * sl.cos(w * t) - 4.0 * x, push, body, law

    draws = np.random.default_rng(20261127).uniform((0, 0, 0.3, 1.5), (0.3, 0.3, 3, 3), (60, 4))
    known = (0.149427304543, 0.108746554434, 2.20130665365, 1.67532773288)
    resting = 0
    for first, second, inertia, speed in (known, *draws):
        given = pair.with_values(first=first, second=second, inertia=inertia)
        found, exact = compared(given, np.array([[-0.5, 0.5, speed, 0.0]]), 1)
        np.testing.assert_allclose(exact, found, rtol=0, atol=1e-9 * max(1, np.abs(found).max()))
        resting += not found.any()
    assert resting > 3


def test_impacts_at_resonance_have_the_derivatives_of_taylor():
    """The drive goes together with the mode, on both sides of an impact."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def driven(t, x, v, *, w=1.0, gap=0.5):
        return v, 0.3 * sl.cos(w * t) - x, sl.impact(x < gap, v, restitution=0.6)

    found, exact = compared(driven, np.random.default_rng(4).normal(0, 0.1, (4, 2)), 4)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11 * np.abs(exact).max())


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_areas_shrink_by_the_square_of_the_restitution(damping, n):
    """The orbit with one impact in n periods is known; det Y = e^2 exp(-c n T)."""
    w, e, gap = 2.5 * n, 0.7, 0.0

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def oscillator(t, x, v, *, w=w):
        return v, sl.cos(w * t) - damping * v - x, sl.impact(x < gap, v, restitution=e)

    values = {"damping": damping, "gap": gap, "restitution": e, "frequency": w, "n": n}
    _, start = impact_orbits.oscillator(**values)[-1]
    ends, found = Stroboscope(oscillator, sl.Modal()).tangent(start[None], n)
    np.testing.assert_allclose(ends[0], start, rtol=0, atol=1e-13)
    shrinks = e**2 * math.exp(-damping * n * 2 * math.pi / w)
    assert np.linalg.det(found[0]) == pytest.approx(shrinks, rel=1e-12)


@pytest.mark.slow
def test_branches_of_orbits_with_impacts_are_those_of_taylor():
    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def stop(t, x, v, *, w=2.5, gap=0.05):
        return v, sl.cos(w * t) - 0.1 * v - x, sl.impact(x < gap, v, restitution=0.7)

    _, start = impact_orbits.oscillator(damping=0.1, gap=0.05, restitution=0.7, frequency=2.5)[-1]
    one, other = (
        sl.branches(stop, {"gap": (0.0, 0.1)}, start, method=method, progress=False)
        for method in (sl.Taylor(), sl.Modal())
    )
    assert one.sizes["branch"] == other.sizes["branch"]
    assert list(one.event_kind.values) == list(other.event_kind.values)
    np.testing.assert_allclose(other.event_gap.values, one.event_gap.values, rtol=0, atol=1e-9)


@sl.system(states="x y z u v w_", forced_at="w", units={"w": "rad/s"})
def clay(t, x, y, z, u, v, w_, *, w=10.0, a=0.6, b=0.8, f=10.0, g=5.0, h=8.0, lag=0.5, wall=0.02,
         near=0.02):  # fmt: skip
    """Three bodies on springs, and two stops without rebound that throw each other."""
    return (
        u, v, w_,
        f * sl.cos(w * t) - 200 * x + 50 * y - 0.3 * u,
        g * sl.cos(w * t + lag) - 300 * y + 50 * x - 40 * z - 0.3 * v,
        h * sl.sin(w * t) - 250 * z - 40 * y - 0.3 * w_,
        sl.impact(a * x + b * y < wall, a * u + b * v, restitution=0.0,
                  inertia={"u": 1.0, "v": 1.0}),
        sl.impact(z < y + near, w_ - v, restitution=0.0, inertia={"v": 1.0, "w_": 1.0}),
    )  # fmt: skip


def drawn_clay(rng):
    """The bodies with random values, and a start."""
    values = {name: float(rng.uniform(5, 30)) for name in "wfgh"}
    values["lag"] = float(rng.uniform(0, 6))
    values |= {name: float(rng.uniform(0.003, 0.04)) for name in ("wall", "near")}
    return clay.with_values(**values), np.r_[np.zeros(3), rng.normal(0, 0.05, 3)]


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_stops_that_come_to_rest_together_have_the_derivatives_of_the_motion(seed):
    """Central differences of 1e-6. Both stops rest after blows that cause each other without end,
    so neither closing velocity changes with the start.
    """
    one, start = drawn_clay(np.random.default_rng([20261127, seed]))
    _, found = Stroboscope(one, sl.Modal()).tangent(start[None], 1)
    beside = start + 1e-6 * np.vstack([np.eye(6), -np.eye(6)])
    run = sl.simulate(one, beside, periods=1, samples=2, method=sl.Modal(), progress=False)
    assert (run.contact_mode_after.values == 0b1110).any()
    ends = np.array([run[f"end_{name}"].values for name in one.states])
    known = (ends[:, :6] - ends[:, 6:]) / 2e-6
    assert np.abs(found[0] - known).max() <= 1e-5 * np.abs(known).max()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stops_that_throw_each_other_have_the_derivatives_of_40_digits(seed):
    """Central differences of 1e-12, of a motion that takes each blow by itself."""
    rng = np.random.default_rng([20261126, 55, seed])
    (one, start), way = drawn_clay(rng), rng.normal(size=6)
    w, a, b, f, g, h, lag, wall, near = map(mpf, one.values.values())
    with mp.workdps(40):
        bodies = resting_stops.Bodies(
            [[200, -50, 0], [-50, 300, 40], [0, 40, 250]], mpf(0.3), w,
            [f, g, h], [0, lag, -mp.pi / 2], [[a, b, 0], [0, -1, 1]], [wall, near],
        )  # fmt: skip
        sides = []
        for step in (mpf("1e-12"), -mpf("1e-12")):
            z = [mpf(at) + step * mpf(along) for at, along in zip(start, way, strict=True)]
            sides.append(bodies.after(z[:3], z[3:], 2 * mp.pi / w))
        known = [float((p - q) / mpf("2e-12")) for p, q in zip(*sides, strict=True)]
        ends = [float((p + q) / 2) for p, q in zip(*sides, strict=True)]
    for method in (sl.Modal(), sl.Taylor()):
        found, derivative = Stroboscope(one, method).tangent(start[None], 1)
        np.testing.assert_allclose(found[0], ends, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            derivative[0] @ way, known, rtol=0, atol=1e-10 * np.abs(known).max()
        )


def test_impacts_that_cause_each_other_turn_accelerations_over():
    """By parameters: `sl.sensitivity` looks for turning points, and those of
    a velocity are passed where a stop begins to rest and where it is released.
    """
    one, start = drawn_clay(np.random.default_rng([20261126, 55, 2]))
    exact, found = (
        sl.sensitivity(one, start, periods=1, samples=5, to=["wall", "f"], method=method)
        for method in (sl.Modal(), sl.Taylor())
    )
    assert str(found.status.values) == "ok"
    size = np.abs(exact.derivative.values).max()
    np.testing.assert_allclose(found.derivative, exact.derivative, rtol=0, atol=1e-9 * size)
