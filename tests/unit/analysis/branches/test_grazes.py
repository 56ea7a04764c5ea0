"""Grazes and corners along branches, against closed forms and an independent solution."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.contact_sequences import sequences, shift
from saltus.analysis.branches.plans import plan_of
from saltus.analysis.branches.sequence_changes import contact_points
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.switching import Seed
from saltus.analysis.branches.tracing import trace

REFERENCE = Path(__file__).parents[3] / "reference"


def value(name, number):
    with (REFERENCE / f"{name}.csv").open() as file:
        return next(float(row["value"]) for row in csv.DictReader(file) if row["id"] == number)


def events(found, kind):
    """Values of the parameter, in ascending order."""
    at = found[f"event_{found.attrs['parameter']}"].values[found.event_kind.values == kind]
    return np.sort(at)


@cache
def soft_stop():
    one = sl.models.soft_stop(frequency="1.5 rad/s")
    box = {"x": (-1, 1), "v": (-1, 1)}
    return sl.branches(one, {"frequency": (1.4, 1.6)}, "random 4", box=box, at=2, progress=False)


def test_a_symmetric_response_grazes_both_stops_at_once():
    found, exact = soft_stop(), value("branches_soft_stop", "S05")
    assert events(found, "graze") == pytest.approx([exact, exact], rel=1e-15, abs=4e-16)
    assert set(found.event_guard.values[found.event_kind.values == "graze"]) == {
        "x = gap", "x = -gap",
    }  # fmt: skip


def test_a_fold_just_below_a_graze_is_another_event():
    found = soft_stop()
    assert events(found, "fold") == pytest.approx([value("branches_soft_stop", "S03")], rel=1e-12)
    assert found.attrs["unexplained_changes"] == 0


def test_the_rig_grazes_its_upper_stop():
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    near = value("branches_rig", "G18")
    plan = plan_of(rig, "contact_stiffness", (2.25e4, 2.33e4), sl.Taylor(), None, 200, 1, ())
    seed = Seed(
        np.array([[5.37959592e-4, -5.810987347e-3]]), np.array([near]), np.array([1e-3, 0.1])
    )
    found = []
    trace(plan, [seed], found)
    grazes = [event for event in found[0].events if event.kind == "graze"]
    assert [event.z[-1] for event in grazes] == pytest.approx([near], rel=2e-14)
    assert rig.guards[grazes[0].guards[0]].name == "upper_gap"


@sl.system(states="x y z", forced_at="frequency")
def two_levels(t, x, y, z, *, level=0.3, other=0.1, frequency="1 rad/s"):
    """Two filters of a forcing, and a third state that sees when either is above its level."""
    push = sl.cos(frequency * t)
    above = sl.piecewise((1.0, x > level), otherwise=0) + sl.piecewise(
        (2.0, y > other), otherwise=0
    )
    return push - x, push - 2 * y, above - z


def filtered(rate, t):
    """The settled x of x' = cos t - rate x."""
    return (rate * np.cos(t) + np.sin(t)) / (rate**2 + 1)


def crossings(rate, level):
    """When it crosses a level, upwards and downwards."""
    size, lag = 1 / np.hypot(rate, 1), np.arctan2(1, rate)
    return lag - np.arccos(level / size), lag + np.arccos(level / size)


def test_two_contacts_at_once_change_their_order_and_are_no_graze():
    found = sl.branches(two_levels, {"other": (0.05, 0.4)}, (0, 0, 0), at=2, progress=False)
    exact = sorted(filtered(2, t) for t in crossings(1, 0.3) if 0.05 < filtered(2, t) < 0.4)
    assert len(exact) == 2
    assert events(found, "corner") == pytest.approx(exact, rel=1e-13)
    assert not len(events(found, "graze"))


def test_corners_are_found_wherever_the_steps_of_the_branch_lie():
    """Which of the two contacts at once is the later one by rounding says nothing."""
    for low in np.linspace(0.05, 0.07, 7):
        found = sl.branches(two_levels, {"other": (low, 0.4)}, (0, 0, 0), at=1, progress=False)
        exact = sorted(filtered(2, t) for t in crossings(1, 0.3) if low < filtered(2, t) < 0.4)
        assert events(found, "corner") == pytest.approx(exact, rel=1e-13)


def test_a_contact_that_crosses_the_whole_period_is_no_event():
    # x is above its level at the whole period as long as the level is below 1/2
    found = sl.branches(two_levels, {"level": (0.4, 0.6)}, (0, 0, 0), at=2, progress=False)
    assert found.sizes["event"] == 0
    z = np.stack([found[f"point_{s}"].values[:, 0] for s in "xyz"] + [found.point_level.values], 1)
    orbits = PeriodicOrbits(two_levels, ("level",), 1, np.ones((1, 4)), sl.Taylor())
    first, last = sequences(orbits, z[[0, -1]])
    crossed = first.contacts[-1]
    assert (crossed.guard, crossed.direction) == (0, 1)
    assert (last.contacts[0].guard, last.contacts[0].direction) == (0, 1)
    assert abs(shift(first, last, 1)) == 1


def test_a_graze_at_the_whole_period_is_found():
    # cos t - x settles to (cos t + sin t)/2; shifted so that the largest x is at time 0
    @sl.system(states="x z", forced_at="frequency")
    def shifted(t, x, z, *, level=0.6, frequency="1 rad/s"):
        push = sl.cos(frequency * t + np.pi / 4)
        return push - x, sl.piecewise((x - level, x > level), otherwise=0) - z

    found = sl.branches(shifted, {"level": (0.65, 0.75)}, (0, 0), at=2, progress=False)
    assert events(found, "graze") == pytest.approx([np.sqrt(0.5)], rel=1e-14)


def test_contacts_that_are_held_have_no_grazes():
    block = sl.models.dry_friction()
    name = next(iter(block.values))
    orbits = PeriodicOrbits(block, (name,), 1, np.ones((1, len(block.states) + 1)), sl.Taylor())
    z = np.append(np.zeros(len(block.states)), block.values[name])
    assert contact_points(orbits, 0, np.array([z, z]), np.zeros((2, len(z)))) == []
