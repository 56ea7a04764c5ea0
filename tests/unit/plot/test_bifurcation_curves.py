"""Curves of bifurcations as a picture."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError


@sl.system(states="x v", forced_at="frequency")
def duffing(t, x, v, *, c=0.2, force=0.5, frequency="0.3 Hz"):
    return v, -c * v - x - x**3 + force * sl.cos(2 * sl.pi * frequency * t)


BOTH = {"frequency": (0.15, 0.4), "force": (0.05, 1.0)}


@pytest.fixture(scope="module")
def fold():
    found = sl.branches(duffing, {"frequency": (0.15, 0.4)}, (0, 0), at=2)
    return sl.bifurcation_curve(duffing, found.sel(event=0), BOTH)


def lines(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def test_a_curve_is_drawn_with_its_points_and_units(fold):
    ax = sl.plot.bifurcation_curves(fold)
    (line,) = lines(ax, "curve fold")
    np.testing.assert_allclose(line.get_xdata(), fold.point_frequency)
    np.testing.assert_allclose(line.get_ydata(), fold.point_force)
    (cusp,) = lines(ax, "codim2 cusp")
    np.testing.assert_allclose(
        cusp.get_xydata(), [[fold.codim2_frequency[0], fold.codim2_force[0]]]
    )
    assert ax.get_xlabel() == "frequency [Hz]"
    assert ax.get_ylabel() == "force"
    assert ax.get_xlim() == pytest.approx((0.15, 0.4))
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["fold of T", "cusp"]
    plt.close(ax.figure)


def test_curves_lie_on_the_map_of_types_whose_axes_they_take(fold):
    grid = {"force": (0.05, 1.0, 3), "frequency": (0.15, 0.4, 3)}
    types = sl.bifurcation_diagram(duffing, grid, (0, 0))
    ax = sl.plot.bifurcation_curves({"end of the resonance": fold}, over=types)
    (line,) = lines(ax, "curve fold")
    np.testing.assert_allclose(line.get_xdata(), fold.point_force)
    assert ax.get_legend().get_texts()[0].get_text() == "end of the resonance"
    plt.close(ax.figure)
    other = sl.bifurcation_diagram(duffing, {"force": [0.1, 0.2], "c": [0.1, 0.2]}, (0, 0))
    with pytest.raises(ParameterError, match=r"the curves are over .* the map in over= is over"):
        sl.plot.bifurcation_curves(fold, over=other)


def test_what_is_no_curve_is_refused(fold):
    with pytest.raises(ParameterError, match="no curves to draw"):
        sl.plot.bifurcation_curves([])
    with pytest.raises(ParameterError, match=r"sl\.bifurcation_curve"):
        sl.plot.bifurcation_curves(sl.branches(duffing, {"frequency": (0.3, 0.4)}, (0, 0), at=1))
