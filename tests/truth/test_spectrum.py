"""Spectra against the closed form of a linear oscillator, Parseval's relation, and lines whose
places are known.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import lab, pair
from saltus.errors import ParameterError

#: m = 1, c = 0.3, k = 4, force 0.7 N at 0.5 Hz, a constant lift of 0.2 N; no contact.
LINEAR = {
    "spring": 4.0,
    "damping": 0.3,
    "force": 0.7,
    "frequency": 0.5,
    "lift": 0.2,
    "boundary": 50.0,
}
#: Settles to 5T; with a softer stop it doesn't repeat.
SUBHARMONIC = {
    "spring": 0.2,
    "damping": 0.1,
    "force": 0.8,
    "boundary": 0.3,
    "stiffness": 100.0,
    "frequency": 0.3,
}
STOP = {
    "spring": 1.0,
    "damping": 0.1,
    "force": 0.8,
    "boundary": 0.3,
    "stiffness": 40.0,
    "frequency": 0.2,
}


def steady():
    """Complex amplitude of the steady response of LINEAR: x = X exp(iwt), and its
    state at t = 0.
    """
    w = 2 * math.pi * 0.5
    line = 0.7 / (4.0 - w**2 + 0.3j * w)
    return line, (0.05 + line.real, (1j * w * line).real)


def mean_square(amplitude):
    return amplitude[0] ** 2 + (amplitude[1:-1] ** 2).sum() / 2 + amplitude[-1] ** 2


@pytest.fixture(scope="module")
def contacting():
    """A periodic response with contacts."""
    return sl.simulate(
        lab, (0.0, 0.0), periods=400, keep=12, samples=256, values=STOP, time_errors="local"
    )


def test_a_linear_response_is_one_line_and_its_mean():
    line, start = steady()
    run = sl.simulate(lab, start, periods=8, values=LINEAR)
    found = sl.spectrum(run)
    assert (int(found.response_period), str(found.window.values)) == (1, "none")
    assert found.order.values[1] == 1.0
    assert found.frequency.values[1] == 0.5
    assert found.x_amplitude.values[0] == pytest.approx(0.2 / 4.0, rel=1e-12)
    assert found.x_amplitude.values[1] == pytest.approx(abs(line), rel=1e-12)
    assert found.x_phase.values[1] == pytest.approx(cmath.phase(line), abs=1e-12)
    assert found.v_amplitude.values[1] == pytest.approx(abs(line) * math.pi, rel=1e-12)
    assert found.x_amplitude.values[2:].max() < 1e-13


def test_the_phase_doesnt_depend_on_where_the_samples_begin():
    line, start = steady()
    run = sl.simulate(lab, start, periods=8, keep=5, values=LINEAR)
    for part in (run, run.isel(time=slice(137, None))):
        assert sl.spectrum(part).x_phase.values[1] == pytest.approx(cmath.phase(line), abs=1e-12)
    turned = line * cmath.exp(1j * math.pi * 0.3)  # the state of the same motion at t = 0.3 s
    later = sl.simulate(
        lab,
        (0.05 + turned.real, (1j * math.pi * turned).real),
        periods=8,
        t_start=0.3,
        values=LINEAR,
    )
    assert sl.spectrum(later).x_phase.values[1] == pytest.approx(cmath.phase(line), abs=1e-12)


def test_a_hann_window_keeps_the_height_of_a_line():
    line, start = steady()
    run = sl.simulate(lab, start, periods=8, values=LINEAR)
    found = sl.spectrum(run, "x", window="hann", last=8)
    at = int(np.argmax(found.x_amplitude.values[1:])) + 1
    assert found.order.values[at] == 1.0
    assert found.x_amplitude.values[at] == pytest.approx(abs(line), rel=1e-12)
    assert found.x_amplitude.values[0] == pytest.approx(0.05, rel=1e-12)
    assert float(found.noise_bandwidth) == pytest.approx(1.5, rel=1e-15)
    # the window's own two neighbours
    assert found.x_amplitude.values[at - 1] == pytest.approx(abs(line) / 2, rel=1e-12)
    assert "v_amplitude" not in found


def test_parseval_with_contacts(contacting):
    found = sl.spectrum(contacting)
    n = int(found.response_period)
    assert n > 0
    for name in ("x", "v"):
        samples = contacting[name].values[-n * 256 - 1 : -1]
        assert mean_square(found[f"{name}_amplitude"].values) == pytest.approx(
            np.mean(samples**2), rel=1e-13
        )
    hann = sl.spectrum(contacting, window="hann", last=12)
    power = hann.x_amplitude.values[0] ** 2 + (hann.x_amplitude.values[1:] ** 2).sum() / 2 / float(
        hann.noise_bandwidth
    )
    # exact for lines of whole periods
    assert power == pytest.approx(np.mean(contacting.x.values[:-1] ** 2), rel=1e-9)


def test_lines_of_a_response_lie_on_multiples_of_its_own_frequency(contacting):
    found = sl.spectrum(contacting)
    n = int(found.response_period)
    assert found.order.values == pytest.approx(np.arange(n * 128 + 1) / n, rel=1e-15)
    many = sl.spectrum(contacting, last=12)
    whole = many.order.values * n == np.round(many.order.values * n)
    assert many.x_amplitude.values[~whole].max() < 1e-7 * many.x_amplitude.values.max()
    assert many.x_amplitude.values[whole] == pytest.approx(found.x_amplitude.values, abs=1e-7)


def test_only_whole_responses_are_taken_and_what_doesnt_repeat_gets_a_window():
    """Beside a 5T response the undamped free motion of an oscillator without a stop: its frequency
    isn't commensurate with the force's.
    """
    values = SUBHARMONIC | {"stiffness": [100.0, 0.0], "damping": [0.1, 0.0]}
    run = sl.simulate(
        lab, (0.0, 0.0), periods=500, keep=24, samples=64, time_errors="local", values=values
    )
    found = sl.spectrum(run, "x", last=24)
    assert found.response_period.values.tolist() == [5, 0]
    assert found.window.values.tolist() == ["none", "hann"]
    # of 24 periods 20 are whole responses
    assert found.order.values[1] == pytest.approx(1 / 20, rel=1e-15)
    between = np.arange(found.sizes["frequency"]) % 4 != 0
    lines = found.x_amplitude.values
    assert lines[0, between].max() < 1e-6 * lines[0].max()
    assert lines[1, between].max() > 1e-3 * lines[1].max()


def test_a_system_without_forcing():
    run = sl.simulate(
        pair,
        (1.0, 0.0, 0.3, 0.0),
        t_end=40 * math.pi,
        samples=400,
        values={"spring": 1.0, "stop1": 9, "stop2": 9, "gap": 9},
    )
    found = sl.spectrum(run)
    assert str(found.window.values) == "hann"
    assert "order" not in found
    assert found.frequency.values[20] == pytest.approx(1 / (2 * math.pi), rel=1e-14)
    assert found.x1_amplitude.values[20] == pytest.approx(1.0, rel=1e-11)
    assert found.x2_amplitude.values[20] == pytest.approx(0.3, rel=1e-11)


def test_trajectories_share_a_stretch_of_whole_responses():
    run = sl.simulate(
        lab,
        (0.0, 0.0),
        periods=300,
        keep=12,
        values=STOP | {"stiffness": [40.0, 20.0]},
        time_errors="local",
    )
    both = sl.spectrum(run)
    alone = sl.spectrum(run.isel(trajectory=1))
    assert both.x_amplitude.dims == ("trajectory", "frequency")
    assert both.x_amplitude.values[1].max() == pytest.approx(
        alone.x_amplitude.values.max(), rel=1e-9
    )
    tuned = sl.spectrum(
        sl.simulate(
            lab,
            (0.0, 0.0),
            periods=20,
            values=LINEAR | {"frequency": [0.5, 0.25]},
            time_errors="local",
        )
    )
    assert tuned.x_amplitude.dims == ("trajectory", "order")
    assert tuned.frequency.values == pytest.approx(
        np.outer([0.5, 0.25], tuned.order.values), rel=1e-14
    )


@pytest.mark.parametrize(
    ("change", "arguments", "words"),
    [
        (lambda run: run, {"window": "han"}, "Did you mean 'hann'"),
        (lambda run: run, {"state": "y"}, "no state 'y'"),
        (lambda run: run, {"last": 40}, "12 whole forcing periods were kept"),
        (lambda run: run.isel(time=np.r_[0:300, 301 : run.sizes["time"]]), {}, "evenly spaced"),
        (lambda run: run.isel(time=slice(1, 200)), {}, "a whole forcing period"),
        (lambda run: run.drop_attrs(), {}, "no attribute 'saltus_result'"),
    ],
)
def test_runs_without_a_spectrum(contacting, change, arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.spectrum(change(contacting), **arguments)
