"""Motions followed to other values: against closed forms, branches, and folds that are known."""

import itertools
import math
import re

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.closed.cycles import find_cycles
from saltus.analysis.closed.field_zeros import find_equilibria
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.track import SHORTEST, track
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import ODE45

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


def orbits_of(system, count=24):
    map_ = Stroboscope(system, sl.Taylor())
    start = np.random.default_rng(82).uniform([-5e-3, -1.0], [5e-3, 1.0], (count, 2))
    return map_, find_attractors(map_, start, np.array([1e-2, 2.0]), 2000)[0].orbits


@sl.system(states="x v", forced_at="f", check_units=False)
def oscillator(t, x, v, *, f=0.3, k=4.0, c=0.4):
    """A linear oscillator."""
    return v, sl.cos(2 * sl.pi * f * t) - k * x - c * v


@pytest.mark.nojit
def test_a_linear_oscillator_keeps_to_its_closed_form():
    def response(f, k=4.0, c=0.4):
        w = 2 * math.pi * f
        x = 1 / (k - w * w + 1j * c * w)
        return np.array([x.real, (1j * w * x).real])

    old = ClosedMotion(response(0.3)[None], np.array([0.5, 0.5]), 0.0)
    found = track(oscillator, old, {"f": 0.3}, {"f": 0.33, "k": 5.0})
    np.testing.assert_allclose(found.motion.points[0], response(0.33, 5.0), atol=1e-12)
    assert found.stable
    assert (found.lost, found.values["f"], found.values["k"]) == ("", 0.33, 5.0)
    decay = math.exp(-0.4 / 2 / 0.33)  # of a period: the determinant is its square
    np.testing.assert_allclose(np.abs(found.motion.multipliers), decay, rtol=1e-11)


def test_orbits_go_where_the_flow_says_unstable_ones_too():
    """Every attractor of the rig over 20 mHz: a run from the new points comes back to them."""
    _, orbits = orbits_of(RIG)
    assert len(orbits) > 2
    for old in orbits:
        found = track(RIG, old, {"frequency": 15.0}, {"frequency": 15.02})
        assert not found.lost
        points = found.motion.points
        assert found.motion.period == old.period
        run = sl.stroboscope(
            RIG.with_values(frequency=15.02), tuple(points[0]), old.period, progress=False
        )
        end = np.array([float(run[name].values.ravel()[-1]) for name in RIG.states])
        np.testing.assert_allclose(end, points[0], rtol=1e-9, atol=1e-12)
        back = track(RIG, found.motion, found.values, {"frequency": 15.0})
        np.testing.assert_allclose(back.motion.points, old.points, rtol=1e-8, atol=1e-11)


@pytest.mark.parametrize(("period", "by"), [(4, -0.4), (5, -1.0)])
def test_a_long_way_ends_where_many_short_ones_do(period, by):
    """Newton's method alone jumps to another orbit of this period on the way."""
    _, orbits = orbits_of(RIG)
    old = next(one for one in orbits if one.period == period)
    at_once = track(RIG, old, {"frequency": 15.0}, {"frequency": 15.0 + by})
    places = np.linspace(15.0, 15.0 + by, 21)
    for before, after in itertools.pairwise(places):
        step = track(RIG, old, {"frequency": before}, {"frequency": after})
        assert not step.lost
        old = step.motion
    np.testing.assert_allclose(at_once.motion.points, old.points, rtol=1e-6, atol=1e-9)


def test_it_goes_along_a_branch_and_is_lost_at_its_fold():
    """The resonant response to its fold, and its unstable twin from there back."""
    _, orbits = orbits_of(RIG)
    high = track(RIG, orbits[0], {"frequency": 15.0}, {"frequency": 17.75})
    near = RIG.with_values(frequency=17.75)
    seed = sl.attractors(near, start=tuple(high.motion.points[0]), progress=False)
    branch = sl.branches(near, {"frequency": (17.72, 18.0)}, seed, switch=(), progress=False)
    (fold,) = branch["event_frequency"].values[branch["event_kind"].values == "fold"]
    gone = track(RIG, high.motion, high.values, {"frequency": 18.75})
    low, above = (float(one) for one in re.findall(r"[\d.]+", gone.lost))
    assert gone.lost.startswith("folded between ")
    assert low - 2e-4 <= fold <= above + 2e-4  # the text has so many digits
    assert above - low < 2 * SHORTEST
    unstable = np.flatnonzero(branch["point_stable"].values == 0)
    places = branch["point_frequency"].values[unstable]
    first, last = unstable[[places.argmin(), places.argsort()[len(places) // 2]]]
    points, multipliers = (branch[name].values for name in ("point_x", "point_multiplier_real"))

    def state(row):
        return np.stack([branch[f"point_{name}"].values[row] for name in RIG.states], axis=-1)

    f = branch["point_frequency"].values
    old = ClosedMotion(state(first)[:1], np.zeros(2), 0.0)
    found = track(RIG, old, {"frequency": f[first]}, {"frequency": f[last]})
    np.testing.assert_allclose(found.motion.points[0], state(last)[0], rtol=1e-8)
    assert not found.stable
    leading = multipliers[last][np.abs(multipliers[last]).argmax()]
    assert found.motion.multipliers[0].real == pytest.approx(leading, rel=1e-6)
    assert len(points) > 4


@sl.system(states="x", check_units=False)
def folding(t, x, *, mu=1.0):
    """The normal form of a fold: it rests at +-sqrt(mu)."""
    return (mu - x * x,)


@pytest.mark.nojit
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_equilibrium_folds_where_it_must(side):
    map_ = Stroboscope(folding, sl.Taylor(), every=1.0)
    old = find_equilibria(map_, np.array([[side]]), np.ones((1, 1)))[0]
    found = track(folding, old, {"mu": 1.0}, {"mu": 0.09})
    np.testing.assert_allclose(found.motion.points, [[side * 0.3]], rtol=1e-12)
    assert found.stable == (side > 0)
    np.testing.assert_allclose(found.motion.multipliers, [-2 * side * 0.3], rtol=1e-12)
    gone = track(folding, old, {"mu": 1.0}, {"mu": -0.7})
    assert gone.lost.startswith("folded between ")
    high, low = (float(one) for one in re.findall(r"-?[\d.]+(?:e-?\d+)?", gone.lost))
    assert low < 0 < high < 1.7 * 2 * SHORTEST
    np.testing.assert_allclose(gone.motion.points[0, 0] ** 2, gone.values["mu"], atol=1e-12)


@sl.system(states="x y", check_units=False)
def turning(t, x, y, *, mu=1.0, w=2.0):
    """A limit cycle of radius sqrt(mu), turned at w: r' = r (mu - r^2)."""
    free = mu - x * x - y * y
    return free * x - w * y, free * y + w * x


def test_a_limit_cycle_shrinks_and_turns_as_its_closed_form():
    map_ = Stroboscope(turning, sl.Taylor(), every=1.0)
    old = find_cycles(map_, np.array([[0.99, 0.1]]), np.array([math.pi]), np.full((1, 2), 2.0))[0][
        0
    ]
    found = track(turning, old, {}, {"mu": 0.25, "w": 3.0})
    period = 2 * math.pi / 3.0
    assert found.motion.time == pytest.approx(period, rel=1e-11)
    np.testing.assert_allclose(np.hypot(*found.motion.points.T), 0.5, rtol=1e-10)
    assert found.motion.transverse[0].real == pytest.approx(math.exp(-0.5 * period), rel=1e-8)
    assert found.stable
    assert track(turning, old, {}, {"mu": -1.0}).lost.startswith(("lost", "folded"))


def test_bad_input_is_told():
    old = ClosedMotion(np.zeros((1, 2)), np.zeros(2), 0.0)
    with pytest.raises(ParameterError, match="errors of ODE45"):
        track(oscillator, old, {}, {"f": 0.4}, ODE45())
    with pytest.raises(ParameterError, match="q"):
        track(oscillator, old, {}, {"q": 0.4})
