"""Pictures of exponents: curves, intervals, units, and what can't be drawn."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import made_results
from saltus.errors import ParameterError
from saltus.plot import exponents

from .conftest import PROVENANCE

MINUS = "\N{MINUS SIGN}"


def converging(kinds=("chaotic",), unit="1/s", values=(5.98, -7.86), half=0.26, points=50):
    """Running means that approach their values like 1/t, with intervals that shrink
    like its root.
    """
    k, time = len(kinds), np.tile(np.linspace(1, 400, points), (len(kinds), 1))
    exact = np.tile(values, (k, 1))
    running = exact[:, :, None] + 3 / time[:, None]
    width = half * np.sqrt(400 / time)[:, None]
    columns = {
        "kind": kinds, "response_period": [3 if kind == "periodic" else 0 for kind in kinds],
        "lyapunov_exponent": exact,
        "lyapunov_error": 0 * exact + half / 2, "lyapunov_low": exact - half,
        "lyapunov_high": exact + half, "status": ["ok"] * k,
        "running_time": time, "running_exponent": running, "running_low": running - width,
        "running_high": running + width,
    }  # fmt: skip
    return made_results.exponents(columns=columns, rate=unit, states=("x", "v"), attrs=PROVENANCE)


def test_a_curve_with_its_interval_for_each_exponent():
    ax = exponents(converging())
    curves = [line for line in ax.get_lines() if len(line.get_xdata()) > 40]
    assert [line.get_label() for line in curves] == ["5.98 ± 0.26 1/s", f"{MINUS}7.86 ± 0.26 1/s"]
    np.testing.assert_allclose(curves[0].get_ydata()[-1], 5.98 + 3 / 400)
    assert len(ax.collections) == 2
    assert ax.get_ylabel() == "Lyapunov exponent [1/s]"
    assert ax.get_xlabel() == "time after the transient [s]"
    assert "motion: chaotic" in (ax.get_title(loc="left"), ax.get_title())
    # the beginning, whose intervals are wide, isn't shown
    assert curves[0].get_xdata()[0] >= 0.1 * curves[0].get_xdata()[-1]
    low, high = ax.get_ylim()
    assert low < -8.12
    assert 6.24 < high < 12


def test_an_orbit_shows_its_exact_values_to_six_digits():
    ax = exponents(converging(["periodic"], values=(-0.942477796076938,) * 2, half=1e-11))
    assert ax.get_legend().get_texts()[0].get_text() == f"{MINUS}0.942478 1/s"
    dashed = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
    assert {line.get_ydata()[0] for line in dashed} == {-0.942477796076938}


def test_units_and_panels():
    axes = exponents(converging(["chaotic", "quasi_periodic", "unclear"], "bit/period"))
    assert len(axes) == 3
    assert all("[bit/period]" in ax.get_ylabel() for ax in axes)
    one = exponents(converging(["chaotic", "periodic"]), trajectory=1, legend=False)
    assert one.get_legend() is None
    assert (one.get_title(loc="left") or one.get_title()) == "motion: 3T"
    _, mine = plt.subplots()
    assert exponents(converging(), ax=mine) is mine


def test_exponents_that_are_not_known():
    ds = converging()
    for name in (
        "lyapunov_exponent",
        "lyapunov_low",
        "lyapunov_high",
        "running_exponent",
        "running_low",
        "running_high",
    ):
        ds[name][:] = np.nan
    ds["status"][:] = "ok"
    assert exponents(ds).get_legend().get_texts()[0].get_text() == "not known"


def test_what_can_not_be_drawn(run):
    with pytest.raises(ParameterError, match=r"takes what sl\.lyapunov or sl\.wolf returns"):
        exponents(run)
    with pytest.raises(ParameterError, match="no trajectory 4"):
        exponents(converging(), trajectory=4)
