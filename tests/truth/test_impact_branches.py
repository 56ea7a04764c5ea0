"""Branches of orbits with impacts, against closed forms."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impact_orbits
import saltus as sl
from saltus.flow.maps import Stroboscope

REFERENCE = Path(__file__).parents[1] / "reference"


@cache
def rows(name):
    with (REFERENCE / f"{name}.csv").open() as file:
        return {row["id"]: row["value"] for row in csv.DictReader(file)}


def nearest(found, kind, exact):
    at = found[f"event_{found.attrs['parameter']}"].values[found.event_kind.values == kind]
    return at[np.abs(at - exact).argmin()]


IMPACT = sl.models.impact_oscillator


@pytest.mark.parametrize(("number", "restitution"), [("I10", 0.8), ("I12", 0.5)])
def test_an_oscillator_whose_stop_is_at_its_place_of_rest(number, restitution):
    system, exact = IMPACT("thompson", restitution=restitution), float(rows("laws_impact")[number])
    found = sl.branches(
        system, {"frequency": (2.6, 2.7)}, (-0.5, 0.0), at=1, switch=(), progress=False
    )
    assert nearest(found, "period_doubling", exact) == pytest.approx(exact, rel=1e-14)


def test_an_orbit_with_one_impact_in_three_periods():
    exact = float(rows("laws_impact")["I14"])
    start = impact_orbits.oscillator(frequency=6.62, n=3)[-1][1]
    found = sl.branches(
        IMPACT("thompson"), {"frequency": (6.62, 6.66)}, tuple(start), at=2, switch=(),
        progress=False,
    )  # fmt: skip
    assert nearest(found, "period_doubling", exact) == pytest.approx(exact, rel=1e-14)


def test_an_oscillator_that_leaves_its_stop():
    exact = rows("laws_impact")
    system = IMPACT(damping=0.04, gap=0.2, restitution=0.7)
    seeds = sl.bifurcation_diagram(system, {"frequency": [2.114]}, start=(0, 0), progress=False)
    found = sl.branches(system, {"frequency": (2.1, 2.6)}, seeds, switch=(), progress=False)
    for kind, number in (("period_doubling", "I20"), ("graze", "I22")):
        value = float(exact[number])
        assert nearest(found, kind, value) == pytest.approx(value, rel=1e-14)
    assert found.event_outcome.values[found.event_kind.values == "graze"] == ["persistence"]


def test_a_ball_on_a_shaken_table():
    fold, doubling = (float(rows("laws_ball")[number]) for number in ("B01a", "B01b"))
    system = sl.models.bouncing_ball()
    # one impact a period, at the phase where G cos(phase) = pi (1 - e)/(1 + e); v after it is pi
    phase = np.arccos(np.pi / 3 / 1.3)
    since = 2 * np.pi - phase
    start = (1.3 * np.sin(phase) + np.pi * since - since**2 / 2, np.pi - since)
    found = sl.branches(system, {"amplitude": (1.0, 1.6)}, start, at=1, switch=(), progress=False)
    assert nearest(found, "fold", fold) == pytest.approx(fold, rel=1e-14)
    assert nearest(found, "period_doubling", doubling) == pytest.approx(doubling, rel=1e-14)


def test_a_ball_without_rebound_on_a_shaken_table():
    exact = float(rows("laws_ball")["B04b"])
    start = impact_orbits.ball_on_table(3.72, 0.0)[0]
    found = sl.branches(
        sl.models.bouncing_ball(restitution=0.0), {"amplitude": (3.72, 3.73)}, tuple(start), at=2,
        switch=(), progress=False,
    )  # fmt: skip
    assert nearest(found, "period_doubling", exact) == pytest.approx(exact, rel=1e-14)


def test_a_ball_that_takes_on_the_velocity_of_its_table_but_passes_it():
    """Without rebound the orbit of the closed form begins where the table presses on, so it is no
    motion of an impact; of a jump, after which nothing holds the ball up, it is.
    """

    @sl.system(states="x v", forced_at="frequency")
    def through(t, x, v, *, amplitude=3.2, frequency="1 rad/s"):
        table = amplitude * sl.sin(frequency * t)
        return v, -1.0, sl.jump(x < table, v=amplitude * frequency * sl.cos(frequency * t))

    exact = float(rows("laws_ball")["B04a"])
    start = impact_orbits.ball_on_table(3.2, 0.0)[0]
    found = sl.branches(
        through, {"amplitude": (3.1, 3.25)}, tuple(start), at=2, switch=(), progress=False
    )
    assert nearest(found, "fold", exact) == pytest.approx(exact, rel=1e-14)


def test_a_stiff_spring_behind_a_stopbegins_at_the_graze_of_the_closed_form():
    exact = float(rows("laws_more")["M01"])
    x = 0.7 * 0.75**2 / (1 - 0.75**2 + 0.015j)  # the response without contact
    found = sl.branches(
        sl.models.bilinear_rig(), {"frequency": ("0.75 rad/s", "0.82 rad/s")},
        (x.imag, 0.75 * x.real), at=1, switch=(), progress=False,
    )  # fmt: skip
    assert nearest(found, "graze", exact) == pytest.approx(exact, rel=1e-14)


def test_a_ball_in_a_shaken_box():
    exact = rows("laws_ball")
    box = sl.models.ball_in_box()
    found = sl.branches(
        box, {"length": (2.9, 13)}, "random 4", box={"x": (-1, 1), "v": (-2, 2)}, at=1,
        switch=(), progress=False,
    )  # fmt: skip
    fold = float(exact["B30"])
    assert nearest(found, "fold", fold) == pytest.approx(fold, rel=1e-14)


@pytest.mark.slow
def test_a_branch_goes_on_with_another_impact_behind_a_graze():
    """Of orbits whose impacts are all at one stop: it doesn't turn back upon itself. Their period
    is closed by an independent solver, flight by flight.
    """
    found = sl.branches(IMPACT(), {"frequency": (0.5, 2.0)}, progress=False)
    whole = np.flatnonzero(found.branch_periods.values == 1)
    assert len(whole) == 1
    assert {found.branch_begin.values[whole[0]], found.branch_end.values[whole[0]]} == {"range"}
    of, kind = found.event_branch.values == whole[0], found.event_kind.values
    grazes = found.event_frequency.values[of & (kind == "graze")]
    assert np.diff(np.sort(grazes)).min() > 1e-3
    impacts = found.point_contacts.values
    mine = np.flatnonzero((found.point_branch.values == whole[0]) & (impacts == 2))
    for i in mine[len(mine) * np.array([4, 6, 8]) // 12]:
        frequency = float(found.point_frequency[i])
        start = [float(found[f"point_{name}"].values[i, 0]) for name in ("x", "v")]
        end, count = flown(start, frequency)
        assert count == 2
        np.testing.assert_allclose(end, start, atol=1e-8)


def test_of_alike_impacts_the_one_that_vanishes_may_be_any():
    """It was taken for the first one: the branch was lost where another one vanished."""
    system = IMPACT("chatter", restitution=0.5)
    found = sl.branches(
        system, {"frequency": (0.65, 1.05)}, at=2, switch=(), threads=1, progress=False
    )
    assert (found.branch_begin.values, found.branch_end.values) == (["range"], ["range"])
    impacts = found.point_contacts.values
    for number in (3, 2, 1):
        mine = np.flatnonzero(impacts == number)
        assert len(mine) > 5
        i = mine[-3] if number == 1 else mine[3]  # these attract
        frequency = float(found.point_frequency[i])
        start = [float(found[f"point_{name}"].values[i, 0]) for name in ("x", "v")]
        end, count = flown(start, frequency, stop=0.2, kept=0.5)
        assert count == number
        np.testing.assert_allclose(end, start, atol=1e-8)
    assert (found.event_kind == "graze").sum() == 2


@pytest.mark.slow
def test_an_orbit_with_as_many_impacts_as_the_free_flow_but_others_is_none():
    """In one flight it passed the stop, which the free flow meets there; both have eight."""
    system = IMPACT("chatter", restitution=0.85)
    found = sl.branches(system, {"frequency": (0.3, 1.2)}, at=1, switch=(), progress=False)
    assert "lost" not in {*found.branch_begin.values, *found.branch_end.values}
    calm = np.abs(found.point_multiplier_real.values).max(axis=1) < 10.0
    impacts = found.point_contacts.values
    assert len(set(impacts)) > 3
    few = impacts < 10  # flights that a step of the other solver doesn't contain
    for i in np.flatnonzero(calm & few & (found.point_frequency.values < 0.4))[::2]:
        frequency = float(found.point_frequency[i])
        start = [float(found[f"point_{name}"].values[i, 0]) for name in ("x", "v")]
        end, count = flown(start, frequency, stop=0.2, kept=0.85)
        assert count == impacts[i]
        np.testing.assert_allclose(end, start, atol=1e-7)


def flown(state, frequency, stop=1.0, kept=0.8):
    """The state after a forcing period, and the impacts on the way."""

    def rates(t, z):
        return z[1], np.cos(frequency * t) - 0.1 * z[1] - z[0]

    def gap(_, z):
        return z[0] - stop

    gap.terminal, gap.direction = True, 1.0
    t, end, count = 0.0, 2 * np.pi / frequency, 0
    while True:
        run = solve_ivp(rates, (t, end), state, "DOP853", events=gap, rtol=1e-12, atol=1e-13)
        if run.status != 1:
            return run.y[:, -1], count
        t, (x, v), count = run.t[-1], run.y[:, -1], count + 1
        state = [min(x, stop), -kept * v]


#: Its branch over the frequency passes a graze and a period doubling.
LEAVES, BAND = IMPACT(damping=0.04, gap=0.2, restitution=0.7), {"frequency": (2.1, 2.6)}


def check_part(part):
    """Its orbits close, and don't fill the band. At the graze a rounding moves the end of a period
    by its root, 1.5e-8.
    """
    assert part.sizes["point"] > 30
    points = np.stack([part.point_x.values[:, 0], part.point_v.values[:, 0]], axis=1)
    rows = np.tile(list(LEAVES.values.values()), (len(points), 1))
    rows[:, list(LEAVES.values).index("frequency")] = part.point_frequency
    ends, _ = Stroboscope(LEAVES, sl.Taylor(), rows).ends(points, 1)
    apart = np.sort(np.abs(ends - points).max(axis=1))
    assert apart[-2] < 1e-9
    assert apart[-1] < 2e-8
    assert np.ptp(part.point_frequency.values) < 0.4999


def test_a_branch_through_a_graze_is_interrupted():
    seeds = sl.bifurcation_diagram(LEAVES, {"frequency": [2.114]}, start=(0, 0), progress=False)
    shares = []

    def stop(share):
        shares.append(share)
        if len(shares) == 40:
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as caught:
        sl.branches(LEAVES, BAND, seeds, switch=(), progress=stop)
    assert len(set(shares)) > 30
    part = caught.value.partial
    check_part(part)
    assert "interrupted" in (part.branch_begin.values[0], part.branch_end.values[0])


def test_a_branch_through_a_graze_ends_with_its_work(monkeypatch):
    seeds = sl.bifurcation_diagram(LEAVES, {"frequency": [2.114]}, start=(0, 0), progress=False)
    monkeypatch.setattr("saltus.analysis.branches.branches.MOST_WORK", 30 * 4)
    part = sl.branches(LEAVES, BAND, seeds, switch=(), progress=False)
    check_part(part)
    assert "points" in (part.branch_begin.values[0], part.branch_end.values[0])
    assert "all the work was done: branches end early, 0 orbits weren't" in sl.describe(part)


def test_an_impact_that_crosses_the_whole_period_bends_no_branch():
    """States at whole periods jump there; points that were put between for the picture lay on a
    part of the branch that had been passed, and outside the range.
    """
    system = sl.structure(
        np.diag([1.2403, 1.17315]), [[744.2159, -398.612], [-398.612, 398.612]],
        [[1.9004, -0.51576], [-0.51576, 1.4025]], names=["a", "b"], frequency=3.4,
        contacts=[sl.Contact("a", restitution=0.47151, gap=2.14152e-3)],
        forces=[sl.Force("a", 5.12103)],
    )  # fmt: skip
    found = sl.bifurcation_diagram(system, {"frequency": (3.387, 5.494, 6)}, progress=False)
    assert "fold" not in found.event_kind.values
    for branch in range(found.sizes["branch"]):
        along = found.point_frequency.values[found.point_branch.values == branch]
        assert (np.diff(along) > 0).all()
    assert 3.387 <= found.point_frequency.min() <= found.point_frequency.max() <= 5.494
