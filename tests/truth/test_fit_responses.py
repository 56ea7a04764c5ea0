"""Fits to measured responses, across a jump."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.steady import Responses
from saltus.analysis.fits.unknowns import Unknowns
from saltus.flow.methods import check_method

RIG = sl.models.delangre("a", force="4 N", frequency="8 Hz")
METHOD = check_method(None, RIG)
TRUTH = np.array([4.5e-4, 1e4])
FREE = {"upper_gap": ("0.1 mm", "2 mm"), "contact_stiffness": ("1 kN/m", "100 kN/m")}
#: The resonance bends to the right: at 14 and 15 Hz both branches were measured.
FREQUENCY = np.array([12.0, 14.0, 15.0, 15.0, 14.0])
SIZE = np.array([3.5e-3, 4.7e-3, 5.3e-3, 1.7e-4, 2.0e-4])


def model(measured, size="amplitude"):
    return Responses(
        RIG,
        check_method(None, RIG),
        measurement(RIG, measured, False),
        Unknowns.of(RIG, FREE),
        size,
    )


@pytest.mark.parametrize("size", ["amplitude", "rms"])
def test_a_point_counts_to_its_branch_whose_derivatives_are_limits_of_differences(size):
    here = model({"frequency": FREQUENCY, "x": SIZE}, size)
    fitted, slopes = here.with_derivatives(TRUTH)
    assert (fitted[1:3, 0] > 10 * fitted[[4, 3], 0]).all()
    for column, one in enumerate(TRUTH):
        step = 1e-4 * one * np.eye(2)[column]
        ahead, behind = here.plain(np.array([TRUTH + step, TRUTH - step]))
        expected = (ahead - behind) / (2 * step[column])
        assert np.abs(slopes[..., column] - expected).max() < 1e-5 * np.abs(expected).max()


def test_a_response_with_a_jump_gives_the_gap_and_the_stiffness():
    exact = model({"frequency": FREQUENCY, "x": SIZE}).plain(TRUTH[None])[0][:, 0]
    noise = 1e-5 * np.random.default_rng(9).standard_normal(len(exact))
    measured = {"frequency": FREQUENCY, "x": (1e3 * (exact + noise), "mm")}
    start = RIG.with_values(upper_gap="0.5 mm", contact_stiffness="11 kN/m")
    found = sl.fit(start, measured, FREE, starts=1, noise="0.01 mm")
    assert (np.abs(found.value.values - TRUTH) < 4 * found.standard_error.values).all()
    assert found.standard_error.values[1] < 0.02 * TRUTH[1]
    assert found.at.attrs["units"] == "Hz"
    assert found.attrs["along"] == "frequency"
