"""Branches of periodic orbits against folds, doublings and tori that are known otherwise."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import saltus as sl
from saltus.analysis.branches import arclength, tracing
from saltus.analysis.branches.plans import plan_of
from saltus.analysis.branches.seeds import scaled, seeds_of
from saltus.analysis.branches.tracing import trace
from saltus.errors import ParameterError, SaltusError

REFERENCE = Path(__file__).parents[3] / "reference"


def rows(name):
    """Rows of a file of tests/reference by their ids."""
    with (REFERENCE / f"{name}.csv").open() as file:
        return {row["id"]: row for row in csv.DictReader(file)}


RIG = rows("branches_rig")


def orbit_of(row):
    """The first point of a row's orbit: ``x0=... v0=...``."""
    words = dict(word.split("=") for word in row["check"].partition(";")[0].split()[1:])
    return {"x": float(words["x0"]), "v": float(words["v0"])}


def located(found, kind, near):
    """The value of the event of a kind that is nearest to a value."""
    parameter = found.attrs["parameter"]
    at = found[f"event_{parameter}"].values[found.event_kind.values == kind]
    return at[np.argmin(np.abs(at - near))]


@cache
def rig(case, frequency, stiffness, low, high, start, at):
    """Branches of the rig over a parameter."""
    system = sl.models.delangre(case, force="4 N", frequency=frequency, contact_stiffness=stiffness)
    name = "frequency" if high < 100 else "contact_stiffness"
    seeds = sl.bifurcation_diagram(system, {name: [at]}, start=start, progress=False)
    return sl.branches(system, {name: (low, high)}, seeds, longest=1, progress=False)


HIGH = (5e-3, 0.0)
DELANGRE = sl.models.delangre("b", force="4 N")
FOUND = {
    "G02": ("a", 17.0, 14e3, 15.0, 28.5, (-4e-4, 0.0125), 16.0),
    "G05": ("b", 15.0, 14e3, 12.0, 18.5, HIGH, 15.0),
    "G07": ("b", 15.0, 14e3, 12.0, 18.5, HIGH, 15.0),
    "G09": ("c", 5.0, 2e4, 1.2e4, 3.2e4, (0.0, 0.0), 1.4e4),
    "G17": ("c", 17.0, 8e3, 7.5e3, 9e3, (0.0, 0.0), 8e3),
}


@pytest.mark.parametrize("number", FOUND)
def test_folds_and_doublings_of_the_rig(number):
    found, row = rig(*FOUND[number]), RIG[number]
    kind, value = row["quantity"].partition(":")[0].replace(" ", "_"), float(row["value"])
    # grade A: from 40 digits; A-: from a prototype
    digits = 1e-14 if row["grade"] == "A" else 2e-12
    assert located(found, kind, value) == pytest.approx(value, rel=digits)
    assert found.attrs["unexplained_changes"] == 0


#: Rows that are found from an orbit near them: case, parameters, range of the parameter, start.
NEAR = {
    "G03": ("a", {"frequency": 17.73}, (17.7, 17.75)),
    "G11": ("a", {"frequency": 17.4737}, (17.47, 17.478)),
    "G13": ("c", {"frequency": 5.0, "contact_stiffness": 23200.0}, (23190.0, 23300.0)),
}


@pytest.mark.parametrize("number", ["G03", "G13", pytest.param("G11", marks=pytest.mark.nightly)])
def test_folds_of_the_rig_near_an_orbit(number):
    (case, values, reach), row = NEAR[number], RIG[number]
    system = sl.models.delangre(case, force="4 N", **values)
    periods = int(row["parameters"].split(";")[0].removeprefix("n="))
    orbits = sl.periodic_orbits(system, [tuple(orbit_of(row).values())], periods=periods)
    nearest = np.abs(orbits.orbit_x.values - orbit_of(row)["x"]).min(axis=1)
    orbits = orbits.isel(orbit=[np.argmin(np.where(orbits.orbit_period == periods, nearest, 1))])
    found = sl.branches(
        system, {list(values)[-1]: reach}, orbits, longest=periods, switch=(), progress=False
    )
    value = float(row["value"])
    assert located(found, "fold", value) == pytest.approx(value, rel=1e-13)


def test_an_isola_is_closed():
    found = rig(*FOUND["G02"])
    closed = (found.branch_closed.values > 0) & (found.branch_periods.values == 3)
    assert closed.any()
    mine = found.point_frequency.values[found.point_branch.values == np.flatnonzero(closed)[0]]
    assert 27.7 < mine.max() < 27.9
    assert 15.70 < mine.min() < 15.75


def test_the_orbits_between_events_are_as_stable_as_their_multipliers_say():
    found = rig(*FOUND["G05"])
    sizes = np.hypot(found.point_multiplier_real, found.point_multiplier_imag).max("multiplier")
    np.testing.assert_array_equal(found.point_stable.values, sizes.values < 1 - 1e-9)
    assert 0 < found.point_stable.values.mean() < 1
    # Liouville: the product of the multipliers is the damping's
    product = (found.point_multiplier_real + 1j * found.point_multiplier_imag).prod("multiplier")
    damping = np.exp(-2 * 0.03 * 2 * np.pi * 5 * found.point_period.values)
    np.testing.assert_allclose(product.values.real, damping, rtol=1e-9)


def rig_b(t, y, f):
    """Rates of the rig, case b at 4 N, written out; frozen on one side of each gap by ``sides``."""
    x, v = y
    w, wn = 2 * np.pi * f, 2 * np.pi * 5
    beyond = min(x, 0.0) + max(x - 0.4e-3, 0.0)
    restoring = -2 * 0.03 * wn * v - wn**2 * x - 7e8 / 3 * x**3 - 14e3 / 3 * beyond
    return v, restoring + 4 * (1 - 18 / w**2) * np.cos(w * t) / 3


def test_unstable_orbits_close_under_an_independent_solver():
    """DOP853 from contact to contact."""
    found = rig(*FOUND["G05"])
    unstable = np.flatnonzero(found.point_stable.values == 0)
    gaps = [lambda t, y, f, level=level: y[0] - level for level in (0.0, 0.4e-3)]
    for gap in gaps:
        gap.terminal = True
    for i in unstable[[3, len(unstable) // 2, -3]]:
        f, period = float(found.point_frequency[i]), float(found.point_period[i])
        start = np.array([float(found.point_x[i, 0]), float(found.point_v[i, 0])])
        t, y = 0.0, start
        while t < period:
            # a step off the boundary first: an event there would end it at once
            short = solve_ivp(
                rig_b, (t, min(t + 1e-6, period)), y, "DOP853", rtol=1e-13, atol=1e-16, args=(f,)
            )
            run = solve_ivp(
                rig_b, (short.t[-1], period), short.y[:, -1], "DOP853", rtol=1e-13, atol=1e-16,
                args=(f,), events=gaps,
            )  # fmt: skip
            t, y = run.t[-1], run.y[:, -1]
        size = np.hypot(*(found[f"point_multiplier_{part}"][i].values for part in ("real", "imag")))
        assert np.abs((y - start) / [1e-3, 0.1]).max() < 1e-10 * size.max()


#: Unstable orbits of these branches, as many as that; the case of the rig, its other parameters.
TWENTY = {"G02": 6, "G05": 8, "G09": 6}


@pytest.mark.parametrize("number", TWENTY)
@pytest.mark.slow
def test_unstable_orbits_close_under_heyoka(number):
    """20 in all, over their one or three periods, to 1e-10 of their size. A solver whose equations
    were written by hand: tests/oracles.
    """
    pytest.importorskip("heyoka", reason="extra `reference` isn't installed")
    from oracles import heyoka_systems

    found = rig(*FOUND[number])
    case, frequency, stiffness, *_ = FOUND[number]
    system = sl.models.delangre(case, force="4 N", frequency=frequency, contact_stiffness=stiffness)
    unstable = np.flatnonzero(found.point_stable.values == 0)
    chosen = unstable[np.linspace(0, len(unstable) - 1, TWENTY[number]).astype(int)]
    name = found.attrs["parameter"]
    for i in chosen:
        values = dict(system.values) | {name: float(found[f"point_{name}"][i])}
        start = np.array([float(found.point_x[i, 0]), float(found.point_v[i, 0])])
        run = heyoka_systems.simulate("delangre", values, start, float(found.point_period[i]))
        size = np.array([float(found.point_peak[i]), np.abs(run.states[:, 1]).max()])
        assert np.abs((run.end - start) / size).max() < 1e-10


def test_soft_stop():
    known = rows("branches_soft_stop")
    stop = sl.models.soft_stop()
    found = sl.branches(stop, {"frequency": (1.38, 2.8)}, (1.5, 0.0), at=3, progress=False)
    for number in ("S01", "S03"):  # S03 lies 0.03 % below the graze of the response without contact
        value = float(known[number]["value"])
        assert located(found, "fold", value) == pytest.approx(value, rel=1e-12)


def test_two_masses():
    known = rows("branches_two_masses")
    found = sl.branches(
        sl.models.two_masses(), {"frequency": (0.6, 0.76)}, at=1, switch=(), progress=False
    )
    for number in known:
        kind = known[number]["quantity"].partition(":")[0].lower()
        kind, value = kind.replace(" ", "_").replace("-", "_"), float(known[number]["value"])
        assert located(found, kind, value) == pytest.approx(value, abs=2e-12)


def test_a_symmetric_orbit_has_branch_points_and_its_twins_are_one_branch():
    found = sl.branches(
        sl.models.soft_stop(), {"frequency": (0.33, 0.39)}, at=5, longest=1, progress=False
    )
    crossing = found.event_frequency.values[found.event_kind.values == "branch_point"]
    parent = crossing[found.event_branch.values[found.event_kind.values == "branch_point"] == 0]
    child = np.setdiff1d(crossing, parent)
    assert len(parent) == 2
    for value in child:  # located from the other branch too
        assert np.abs(parent - value).min() < 1e-9
    assert (found.branch_parent.values == 0).sum() == 1
    # the mirror of each orbit is on the branch too: largest and smallest value change places
    one = found.isel(point=found.point_branch.values == 1).sel(output="x")
    top, bottom = one.point_output_maximum.values, -one.point_output_minimum.values
    assert (top > bottom + 1e-6).any()
    assert (top < bottom - 1e-6).any()
    assert not found.branch_twin.values.any()


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def ueda(t, x, v, *, force=5.0, omega=1.0):
    return v, -0.1 * v - x**3 + force * sl.cos(omega * t)


def test_of_two_branches_that_are_mirror_images_one_is_followed(monkeypatch):
    starts = {"x": np.linspace(-3, 3, 4), "v": np.linspace(-3, 3, 4)}

    def followed():
        return sl.branches(ueda, {"force": (4.8, 5.0)}, starts, at=1, longest=2, progress=False)

    found = followed()
    monkeypatch.setattr("saltus.analysis.branches.plans.is_symmetric", lambda *_: False)
    every = followed()
    assert not every.branch_twin.values.any()
    twins = found.branch_twin.values == 1
    assert sorted(found.branch_periods.values[twins]) == [1, 2]
    for n in (1, 2):
        listed = (found.branch_periods.values == n).sum() + (
            twins & (found.branch_periods.values == n)
        ).sum()
        assert (every.branch_periods.values == n).sum() == listed
    # the mirror image of the one is the other: their doublings are at one force
    at = every.event_force.values[every.event_kind.values == "period_doubling"]
    assert len(at) == 2
    assert at[0] == pytest.approx(at[1], rel=1e-10)


def test_an_orbit_of_two_periods_ends_where_it_becomes_one_of_one_period():
    """Found at another value of the parameter than the system's own."""
    rig = sl.models.delangre("c", force="4 N", frequency="17 Hz")
    seeds = sl.attractors(rig.with_values(contact_stiffness=8.9e3), (0.0, 0.0))
    assert seeds.attractor_period.values.tolist() == [2]
    vary = {"contact_stiffness": (7.5e3, 9e3)}
    found = sl.branches(rig, vary, seeds, longest=2, switch=(), progress=False)
    double = int(np.flatnonzero(found.branch_periods.values == 2)[0])
    ends = {found.branch_begin.values[double], found.branch_end.values[double]}
    assert ends == {"period_doubling", "range"}
    reached = found.point_contact_stiffness.values[found.point_branch.values == double].min()
    exact = float(RIG["G17"]["value"])
    assert exact < reached < exact * (1 + 1e-4)
    assert 1 in found.branch_periods.values  # and that one is followed too
    with pytest.raises(ParameterError, match=r"orbits at force = 4, but the system .* force = 3"):
        sl.branches(rig.with_values(force=3.0), vary, seeds, progress=False)


def test_a_fold_and_a_graze_next_to_each_other_are_both_found():
    """9.7 N/m apart, 0.05 % of the range."""
    found = rig(*FOUND["G09"])
    at = found.event_contact_stiffness.values
    near = np.flatnonzero(np.abs(at - 29252) < 10)
    assert sorted(found.event_kind.values[near]) == ["fold", "graze"]
    assert found.attrs["unexplained_changes"] == 0


@sl.system(states="p q u w", forced_at="frequency")
def gears(t, p, q, u, w, *, gap=0.004, frequency=5.7):
    """A pair of gears with backlash; its T orbits turn back twice within 0.01 Hz, and again."""
    mesh = sl.freeplay(p - q, stiffness=500.0, gap=gap) + 0.2 * (u - w)
    drive = 1.0 + 2.0 * sl.cos(2 * sl.pi * frequency * t)
    return u, w, (drive - mesh - 20 * p - 0.05 * u) / 0.01, (mesh - 1.0 - 20 * q - 0.05 * w) / 0.02


def at_rest(vary, **more):
    """Branches of the gears from rest."""
    return sl.branches(gears, {"frequency": vary}, (0.0,) * 4, progress=False, **more)


@pytest.mark.slow
def test_a_loop_within_a_step_is_followed_by_shorter_ones():
    """Of which changes of stability tell that don't add up."""
    whole, near = at_rest((5.6, 5.8), switch=(), at=2), at_rest((5.65, 5.66), switch=(), at=2)
    for found in (whole, near):
        assert found.attrs["unexplained_changes"] == 0
        assert (found.branch_periods == 1).all()
        assert not found.branch_closed.any()
    folds = [located(whole, "fold", value) for value in (5.6526, 5.6578)]
    np.testing.assert_allclose(folds, [located(near, "fold", value) for value in folds], rtol=1e-11)


@pytest.mark.slow
def test_at_each_bifurcation_a_multiplier_lies_on_the_unit_circle():
    """Also where a test of stability changes its sign between branches that run alongside."""
    found = at_rest((5.62, 5.7), switch=(), at=2)
    own = found.event_multiplier_real.values + 1j * found.event_multiplier_imag.values
    for kind, where in (("fold", 1.0), ("period_doubling", -1.0)):
        these = own[found.event_kind.values == kind]
        assert len(these)
        assert np.abs(these - where).min(axis=1).max() < 1e-6


@pytest.mark.slow
def test_each_doubling_is_the_end_of_a_branch_of_twice_the_period():
    """Though those curve away from their beginning within a thousandth of the range."""
    found = at_rest((5.61, 6.35))
    values, of = found.point_frequency.values, found.point_branch.values
    ends = [values[of == i][[0, -1]] for i in np.flatnonzero(found.branch_periods.values == 2)]
    for kind, at, branch in zip(
        found.event_kind.values, found.event_frequency.values, found.event_branch.values,
        strict=True,
    ):  # fmt: skip
        if kind == "period_doubling" and found.branch_periods.values[branch] == 1:
            assert np.abs(np.array(ends) - at).min() < 1e-3


def test_a_limit_cycle_is_followed_with_its_period():
    """Van der Pol's: the multiplier is exp(mu integral(1 - x**2)); the period is known."""

    @sl.system(states="x v")
    def oscillator(t, x, v, *, mu=1.0):
        return v, mu * (1 - x**2) * v - x

    found = sl.branches(oscillator, {"mu": (0.5, 2.0)}, (2.0, 0.0), at=1, every=7.0, progress=False)
    assert found.sizes["event"] == 0
    assert found.branch_kind.values.tolist() == ["equilibrium", "limit_cycle"]
    cycles = found.point_branch.values == 1
    at = np.flatnonzero(cycles & (found.point_mu.values == 2.0))[0]
    # Andersen & Geer, SIAM J. Appl. Math. 42 (1982) 678: T(2) = 7.62987448
    assert found.point_period.values[at] == pytest.approx(7.62987448, abs=2e-8)
    assert (found.point_stable.values == cycles).all()


def test_what_cannot_be_followed_is_refused():
    rig_a = sl.models.delangre("a")
    for arguments, words in (
        (({"frequency": (20.0, 10.0)},), "must ascend"),
        (({"frequenzy": (10.0, 20.0)},), "Did you mean"),
        (({"frequency": (1.0, 2.0), "force": (1, 2)},), "one parameter"),
        (({"frequency": (10.0, 20.0)}, xr.Dataset()), "start="),
    ):
        with pytest.raises(ParameterError, match=words):
            sl.branches(rig_a, *arguments)
    with pytest.raises(ParameterError, match="errors are rounding"):
        sl.branches(rig_a, {"frequency": (10.0, 20.0)}, method=sl.ODE45(1e-4, 1e-7))
    with pytest.raises(ParameterError, match="switch="):
        sl.branches(rig_a, {"frequency": (10.0, 20.0)}, switch="folds")


def test_responses_and_the_unstable_orbits_between_them_in_one_dataset():
    """The S-shaped branch and the isola of case c at 5 Hz, from one call."""
    system = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    found = sl.bifurcation_diagram(
        system, {"contact_stiffness": [14e3, 18e3, 22e3]}, "random 8",
        box={"x": (-5e-3, 5e-3), "v": (-0.5, 0.5)}, unstable=True, progress=False,
    )  # fmt: skip
    for number in ("G09", "G15"):
        value = float(RIG[number]["value"])
        at = found.event_contact_stiffness.values
        assert at[np.argmin(np.abs(at - value))] == pytest.approx(value, rel=2e-12)
    of = found.response_branch.values
    assert (of >= 0).all()
    for i, branch in enumerate(of):
        mine = found.point_contact_stiffness.values[found.point_branch.values == branch]
        assert mine.min() <= found.response_contact_stiffness.values[i] <= mine.max()
    with pytest.raises(ParameterError, match="this grid has two"):
        sl.bifurcation_diagram(
            system, {"contact_stiffness": [1e4], "force": [4.0]}, unstable=True, progress=False
        )


def test_the_limit_cycle_of_a_wing_begins_at_a_fold():
    """Found from two airspeeds, the cycle is one branch; at its fold a multiplier besides the
    trivial one is 1, and two cycles meet whose periods differ like a square root.
    """
    wing = sl.models.aeroelastic()
    start = {"plunge": 0, "pitch": "2 deg", "plunge_rate": 0, "pitch_rate": 0}
    found = sl.branches(
        wing, {"airspeed": ("9 m/s", "11 m/s")}, start, every="0.25 s", at=3, switch=(),
        progress=False,
    )  # fmt: skip
    assert found.branch_kind.values.tolist() == ["equilibrium", "limit_cycle"]
    assert found.event_kind.values.tolist() == ["fold"]
    found = found.isel(point=found.point_branch.values == 1)
    assert found.event_multiplier_real.values[0, 0] == pytest.approx(1.0, abs=1e-9)
    fold, speed = float(found.event_airspeed[0]), found.point_airspeed.values
    assert (speed >= fold).all()
    stable = found.point_stable.values > 0
    gaps = []
    for distance in (0.01, 0.04):
        sides = [
            np.interp(fold + distance, speed[mine][order], found.point_peak.values[mine][order])
            for mine in (stable, ~stable)
            for order in [np.argsort(speed[mine])]
        ]
        gaps.append(sides[0] - sides[1])
    assert gaps[1] / gaps[0] == pytest.approx(2.0, rel=0.1)


def test_wrong_units_and_odd_arguments_are_answered_in_a_sentence():
    rig_b = sl.models.delangre("b")
    for arguments, words in (
        ({"vary": {"frequency": ("12 mm", "20 Hz")}}, "mm"),
        ({"vary": {"frequency": ("12 Hz", float("nan"))}}, "finite"),
        ({"vary": {"frequency": "12 Hz"}}, r"\(low, high\)"),
        ({"vary": {"frequency": (10.0, 20.0)}, "switch": 3}, "switch=3"),
        ({"vary": {"frequency": (10.0, 20.0)}, "start": (float("nan"), 0)}, "finite"),
    ):
        with pytest.raises(SaltusError, match=words):
            sl.branches(rig_b, **arguments)


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def swing(t, x, v, *, c=0.1, depth=0.2, cubic=0.2, omega=2.0):
    return v, -c * v - (1 + depth * sl.cos(omega * t)) * x - cubic * x**3


def hill_determinant(omega, depth, c=0.1):
    """Zero where x'' + c x' + (1 + depth cos(omega t)) x = 0 has a motion of two periods."""
    rates = (np.arange(-8, 8) + 0.5) * omega
    band = np.diag(np.full(15, 0.5 * depth), 1)
    return np.linalg.det((np.diag(1 - rates**2 + 1j * c * rates) + band + band.T) / rates**2).real


@pytest.mark.parametrize("depth", [0.2001, 0.201, 0.21])
def test_a_tongue_narrower_than_a_step_of_the_branch_is_found(depth):
    system = swing.with_values(depth=depth)
    found = sl.branches(system, {"omega": (1.4, 2.7)}, (0, 0), at=1, longest=1, progress=False)
    assert found.event_kind.values.tolist() == 2 * ["period_doubling"]
    first, last = found.event_omega.values
    assert last - first < 0.07
    for omega in (first, last):
        ends = (omega - 1e-3, omega + 1e-3)
        assert omega == pytest.approx(brentq(hill_determinant, *ends, args=(depth,)), rel=1e-11)


def test_the_ball_that_chatters_and_rests_at_whole_periods_is_one_branch():
    """It rests on the table there: x = 0 at the table's own velocity, and forgets everything."""
    found = sl.branches(
        sl.models.bouncing_ball(), {"amplitude": (0.6, 1.5)}, (2.0, 0.0), at=2, progress=False
    )
    assert found.sizes["branch"] == 1
    assert found.sizes["point"] < 100
    assert {found.branch_begin.item(), found.branch_end.item()} == {"range"}
    np.testing.assert_allclose(found.point_x, 0.0, atol=1e-13)
    np.testing.assert_allclose(found.point_v[:, 0], found.point_amplitude, rtol=1e-13)
    assert np.abs(found.point_multiplier_real).max() < 1e-6  # a double zero: roots of rounding


@cache
def seeds():
    """Orbits of one to eight periods, several on a branch."""
    found = sl.frequency_response(
        DELANGRE, ("15 Hz", "16 Hz", 3), {"x": [5e-3, 0.0], "v": [0.0, 0.0]}, progress=False
    )
    return scaled(DELANGRE, "frequency", seeds_of(DELANGRE, "frequency", found), sl.Taylor())


def test_derivatives_of_a_branch_are_those_at_its_own_points():
    """Its curve was followed by derivatives a step of Newton's method away."""
    plan = plan_of(DELANGRE, "frequency", (10.0, 20.0), sl.Taylor(), 1, 200, 1, ())
    branches = []
    trace(plan, seeds()[:1], branches)
    (branch,) = branches
    assert len(branch.z) > 50
    residual, derivative = branch.orbits.evaluate(branch.z, np.zeros(len(branch.z), np.int64))
    assert np.abs(residual).max() < 1e-13
    np.testing.assert_allclose(branch.derivative, derivative, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_branches_followed_side_by_side_are_those_followed_one_after_the_other(monkeypatch):
    """Also if whoever comes by where another began is taken to be on its branch."""
    doubled = frozenset({"period_doubling"})
    plan = plan_of(DELANGRE, "frequency", (15.0, 16.0), sl.Taylor(), 1, 400, 2, doubled)
    found, passed = [], arclength._passed
    for name in ("", "alone", "blind"):
        with monkeypatch.context() as patched:
            if name == "alone":
                patched.setattr(tracing, "ABREAST", 0)
            if name == "blind":
                patched.setattr(
                    arclength, "_passed", lambda *a, either_way=False: either_way or passed(*a)
                )
            branches = []
            trace(plan, seeds(), branches)
        found.append(branches)
    assert len(found[0]) > 2
    for other in found[1:]:
        assert [one.ends for one in other] == [one.ends for one in found[0]]
        assert [one.parent for one in other] == [one.parent for one in found[0]]
        for one, same in zip(other, found[0], strict=True):
            places = [[event.z[-1] for event in branch.events] for branch in (one, same)]
            np.testing.assert_allclose(places[0], places[1], rtol=1e-10)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_random_ranges_have_the_same_events_side_by_side_and_alone(monkeypatch, seed):
    """The rig in one of its three cases, with a random force, over a random range."""
    rng = np.random.default_rng(seed)
    system = sl.models.delangre(str(rng.choice(["a", "b", "c"])), force=float(rng.uniform(1.5, 5)))
    low = float(rng.uniform(5.0, 18.0))
    found = []
    for abreast in (tracing.ABREAST, 0):
        monkeypatch.setattr(tracing, "ABREAST", abreast)
        found.append(sl.frequency_response(
            system, (low, low + 1.5, 4), "random 6",
            box={"x": ("-5 mm", "5 mm"), "v": ("-0.5 m/s", "0.5 m/s")}, unstable=True,
            progress=False,
        ))  # fmt: skip
    beside, alone = found
    for name in ("branch_periods", "branch_closed", "event_kind", "branch_unexplained"):
        np.testing.assert_array_equal(beside[name].values, alone[name].values)
    np.testing.assert_allclose(beside.event_frequency, alone.event_frequency, rtol=1e-9)
