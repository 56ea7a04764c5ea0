"""Fits to measured responses, across a jump."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.sizes import OrbitParts
from saltus.analysis.fits.steady import SteadyResponses
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


def sizes_of_a_saw(size, slope, jump, at):
    """Sizes of slope t - 0.3 sin 2 pi t, which jumps at an instant, over the period 1."""

    def value(t, behind):
        return slope * t - 0.3 * np.sin(2 * np.pi * t) - jump * behind

    t, weights = np.polynomial.legendre.leggauss(40)
    legs = [(0.5 * at * (t + 1), 0.5 * at), (at + 0.5 * (1 - at) * (t + 1), 0.5 * (1 - at))]
    parts = [(t, half * weights, value(t, k)) for k, (t, half) in enumerate(legs)]
    if size == "peak":
        return abs(value(at, 1))
    if size == "rms":
        return np.sqrt(sum(w @ y**2 for _, w, y in parts))
    return abs(2 * sum(w @ (y * np.exp(-2j * np.pi * t)) for t, w, y in parts))


@pytest.mark.parametrize("size", ["amplitude", "rms", "peak"])
def test_derivatives_of_sizes_are_limits_of_differences_through_a_jump(size):
    slope, jump, at = values = np.array([0.2, 1.3, 0.37])
    parts = OrbitParts.of(np.array([at]), np.array([[0.0, 0.0, 1.0]]), 1.0, 0.04)
    t, none = parts.times, np.zeros(len(parts.times))
    y = slope * t - 0.3 * np.sin(2 * np.pi * t) - jump * (t > at)
    by = np.stack([t, -1.0 * (t > at), none], axis=1)
    slopes = parts.slopes(size, y[:, None], by[:, None], 2 * np.pi)[0]
    step = 1e-3 * np.array([1.0, -8.0, 8.0, -1.0])
    for i in range(3):
        moved = values + np.outer([-2e-3, -1e-3, 1e-3, 2e-3], np.eye(3)[i])
        each = [sizes_of_a_saw(size, *one) for one in moved]
        assert slopes[i] == pytest.approx(step @ each / 12e-6, abs=1e-9)


@pytest.mark.parametrize("size", ["amplitude", "rms", "peak"])
def test_the_size_of_an_output_that_stays_zero_doesnt_change(size):
    parts = OrbitParts.of(np.zeros(0), np.zeros((0, 1)), 1.0, 0.1)
    none = np.zeros((len(parts.times), 1, 1))
    assert parts.slopes(size, none[..., 0], none, 2 * np.pi).tolist() == [[0.0]]


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
