"""Fits to measured responses, across a jump."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.steady import SAMPLES, SteadyResponses, _size_of
from saltus.analysis.fits.unknowns import Unknowns
from saltus.flow.methods import check_method

pytestmark = pytest.mark.slow

RIG = sl.models.delangre("a", force="4 N", frequency="8 Hz")
METHOD = check_method(None, RIG)
TRUTH = np.array([4.5e-4, 1e4])
FREE = {"upper_gap": ("0.1 mm", "2 mm"), "contact_stiffness": ("1 kN/m", "100 kN/m")}
#: The resonance bends to the right: at 14 and 15 Hz both branches were measured.
FREQUENCY = np.array([9.0, 14.0, 15.0, 15.0, 14.0])
SIZE = np.array([1.8e-3, 4.7e-3, 5.3e-3, 1.7e-4, 2.0e-4])


def model(measured, size="amplitude"):
    return SteadyResponses(
        RIG,
        check_method(None, RIG),
        measurement(RIG, measured, False),
        Unknowns.of(RIG, FREE),
        size,
    )


def test_a_point_counts_to_its_branch_whose_derivatives_are_limits_of_differences():
    here = model({"frequency": FREQUENCY, "x": SIZE})
    fitted, slopes = here.with_derivatives(TRUTH)
    assert (fitted[1:3, 0] > 10 * fitted[[4, 3], 0]).all()
    for column, one in enumerate(TRUTH):
        step = 1e-4 * one * np.eye(2)[column]
        ahead, behind = here.plain(np.array([TRUTH + step, TRUTH - step]))
        expected = (ahead - behind) / (2 * step[column])
        assert np.abs(slopes[..., column] - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("size", ["amplitude", "rms", "peak"])
def test_derivatives_of_sizes_are_limits_of_differences(size):
    phase = 2 * np.pi * np.arange(2 * SAMPLES) / SAMPLES

    def sample(a):
        return (a[0] * np.cos(phase) + a[1] * np.sin(phase / 2))[None, :, None]

    by = np.stack([np.cos(phase), np.sin(phase / 2)], axis=-1)[None, :, None]
    a, step = np.array([1.3, 0.4]), 1e-6
    _, slopes = _size_of(size, sample(a), by)
    for column in np.eye(2):
        ahead, behind = (_size_of(size, sample(a + k * step * column), by)[0] for k in (1, -1))
        assert (ahead - behind) / (2 * step) == pytest.approx(slopes @ column, abs=1e-8)
    assert _size_of("amplitude", sample(a), by)[0] == pytest.approx(1.3)


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
