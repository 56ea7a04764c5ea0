"""Rule 5: the state at a contact is on the boundary exactly, the record is complete and right, the
error of its time is honest.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from conformance.systems import contacts, lab, slider

pytestmark = pytest.mark.usefixtures("exact_method")

REFERENCE = Path(__file__).parents[1] / "reference"


def _rig_runs(count=64, periods=20):
    rng = np.random.default_rng(11)
    start = {"x": rng.uniform(-5e-3, 5e-3, count), "v": rng.uniform(-1, 1, count)}
    return sl.simulate(sl.models.delangre("b"), start, periods=periods, samples=40)


def test_state_is_on_the_boundary_exactly():
    """contact_x is the boundary itself, bit for bit, for every contact; contact_velocity is the
    velocity there; directions alternate.
    """
    run = _rig_runs()
    place = np.where(
        run.contact_guard == "upper_gap",
        run.guard_boundary.sel(guard="upper_gap"),
        run.guard_boundary.sel(guard="lower_gap"),
    )
    assert run.sizes["contact"] > 2000
    assert (run.contact_x.values == place).all()
    assert run.contact_v.values == pytest.approx(run.contact_velocity.values, rel=1e-13, abs=1e-16)
    assert (np.sign(run.contact_velocity) == run.contact_direction).all()
    assert run.guard_boundary.values.tolist() == [0.0, 4e-4]


def test_modes_before_and_after_form_a_chain():
    """Each contact changes one bit, that of its guard, to its direction; the mode after it is the
    mode before the next.
    """
    run = _rig_runs()
    number = {name: i for i, name in enumerate(run.guard.values)}
    for i in range(run.sizes["trajectory"]):
        rows = contacts(run, i)
        assert all(c.before ^ c.after == 1 << number[c.guard] for c in rows)
        assert all(bool(c.after >> number[c.guard] & 1) == (c.direction > 0) for c in rows)
        assert all(a.after == b.before for a, b in itertools.pairwise(rows))
        assert all(a.time < b.time for a, b in itertools.pairwise(rows))
        assert rows[-1].after == int(run.mode[i, -1])
        assert len(rows) == int(run.events[i])


def test_velocity_at_a_contact_is_the_speed_of_the_fall():
    """From height h with acceleration 2 the speed is 2 sqrt(h): heights from 1e-12 to 1e6."""
    height = 10.0 ** np.arange(-12, 7)
    run = sl.simulate(
        lab.with_values(lift=2.0, boundary=0.0),
        {"x": -height, "v": 0 * height},
        t_end=1100.0,
        samples=1,
    )
    assert run.sizes["contact"] == len(height)
    assert run.contact_velocity.values == pytest.approx(2 * np.sqrt(height), rel=1e-15)
    assert run.contact_time.values == pytest.approx(np.sqrt(height), rel=1e-15)


def test_time_errors_are_honest():
    """Rig b4 at 7 Hz from rest, 63 contacts: within 1e-13 s of the exact ones, and
    contact_time_error covers the error of each.
    """
    exact = np.loadtxt(REFERENCE / "fig2b_exact_events.csv", delimiter=",", skiprows=1, usecols=1)
    run = sl.simulate(sl.models.delangre("b", frequency=7.0), (0.0, 0.0), periods=14)
    off = np.abs(run.contact_time.values - exact)
    assert len(exact) == 63
    assert off.max() < 1e-13
    assert (off <= run.contact_time_error.values + 1e-17).all()
    assert run.contact_time_error.values.max() < 1e-12


@pytest.mark.parametrize("tolerance", [2.0**-46, 2.0**-30, 2.0**-18])
def test_time_errors_are_honest_at_any_tolerance(tolerance):
    """v' = f cos t - friction: meetings with the belt have a closed form; errors grow with the
    tolerance, their estimates too.
    """
    run = sl.simulate(
        slider.with_values(friction=0.5),
        (0.1,),
        periods=10,
        method=sl.Taylor(tolerance=tolerance),
        samples=1,
    )
    begin, v, side = 0.0, 0.1, 1.0
    for contact in contacts(run):

        def speed(t, v=v, side=side, begin=begin):
            return (
                v
                + 2 * (np.sin(2 * np.pi * t) - np.sin(2 * np.pi * begin)) / (2 * np.pi)
                - 0.5 * side * (t - begin)
            )

        truth = contact.time
        for _ in range(5):
            truth -= speed(truth) / (2 * np.cos(2 * np.pi * truth) - 0.5 * side)
        assert abs(truth - contact.time) <= contact.error + 1e-15
        assert abs(truth - contact.time) < 1e-15 + 100 * tolerance
        begin, v, side = truth, 0.0, -side


def test_residual_alone_proves_nothing():
    """Contacts at a coarse tolerance lie on the boundary as exactly as at a fine one; their times
    differ, and their errors say so.
    """
    rig = sl.models.delangre("b")
    fine, coarse = (
        sl.simulate(rig, (1e-3, 0.0), periods=4, method=sl.Taylor(tolerance=tol))
        for tol in (2.0**-50, 2.0**-16)
    )
    shared = min(fine.sizes["contact"], coarse.sizes["contact"])
    off = np.abs(fine.contact_time.values[:shared] - coarse.contact_time.values[:shared])
    assert set(coarse.contact_x.values.tolist()) <= {0.0, 4e-4}
    assert off.max() > 1e-9
    assert (off <= coarse.contact_time_error.values[:shared]).all()
