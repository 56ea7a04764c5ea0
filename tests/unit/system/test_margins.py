"""Which gaps a margin to the next graze is of."""

import numpy as np
import pytest

import saltus as sl
from saltus.system import margin_gaps


@sl.system(
    states="x v", forced_at="f",
    units={"x": "m", "v": "m/s", "f": "Hz", "pull": "m/s^2", "k": "1/s^2", "d": "1/s", "gap": "m",
           "slip": "m/s^2"},
)  # fmt: skip
def rubbed(t, x, v, *, f=2.0, pull=3.0, k=40.0, d=4.0, gap=0.5, slip=0.2):
    stop = sl.impact(x < gap, v, restitution=0)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v - sl.friction(v, slip=slip), stop


def test_a_margin_is_a_distance_to_the_stop_whatever_else_switches():
    found = sl.attractors(rubbed, (0, 0)).isel(attractor=0)
    margin = found.attractor_margin
    assert margin.attrs["units"] == "m"
    assert float(margin) == pytest.approx(0.5 - float(found.attractor_peak), rel=1e-9)


def test_what_holds_a_contact_never_counts():
    numbers, unit = margin_gaps(rubbed)
    assert [rubbed.guards[number].name for number in numbers] == ["gap"]
    assert unit == "m"
    assert len(rubbed.guards) > 2


def test_an_equilibrium_has_a_distance_to_the_stop_too():
    @sl.system(states="x v", units={"x": "m", "v": "m/s", "gap": "m", "k": "1/s^2", "d": "1/s"})
    def resting(t, x, v, *, k=40.0, d=4.0, gap=0.5):
        return v, -k * x - d * v, sl.impact(x < gap, v, restitution=0)

    found = sl.equilibria(resting, start=(0.1, 0.0))
    assert found.equilibrium_margin.attrs["units"] == "m"
    assert found.equilibrium_margin.values == pytest.approx(np.array([0.5]))
