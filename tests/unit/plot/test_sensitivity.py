"""The picture of derivatives of a motion."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError


@pytest.fixture(scope="module")
def derivatives():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    return sl.sensitivity(
        rig, ("1 mm", 0), periods=2, samples=20, to=["lower_gap", "force", "v(0)"], extremes=False
    )


def test_each_curve_is_the_change_for_a_per_cent(derivatives):
    axes = sl.plot.sensitivity(derivatives, output="v")
    curves = {
        line.get_label(): line.get_ydata() for line in axes.lines if len(line.get_xdata()) > 2
    }
    assert set(curves) == {"1 % of force", "v(0): 1 % of its range"}  # lower_gap is zero
    of_v = derivatives.sel(output="v")
    assert axes.get_ylabel() == "change of v [mm/s]"
    assert curves["1 % of force"] == pytest.approx(1e3 * 0.04 * of_v.derivative.values[:, 1])
    span = np.ptp(of_v.value.values)
    assert curves["v(0): 1 % of its range"] == pytest.approx(
        1e3 * 0.01 * span * of_v.derivative.values[:, 2]
    )


def test_an_unknown_output_is_refused(derivatives):
    with pytest.raises(ParameterError, match="no output 'y'"):
        sl.plot.sensitivity(derivatives, output="y")
