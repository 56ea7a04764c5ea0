"""Orbits from contact to contact: their equations, multipliers, and branches through grazes."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.contact_sequences import sequences
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.shooting import PeriodicOrbits

REFERENCE = Path(__file__).parents[3] / "reference"
ROW = np.zeros(1, np.int64)


def value(name, number):
    with (REFERENCE / f"{name}.csv").open() as file:
        return next(row["value"] for row in csv.DictReader(file) if row["id"] == number)


def legs_of(system, name, point):
    """An orbit of one period, contact to contact, and with its contacts left to the flow."""
    z = np.append(point, system.values[name])
    scale = np.append(np.ones(len(point)), abs(system.values[name]))
    orbits = PeriodicOrbits(system, (name,), 1, scale[None], sl.Taylor())
    legs, start = Legs.of(orbits, sequences(orbits, z[None])[0], z, scale)
    normal = np.zeros((1, len(start)))
    normal[0, -1] = 1.0
    return legs, correct(legs, start[None], normal, ROW).z, orbits


STOP = sl.models.impact_oscillator(force=0.3, frequency="1.2 rad/s")
ON_STOP = np.array([0.42358876, 1.26171412])
SOFT = sl.models.soft_stop(frequency="1.2 rad/s")


def settled(system):
    """A point of the motion after a long time, at a whole period."""
    found = sl.attractors(system, (0.1, 0.0), progress=False)
    return np.array([found[f"attractor_{name}"].values[0, 0] for name in system.states])


@pytest.mark.parametrize("name", ["force", "frequency", "gap", "restitution"])
def test_derivatives_are_those_of_differences(name):
    legs, z, _ = legs_of(STOP, name, ON_STOP)
    _, derivative = legs.evaluate(z, ROW)
    for j, unit in enumerate(legs.scale[0]):
        step = np.zeros_like(z)
        step[0, j] = 1e-6 * unit
        by = (legs.evaluate(z + step, ROW)[0] - legs.evaluate(z - step, ROW)[0]) / 2e-6
        assert derivative[0, :, j] == pytest.approx(by[0], abs=2e-8)


def test_multipliers_are_those_of_the_flow():
    for system, point in ((STOP, ON_STOP), (SOFT, settled(SOFT))):
        legs, z, orbits = legs_of(system, "force", point)
        assert len(legs.contacts) >= 1
        free = legs.orbit(z)
        residual, derivative = orbits.evaluate(free, ROW)
        assert np.abs(residual).max() < 1e-13
        own = legs.multipliers(z, legs.evaluate(z, ROW)[1], ROW)
        assert own == pytest.approx(orbits.multipliers(free, derivative, ROW), abs=1e-12)


def test_legs_that_last_next_to_no_time_have_their_derivatives():
    legs, z, _ = legs_of(STOP, "force", ON_STOP)
    rest, after, phase, step = z[:, 3:], np.array([[[0.0, -0.7]]]), np.array([[0.2]]), 1e-6
    for span in (5e-4, -3e-4, 1e-12):
        end, matrix = legs.flights.fly(after, rest, phase, np.array([[span]]))
        ends = [
            legs.flights.fly(after, rest, phase, np.array([[span + h]]))[0] for h in (step, -step)
        ]
        assert matrix[..., -1] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)
        period = 2 * np.pi / 1.2
        bound = 2 * (span * period) ** 2 + 1e-15  # curvature and rounding
        assert end[0, 0, 0] == pytest.approx(-0.7 * span * period, rel=0, abs=bound)


def test_an_impact_that_comes_from_behind_is_virtual():
    legs, z, _ = legs_of(STOP, "force", ON_STOP)
    assert legs.admissible(z).tolist() == [True]
    z[0, 2] *= -1.0  # the velocity before the impact
    assert legs.speeds(z)[0, 0] < 0
    assert legs.admissible(z).tolist() == [False]


def test_a_branch_turns_into_orbits_with_impacts_at_a_graze():
    stop = sl.models.impact_oscillator(frequency="1 rad/s")
    found = sl.branches(stop, {"force": (0.05, 0.3)}, (0, 0), at=1, progress=False)
    assert found.attrs["unexplained_changes"] == 0
    at = dict(zip(found.event_kind.values, found.event_force.values, strict=True))
    assert at == pytest.approx(
        {"graze": 0.1, "fold": float(value("laws_impact", "I01"))}, rel=4e-16, abs=1e-15
    )
    assert found.event_outcome.values[found.event_kind.values == "graze"] == ["nonsmooth_fold"]
    # from free orbits over the graze, back through the fold, onto the orbits with one impact
    assert found.point_contacts.values[[0, -1]].tolist() in ([0, 1], [1, 0])
    assert found.point_force.values[[0, -1]] == pytest.approx([0.05, 0.3], abs=0.26)


def test_the_branch_through_a_graze_is_one_wherever_it_is_met():
    stop = sl.models.impact_oscillator(frequency="1 rad/s")
    found = sl.branches(
        stop, {"force": (0.05, 0.3)}, "random 5", box={"x": (-1, 1), "v": (-1, 1)}, at=2,
        progress=False,
    )  # fmt: skip
    assert found.sizes["branch"] == 1


def test_orbits_without_contact_end_at_the_graze_of_the_closed_form():
    x = 0.4 / (1 - 1.2**2 + 0.12j)  # the response without contact
    start = (x.real, -1.2 * x.imag)
    found = sl.branches(STOP, {"force": (0.3, 0.5)}, start, at=1, progress=False)
    grazes = found.event_force.values[found.event_kind.values == "graze"]
    exact = float(value("laws_impact", "I03g"))
    assert np.abs(grazes - exact).min() < 1e-14  # rounding of the flow over a period
