"""Periodic orbits of flows, unstable ones too, against closed forms, an independent solver and
invariants.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impact_orbits
import saltus as sl
from saltus.analysis.closed.periodic_orbits import CONTACTS, STEPS
from saltus.flow.maps import Stroboscope
from saltus.flow.shots import Shots
from saltus.kernels import status as st

RIG_BOX = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
RECIPES = {
    "stiffness": 1.0, "damping": 0.1, "gap": 1.0, "restitution": 0.8, "force": 0.3,
    "frequency": 1.2,
}  # fmt: skip


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def duffing(t, x, v, *, w=1.0, d=0.05, force=7.5):
    """Ueda's oscillator."""
    return v, -d * v - x**3 + force * sl.cos(w * t)


@pytest.fixture(scope="module")
def rig():
    system = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    return sl.periodic_orbits(system, "random 400", box=RIG_BOX)


@pytest.fixture(scope="module")
def ueda():
    return sl.periodic_orbits(duffing, "random 300", box={"x": (-4, 4), "v": (-8, 8)}, periods=2)


def multipliers(found):
    return found.orbit_multiplier_real.values + 1j * found.orbit_multiplier_imag.values


def test_the_saddle_and_the_stable_orbit_of_an_impact_oscillator():
    """Both orbits with one impact in a period have closed forms; so has the multiplier."""
    with (Path(__file__).parents[1] / "reference" / "laws_impact.csv").open() as file:
        known = {row["id"]: row["value"] for row in csv.DictReader(file)}
    system = sl.models.impact_oscillator(**RECIPES)
    found = sl.periodic_orbits(
        system, "random 200", box={"x": (-1.5, 0.9), "v": (-2, 2)}, periods=1
    )
    one_impact = found.isel(orbit=found.orbit_contacts.values == 1)
    points = np.stack([one_impact.orbit_x.values[:, 0], one_impact.orbit_v.values[:, 0]], axis=1)
    (_, saddle), (_, stable) = impact_orbits.oscillator(**RECIPES)
    of = {int(flag): point for flag, point in zip(one_impact.orbit_stable, points, strict=True)}
    assert of[0] == pytest.approx(saddle, abs=1e-11)
    assert of[1] == pytest.approx(stable, abs=1e-11)
    (where,) = np.flatnonzero(one_impact.orbit_stable.values == 0)
    assert multipliers(one_impact)[where, 0] == pytest.approx(float(known["I04m"]), rel=1e-10)
    assert one_impact.orbit_stability.values[where] == "saddle"


def test_the_three_period_response_of_the_rig_has_its_saddle(rig):
    """A closed branch in frequency has two sides: one stable, one not."""
    three = rig.isel(orbit=rig.orbit_period.values == 3)
    assert sorted(three.orbit_stability.values) == ["saddle", "stable focus"]


def test_a_branch_goes_on_from_an_unstable_orbit(rig):
    """From the saddle of the 3T response round the fold where both sides meet (row G02 of
    tests/reference/branches_rig.csv).
    """
    system = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    chosen = (rig.orbit_period.values == 3) & (rig.orbit_stable.values == 0)
    branch = sl.branches(system, {"frequency": ("15 Hz", "17.2 Hz")}, start=rig.isel(orbit=chosen))
    folds = branch.event_frequency.values[branch.event_kind.values == "fold"]
    assert folds == pytest.approx([15.70602680244704], abs=1e-9)


def test_the_stable_ones_are_the_attractors(rig):
    system = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    start = np.stack([rig.orbit_x.values[:, 0], rig.orbit_v.values[:, 0]], axis=1)
    stable = rig.orbit_stable.values == 1
    known = sl.attractors(system, start[stable])
    assert known.attractor_period.values.tolist() == rig.orbit_period.values[stable].tolist()
    assert known.attractor_rms.values == pytest.approx(rig.orbit_rms.values[stable], rel=1e-10)
    assert known.attractor_margin.values == pytest.approx(rig.orbit_margin.values[stable], rel=1e-6)


def test_areas_shrink_by_the_damping(rig):
    """det M = exp(-integral of the damping) over one period of the orbit."""
    system = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    rate = 2 * system.values["damping_ratio"] * 2 * math.pi * system.values["natural_frequency"]
    exact = np.exp(-rate * rig.orbit_period.values / 17.0)
    assert np.prod(multipliers(rig), axis=1).real == pytest.approx(exact, rel=1e-11)


def test_an_independent_solver_closes_them(ueda):
    """Over one forcing period each, DOP853 at 1e-13 comes from each point to the next."""
    unstable = ueda.isel(orbit=ueda.orbit_stable.values == 0)
    assert unstable.sizes["orbit"] >= 4
    for i in range(unstable.sizes["orbit"]):
        n = int(unstable.orbit_period[i])
        points = np.stack([unstable.orbit_x.values[i, :n], unstable.orbit_v.values[i, :n]], axis=1)
        for here, there in zip(points, np.roll(points, -1, axis=0), strict=True):
            run = solve_ivp(
                lambda t, y: [y[1], -0.05 * y[1] - y[0] ** 3 + 7.5 * np.cos(t)],
                (0.0, 2 * np.pi),
                here,
                "DOP853",
                rtol=1e-13,
                atol=1e-13,
            )
            assert run.y[:, -1] == pytest.approx(there, abs=1e-10)


def test_the_mirror_image_of_an_orbit_is_one(ueda):
    """The equation is the same for -x half a period later: orbits that aren't their own images
    come in pairs, with the same multipliers.
    """
    first = np.sort_complex(np.round(multipliers(ueda)[ueda.orbit_period.values == 2, 0], 8))
    assert len(first) % 2 == 0
    assert (first[::2] == first[1::2]).all()


@sl.system(states="x v")
def pushed_once(t, x, v):
    """A pulse of force at t = 3."""
    return v, sl.exp(-((t - 3) ** 2)) - x - 0.1 * v


def test_refusals():
    with pytest.raises(sl.SaltusError, match="depends on time, without a forcing period"):
        sl.periodic_orbits(pushed_once, (0.1, 0.0))
    with pytest.raises(sl.SaltusError, match=r"is forced: .* Give periods="):
        sl.periodic_orbits(duffing, (0.0, 0.0), period="1 s")
    with pytest.raises(sl.SaltusError, match=r"found by sl\.periodic_orbits"):
        sl.edge_orbit(sl.models.double_scroll(), (0.1, 0.0, 0.0), (0.2, 0.0, 0.0))
    with pytest.raises(sl.SaltusError, match="errors of ODE45"):
        sl.periodic_orbits(duffing, (0.0, 0.0), method=sl.ODE45())


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def hardening(t, x, v, *, w=1.6, force=0.3):
    """A spring whose force grows with the cube: far out it swings as fast as it is far out."""
    return v, -0.1 * v - x - x**3 + force * sl.cos(w * t)


@pytest.fixture(scope="module")
def from_far_away_too():
    starts = {"x": [0.0, 1e6, 1.5, -1e7], "v": [0.0, 0.0, 0.3, 1e8]}
    return sl.periodic_orbits(hardening, starts, periods=1, method=sl.Taylor(max_steps=3000))


def test_starts_whose_motion_is_too_fast_to_be_followed_are_given_up(from_far_away_too):
    """Undamped, x'' = -x^3 swings from 1e6 with 0.847e6 rad/s: 530 thousand times a period."""
    assert from_far_away_too.search_given_up.values.tolist() == [2]
    assert "given up 2 starts" in sl.describe(from_far_away_too)


def test_starts_that_are_given_up_change_nothing(from_far_away_too):
    starts = {"x": [0.0, 1.5], "v": [0.0, 0.3]}
    alone = sl.periodic_orbits(hardening, starts, periods=1)
    assert alone.search_given_up.values.tolist() == [0]
    assert from_far_away_too.orbit_x.values == pytest.approx(alone.orbit_x.values, abs=1e-12)
    assert from_far_away_too.sizes["orbit"] == alone.sizes["orbit"] == 3


@pytest.fixture
def counters(monkeypatch):
    """Those of all flights that are launched."""
    counted, launched = [], Stroboscope.launch

    def watched(map_, start, longest):
        flight = launched(map_, start, longest)
        counted.append(flight._arrays["counters"])
        return flight

    monkeypatch.setattr(Stroboscope, "launch", watched)
    return counted


def test_a_search_has_a_budget_of_its_own(counters):
    """From 1e4 a period is 5300 swings, some hundred thousand steps; thirteen are followed."""
    found = sl.periodic_orbits(hardening, {"x": 1e4, "v": 0.0}, periods=1)
    assert found.search_given_up.values.tolist() == [1]
    assert max(one[:, st.STEPS].max() for one in counters) <= 13 * STEPS + 1


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def table(t, x, v, *, a=0.3, e=0.9, w=1.0):
    """A ball on a table whose impacts are jumps: nothing says that it may come to rest there."""
    up = a * w * sl.cos(w * t)
    return v, -1.0, sl.jump(x < a * sl.sin(w * t), v=up - e * (v - up))


def test_starts_that_chatter_without_end_are_given_up(counters):
    """With one impact a period the ball leaves with the velocity pi, at the phase p of the table
    where pi (1 - e) = (1 + e) a cos p; it rises to a sin p + pi^2 / 2.
    """
    box = {"x": (0.3, 5.3), "v": (-3, 6)}
    found = sl.periodic_orbits(table, "random 40", box=box, periods=1)
    assert 0 < found.search_given_up.item() < 20
    assert max(one[:, st.EVENTS].max() for one in counters) <= 13 * CONTACTS + 1
    lift = 0.3 * np.sin(np.arccos(np.pi * 0.1 / (1.9 * 0.3)))
    assert np.sort(found.orbit_peak) == pytest.approx(np.pi**2 / 2 + lift * np.array([-1, 1]))
    assert sorted(found.orbit_stable.values.tolist()) == [0, 1]
    assert "or allow more: method=sl.Taylor(max_steps=..., max_events=...)" in sl.describe(found)


def test_newton_s_method_has_a_budget_for_one_period(monkeypatch):
    """It is led into chatters that none of the starts ends in: the table throws the ball."""
    counted, run = [], Shots.run

    def watched(shots, *arguments):
        ends = run(shots, *arguments)
        counted.append(shots.counters.max(axis=0, initial=0))
        return ends

    monkeypatch.setattr(Shots, "run", watched)
    box = {"x": (1.2, 6.2), "v": (-3, 6)}
    thrown = table.with_values(a=1.2)
    found = sl.periodic_orbits(thrown, "random 50", box=box, periods=1)
    assert found.search_given_up.item() == 0
    most = np.max(counted, axis=0)
    assert most[st.EVENTS] <= CONTACTS + 1
    assert most[st.STEPS] <= STEPS + 1


def test_limit_cycles_are_looked_for_from_motions_that_can_be_followed():
    """The unit circle, of period 2 pi; with two steps no motion is followed for twelve turns."""

    @sl.system(states="x v")
    def relaxed(t, x, v):
        return v, (1 - x**2 - v**2) * v - x

    near = {"x": [0.5, 1e-3], "v": [0.0, 0.1]}
    found = sl.periodic_orbits(relaxed, near, period=("4 s", "8 s"), method=sl.Taylor(max_steps=2))
    assert found.search_given_up.values.tolist() == [2]
    assert found.sizes["orbit"] == 0
    found = sl.periodic_orbits(relaxed, near, period=("4 s", "8 s"))
    assert found.search_given_up.values.tolist() == [0]
    assert found.orbit_cycle.values == pytest.approx([2 * np.pi], rel=1e-12)
