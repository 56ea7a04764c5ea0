"""Periodic orbits in the plane of two states."""

import numpy as np
import pytest

import saltus as sl

RIG = sl.models.delangre("a", force="4 N", frequency="17 Hz")
BOX = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}


@pytest.fixture(scope="module")
def orbits():
    return sl.periodic_orbits(RIG, "random 100", box=BOX, periods=1)


def marks(axes):
    return [line for line in axes.lines if line.get_marker() in ("o", "x")]


def test_stable_ones_are_dots_and_others_crosses_at_their_points(orbits):
    axes = sl.plot.periodic_orbits(orbits, units={"x": "mm", "v": "m/s"})
    assert [line.get_marker() for line in marks(axes)] == [
        "o" if flag else "x" for flag in orbits.orbit_stable.values
    ]
    assert [line.get_xdata()[0] for line in marks(axes)] == pytest.approx(
        1e3 * orbits.orbit_x.values[:, 0]
    )
    assert [line.get_ydata()[0] for line in marks(axes)] == pytest.approx(
        orbits.orbit_v.values[:, 0]
    )
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "v [m/s]")
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == [f"T, {word}" for word in orbits.orbit_stability.values]


def test_over_a_map_they_are_drawn_in_its_units(orbits, few_scouts):
    basins = sl.basins(RIG, x=("-5 mm", "5 mm", 4), v=("-1 m/s", "1 m/s", 4))
    axes = sl.plot.periodic_orbits(orbits, over=basins, legend=False)
    assert [line.get_xdata()[0] for line in marks(axes)] == pytest.approx(
        1e3 * orbits.orbit_x.values[:, 0]
    )
    assert np.ptp(axes.get_xlim()) > 10
    with pytest.raises(sl.SaltusError, match="map of x and v"):
        sl.plot.periodic_orbits(orbits, "v", "x", over=basins)


def test_a_state_that_is_not_there_is_refused(orbits):
    with pytest.raises(sl.SaltusError, match=r"plot\.periodic_orbits.*no state 'y'"):
        sl.plot.periodic_orbits(orbits, "y")
