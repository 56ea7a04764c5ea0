"""Picture of methods side by side: three panels, a colour a method, the reference
without an error.
"""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from saltus import plot
from saltus.analysis.methods.compare_methods import methods_dataset
from saltus.errors import ParameterError

VALUES = np.geomspace(1e3, 1e9, 64)


def side_by_side(values=VALUES):
    axes = {"stiffness": ("stiffness", values, {"units": "N/m"}), "start": ("start", [0])}
    peak = xr.Variable(("stiffness", "start"), np.ones((len(values), 1)), {"units": "m"})
    base = xr.Dataset(
        {"peak": peak, "response_of": peak.astype(int)},
        axes,
        {"states": "x v", "saltus_result": "responses"},
    )
    k = (3, len(values))
    agrees = np.ones((*k, 1), int)
    agrees[1, ::2], agrees[2, :4] = 0, -1
    error = np.outer([0.0, 1e-3, 1e-6], np.ones(len(values)))
    fields = {
        "agrees": agrees,
        "known": agrees,
        "step_error": error,
        "steps_per_period": np.outer([20, 60, 200], np.ones(len(values))),
    }
    columns = {"method_cpu_seconds": np.array([1.0, np.nan, 3.0])}
    return methods_dataset(base, ["Taylor", "ode45 a", "ode45 b"], columns, fields, {})


def test_three_panels_share_a_logarithmic_axis_with_its_unit():
    panels = plot.methods(side_by_side())
    assert len(panels) == 3
    assert {panel.get_xscale() for panel in panels} == {"log"}
    assert panels[2].get_xlabel() == "stiffness [N/m]"
    # the reference has no error
    assert [text.get_text() for text in panels[0].get_legend().get_texts()] == [
        "ode45 a",
        "ode45 b",
    ]
    assert [text.get_text() for text in panels[2].get_legend().get_texts()] == [
        "Taylor: 1 s",
        "ode45 a",
        "ode45 b: 3 s",
    ]
    plt.close("all")


def test_shares_are_those_of_the_settled_starts():
    panels = plot.methods(side_by_side())
    first, second = (line.get_ydata() for line in panels[1].get_lines())
    np.testing.assert_allclose(first, 50.0)
    np.testing.assert_allclose(second, 0.0)
    plt.close("all")


def test_few_values_are_seen():
    """One piece over all values is a step across them, not a curve of one point."""
    panels = plot.methods(side_by_side(np.geomspace(1e3, 1e6, 13)))
    x, share = panels[1].get_lines()[0].get_data()
    np.testing.assert_allclose(x, [1e3, 1e6])
    np.testing.assert_allclose(share, 100 * 7 / 13)
    plt.close("all")


def test_a_linear_grid_has_a_linear_axis():
    assert plot.methods(side_by_side(np.linspace(1.0, 2.0, 16)))[0].get_xscale() == "linear"
    plt.close("all")


def test_anything_else_is_refused():
    with pytest.raises(ParameterError, match="compare_methods"):
        plot.methods(xr.Dataset())
    with pytest.raises(ParameterError, match=r"plot\.agreement"):
        plot.methods(side_by_side().drop_vars("step_error"))
