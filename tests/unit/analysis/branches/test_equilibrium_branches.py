"""Branches of equilibria, and of the limit cycles born on them, against closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus as sl


@sl.system(states="x")
def pitchfork(t, x, *, load=0.0):
    """Equilibria at 0 and at the square roots of the load."""
    return load * x - x**3


@sl.system(states="x")
def cusped(t, x, *, load=0.0, left=2.0, right=3.0):
    """Equilibria at load/left below the boundary, and at load/right beyond it."""
    return load - sl.piecewise((right * x, x > 0), otherwise=left * x)


@sl.system(states="x v")
def brusselator(t, x, v, *, feed=1.0, excess=2.5):
    """At rest at (feed, excess/feed); a Hopf point at excess = 1 + feed**2, of frequency feed."""
    return feed - (excess + 1.0) * x + x**2 * v, excess * x - x**2 * v


@sl.system(states="x v")
def bistable(t, x, v, *, load=0.0):
    """Equilibria where load = x**3 - x: folds at x**2 = 1/3."""
    return v, load + x - x**3 - 0.4 * v


@sl.system(states="x")
def wrinkled(t, x, *, load=0.0, width=0.0005):
    """Equilibria on an S, with a loop near x = 0 that is far narrower than a step."""
    return load - x + x**3 + 2 * width * sl.tanh(x / width)


def events(found):
    """Kind, value of the parameter and outcome of every event."""
    name = found.attrs["parameter"]
    columns = ("event_kind", f"event_{name}", "event_outcome")
    return list(zip(*(found[one].values.tolist() for one in columns), strict=True))


def of_rests(system, vary, **start):
    """Branches from the equilibria of a system."""
    return sl.branches(system, vary, sl.equilibria(system, **start), progress=False)


def test_a_pitchfork():
    system = pitchfork.with_values(load=0.5)
    found = of_rests(system, {"load": (-1.0, 1.0)}, x=(-2.0, 2.0))
    assert found.sizes["branch"] == 2  # the line, and the parabola
    assert found.event_kind.values.tolist() == 2 * ["branch_point"]
    np.testing.assert_allclose(found.event_load, 0.0, atol=1e-12)
    assert set(found.branch_kind.values) == {"equilibrium"}
    assert (found.branch_periods == 0).all()
    assert found.attrs["unexplained_changes"] == 0
    x, load = found.point_x.values[:, 0], found.point_load.values
    line = int(np.argmin([abs(x[found.point_branch.values == i]).max() for i in (0, 1)]))
    off = found.point_branch.values != line
    # at the branch point itself the equation is singular: there the field is zero to rounding
    np.testing.assert_allclose(x * (load - x**2), 0.0, atol=1e-13)
    far = off & (np.abs(x) > 0.02)  # nearer, the rounding of the field over x is more
    assert far.any()
    np.testing.assert_allclose(x[far] ** 2, load[far], atol=1e-12)
    np.testing.assert_allclose(x[~off], 0.0, atol=1e-12)
    np.testing.assert_array_equal(found.point_stable.values[~off], load[~off] < 0)
    np.testing.assert_allclose(
        found.point_eigenvalue_real.values[:, 0], load - 3 * x**2, atol=1e-12
    )
    assert np.isnan(found.point_multiplier_real).all()
    assert np.isnan(found.point_period).all()


def test_folds_of_equilibria():
    found = of_rests(bistable, {"load": (-0.6, 0.6)}, x=(-2.0, 2.0))
    assert found.sizes["branch"] == 1
    assert [kind for kind, _, _ in events(found)] == ["fold", "fold"]
    at = np.sort(found.event_load.values)
    np.testing.assert_allclose(at, np.array([-2.0, 2.0]) / np.sqrt(27.0), rtol=1e-14)
    np.testing.assert_allclose(np.abs(found.event_x.values), np.sqrt(1 / 3), rtol=1e-12)
    stable = np.abs(found.point_x.values[:, 0]) > np.sqrt(1 / 3)
    np.testing.assert_array_equal(found.point_stable.values, stable)


@pytest.mark.parametrize(("left", "outcome"), [(2.0, "persistence"), (-2.0, "nonsmooth_fold")])
def test_a_boundary_equilibrium(left, outcome):
    system = cusped.with_values(left=left, load=0.5)
    found = of_rests(system, {"load": (-0.7, 1.0)}, x=(-2.0, 2.0))
    (event,) = events(found)
    assert event == ("boundary_equilibrium", pytest.approx(0.0, abs=1e-14), outcome)
    assert found.event_guard.values.tolist() == ["x = 0"]
    assert found.sizes["branch"] == 2
    x, load = found.point_x.values[:, 0], found.point_load.values
    np.testing.assert_allclose(x, load / np.where(x > 0, 3.0, left), atol=1e-12)
    np.testing.assert_allclose(found.point_margin, np.abs(x), atol=1e-12)
    assert (load.min() == -0.7) == (outcome == "persistence")


@cache
def chemical():
    """Branches of the Brusselator from one start."""
    return sl.branches(
        brusselator, {"excess": (1.2, 3.0)}, (1.0, 2.0), at=1, every=0.5, progress=False
    )


def test_a_limit_cycle_leaves_a_hopf_point():
    found = chemical()
    assert found.branch_kind.values.tolist() == ["equilibrium", "limit_cycle"]
    assert found.branch_parent.values.tolist() == [-1, 0]
    assert found.branch_begin.values.tolist() == ["range", "branch"]
    (event,) = events(found)
    assert event == ("hopf", pytest.approx(2.0, rel=1e-14), "supercritical")
    assert found.event_eigenvalue_imag.values[0, 0] == pytest.approx(1.0, rel=1e-13)
    rest = found.point_branch.values == 0
    excess, x, v = found.point_excess.values, found.point_x.values, found.point_v.values
    np.testing.assert_allclose(x[rest, 0], 1.0, rtol=1e-13)
    np.testing.assert_allclose(v[rest, 0], excess[rest], rtol=1e-13)
    np.testing.assert_array_equal(found.point_stable.values[rest], excess[rest] < 2.0)
    assert found.point_stable.values[~rest].all()
    assert found.attrs["unexplained_changes"] == 0


def test_small_cycles_have_the_period_and_the_size_of_the_hopf_point():
    """Both are even in the amplitude: the size squared is proportional to the distance."""
    found = chemical()
    cycles = found.isel(point=found.point_branch.values == 1)
    distance = cycles.point_excess.values - 2.0
    size = 0.5 * cycles.point_output_peak_to_peak.sel(output="x").values
    small = (distance > 0) & (size < 0.05)
    assert small.sum() > 2
    ratio = size[small] ** 2 / distance[small]
    assert np.ptp(ratio) < 0.01 * ratio.mean()
    # x'' of the normal form: Kuznetsov (2004), example 3.1: radius**2 = 4/3 of the distance
    assert ratio.mean() == pytest.approx(4.0 / 3.0, rel=0.01)
    np.testing.assert_allclose(cycles.point_period.values[small], 2 * np.pi, rtol=1e-3)


def test_a_cycle_that_shrinks_ends_at_its_hopf_point():
    """Followed from a large one alone."""
    seeds = sl.attractors(
        brusselator.with_values(excess=2.5), (1.0, 2.0), every=0.5, progress=False
    )
    found = sl.branches(brusselator, {"excess": (1.2, 3.0)}, seeds, progress=False)
    assert found.branch_kind.values.tolist() == ["limit_cycle"]
    assert "hopf" in (found.branch_begin.values[0], found.branch_end.values[0])
    assert found.point_excess.values.min() == pytest.approx(2.0, abs=1e-3)


@pytest.mark.slow
def test_the_hopf_point_and_the_graze_of_a_relief_valve():
    """Values of an independent solution: Newton's method on defining systems in mpmath."""
    valve = sl.models.relief_valve()
    found = sl.branches(
        valve, {"flow": (5.0, 10.0)}, sl.equilibria(valve.with_values(flow=9.0)), progress=False
    )
    assert [one[0] for one in events(found)] == [
        "hopf", "graze", "period_doubling",
        "graze", "period_doubling", "graze",  # of the cycle of twice the period
    ]  # fmt: skip
    assert found.event_flow.values[0] == pytest.approx(8.4911176351833271, rel=1e-14)
    assert found.event_eigenvalue_imag.values[0, 0] == pytest.approx(3.0907088479743406, rel=1e-13)
    assert found.event_flow.values[1] == pytest.approx(7.557210972, abs=6e-10)
    # behind the graze the cycle hits its seat and is unstable, multiplier -3e4 and less; at last it
    # is the one that a motion settles on
    assert found.point_multiplier_real.min() < -1e4
    last = found.isel(point=np.flatnonzero(found.point_branch == 1)).sortby("point_flow")
    last = last.isel(point=0)
    assert float(last.point_flow) == 5.0
    assert last.point_itinerary.item() == "x = 0-"
    settled = sl.attractors(valve.with_values(flow=5.0), (1.0, 0.0, 6.0), every=1.0, progress=False)
    assert settled.attractor_cycle.item() == pytest.approx(float(last.point_period), rel=1e-9)
    settled_multiplier = settled.attractor_multiplier_real.values[0].min()
    assert settled_multiplier == pytest.approx(last.point_multiplier_real.min().item(), abs=1e-7)
    # the cycle of two turns and one impact is born at the same graze
    assert found.event_flow.values[5] == pytest.approx(found.event_flow.values[1], rel=1e-12)
    twice = found.isel(point=np.flatnonzero(found.point_branch == 2))
    assert "x = 0-" in twice.point_itinerary.values


def test_the_cycles_of_a_linear_centre_are_one_family():
    """The double scroll is linear about its outer rests: all small cycles have one parameter."""
    chua = sl.models.double_scroll()
    rests = sl.equilibria(chua.with_values(alpha=6.0))
    found = sl.branches(chua, {"alpha": (6.0, 7.0)}, rests, progress=False)
    kinds = found.event_kind.values.tolist()
    assert kinds.count("hopf") == 2
    assert kinds.count("graze") == 1  # on one of two mirror images
    assert len(kinds) == 3
    np.testing.assert_allclose(np.ptp(found.event_alpha.values), 0.0, atol=1e-9)
    assert found.attrs["unexplained_changes"] == 0


def test_a_branch_makes_room_for_one_with_a_loop_that_it_stepped_over():
    """A seed outside the loop comes first, and a step passes over it; the next one lies in it."""
    seeds = sl.equilibria(wrinkled, x=(-2.0, 2.0))
    assert seeds.sizes["equilibrium"] == 5
    found = sl.branches(wrinkled, {"load": (-0.2, 0.2)}, seeds, progress=False)
    assert found.sizes["branch"] == 3
    width = wrinkled.values["width"]
    turn = brentq(lambda x: 1 - 3 * x**2 - 2 / np.cosh(x / width) ** 2, width / 50, 2 * width)
    fold = 2 * width * np.tanh(turn / width) - turn + turn**3
    assert [kind for kind, _, _ in events(found)] == ["fold", "fold"]
    np.testing.assert_allclose(np.sort(found.event_load), [-fold, fold], rtol=1e-9)


def test_a_branch_that_stops_early_says_so():
    found = of_rests(wrinkled, {"load": (-0.2, 0.2)}, x=(-2.0, -0.5))
    assert "stopped" not in sl.describe(found)
    seeds = sl.equilibria(wrinkled, x=(-2.0, -0.5))
    few = sl.branches(wrinkled, {"load": (-0.2, 0.2)}, seeds, points=3, progress=False)
    assert "stopped by points= at" in sl.describe(few)
