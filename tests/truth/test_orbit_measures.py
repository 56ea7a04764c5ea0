"""The numbers of an orbit against closed forms: the linear oscillator, exact arcs between contacts,
superposition, clipped cosines.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import saltus as sl
from conformance.systems import lab
from saltus.analysis.closed.measures import measure
from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import ParameterError, TraceError
from saltus.flow.maps import Stroboscope

LINEAR = lab.with_values(spring=1.0, damping=0.1, force=0.6, boundary=50.0)
FREQUENCIES = np.array([0.05, 0.12, 0.159, 0.2, 0.4])
OUTPUTS = {
    "applied": (lambda t, force, frequency: force * sl.cos(2 * sl.pi * frequency * t), "N"),
    "transmitted": lambda x, v, spring, damping: spring * x + damping * v,
}


def numbers(system, states, periods, method=None, outputs=None):
    family = Stroboscope(
        system, method or sl.Taylor(), np.tile(list(system.values.values()), (len(states), 1))
    )
    return measure(
        family, np.array(states, float), np.array(periods), outputs=outputs_of(system, outputs)
    )


def receptance(frequency, spring=1.0, damping=0.1):
    w = 2 * math.pi * np.asarray(frequency)
    return 1 / (spring - w**2 + 1j * damping * w)


# -- the linear oscillator -------------------------------------------------------------------------
@pytest.fixture(scope="module")
def linear():
    """Without contact, about a mean of 2."""
    return sl.frequency_response(
        LINEAR.with_values(lift=2.0), FREQUENCIES, start=(0.1, 0.0), outputs=OUTPUTS
    )


def test_first_harmonics_are_the_frequency_response_function(linear):
    w, exact = 2 * math.pi * FREQUENCIES, 0.6 * receptance(FREQUENCIES)
    for name, value in (("x", exact), ("v", 1j * w * exact), ("applied", 0.6 + 0j * w)):
        one = linear.sel(output=name)
        np.testing.assert_allclose(
            one.output_amplitude * np.exp(1j * one.output_phase), value, rtol=1e-11
        )


def test_sizes_are_those_of_a_cosine_about_its_mean(linear):
    amplitude, x = 0.6 * np.abs(receptance(FREQUENCIES)), linear.sel(output="x")
    expected = {
        "maximum": 2 + amplitude, "minimum": 2 - amplitude, "peak_to_peak": 2 * amplitude,
        "mean": 2 + 0 * amplitude,
        "rms_about_mean": amplitude / math.sqrt(2), "rms": np.sqrt(4 + amplitude**2 / 2),
        "peak": np.maximum(2 + amplitude, amplitude - 2),
    }  # fmt: skip
    for name, value in expected.items():
        np.testing.assert_allclose(x[f"output_{name}"], value, rtol=1e-11)
    np.testing.assert_array_equal(linear.response_peak, x.output_peak)
    np.testing.assert_array_equal(linear.response_rms, x.output_rms)


def test_the_ratio_of_two_first_harmonics_is_the_transmissibility(linear):
    """Of a mass on spring and damper, after Inman, Engineering Vibration, section 2.4."""
    w = 2 * math.pi * FREQUENCIES
    exact = (1.0 + 0.1j * w) * receptance(FREQUENCIES)
    ratio = sl.transmissibility(linear, "transmitted", "applied")
    np.testing.assert_allclose(
        ratio.transmissibility * np.exp(1j * ratio.transmissibility_phase), exact, rtol=1e-11
    )


def test_superposition(linear):
    """A mean load moves the mean and nothing else."""
    without = sl.frequency_response(LINEAR, FREQUENCIES, start=(0.1, 0.0), outputs=OUTPUTS)
    for name in ("peak_to_peak", "rms_about_mean", "amplitude", "phase"):
        np.testing.assert_allclose(linear[f"output_{name}"], without[f"output_{name}"], rtol=1e-11)
    np.testing.assert_allclose(without.output_mean, 0.0, atol=1e-13)


def test_a_small_motion_about_a_large_mean_keeps_its_digits():
    system = LINEAR.with_values(lift=1000.0, force=1e-9, boundary=5000.0, frequency=0.2)
    x = 1e-9 * receptance(0.2)
    known = numbers(system, [(1000 + x.real, -(0.4 * math.pi * x).imag)], [1])
    # a state of 1000 has 1e-13
    assert known.deviation[0, 0] == pytest.approx(abs(x) / math.sqrt(2), rel=1e-3)
    assert abs(known.harmonic[0, 0]) == pytest.approx(abs(x), rel=1e-3)


def test_a_start_that_turns_is_counted_once():
    """Undamped: the stroboscopic point is the turning point itself, and its margin that of the gap
    there.
    """
    system = LINEAR.with_values(damping=0.0, frequency=0.2, boundary=1.5, force=0.6)
    x = 0.6 * receptance(0.2, damping=0.0).real
    known = numbers(system, [(x, 0.0)], [1])
    assert known.margin[0] == pytest.approx(1.5 - abs(x), rel=1e-12)
    np.testing.assert_allclose(np.sort(known.turning[0][:, 0]), [-abs(x), abs(x)], rtol=1e-12)


def test_rest_turns_nowhere():
    known = numbers(LINEAR.with_values(force=0.0, boundary=2.0, lift=0.5), [(0.5, 0.0)], [1])
    assert known.maximum[0].tolist() == known.minimum[0].tolist() == [0.5, 0.0]
    assert (known.margin[0], known.deviation[0, 0], len(known.turning[0])) == (1.5, 0.0, 1)


# -- functions with boundaries of their own --------------------------------------------------------
def test_a_clipped_cosine_has_its_closed_form():
    """The part of x above a level at which the equations know nothing."""
    level = 0.05
    ds = sl.frequency_response(
        LINEAR, FREQUENCIES, start=(0.1, 0.0), outputs={"above": lambda x: sl.max(x - 0.05, 0)}
    )
    a = 0.6 * np.abs(receptance(FREQUENCIES))
    angle, above = np.arccos(level / a), ds.sel(output="above")
    np.testing.assert_allclose(above.output_peak, a - level, rtol=1e-11)
    np.testing.assert_allclose(
        above.output_mean, (np.sqrt(a**2 - level**2) - level * angle) / math.pi, rtol=1e-10
    )
    square = ((a**2 + 2 * level**2) * angle - 3 * level * np.sqrt(a**2 - level**2)) / (2 * math.pi)
    np.testing.assert_allclose(above.output_rms, np.sqrt(square), rtol=1e-10)
    np.testing.assert_allclose(
        above.output_amplitude,
        (a * angle - level * np.sqrt(1 - (level / a) ** 2)) / math.pi,
        rtol=1e-10,
    )


# -- exact arcs ------------------------------------------------------------------------------------
def arcs(x, v, stiffness, period, boundary=0.5, force=0.6, damping=0.1):
    """One period of a unit mass on a spring of 1 N/m with a stop, in closed form: (begin, end,
    x(t), x'(t), in contact) of each arc.
    """
    w, t, result = 2 * math.pi / period, 0.0, []
    inside = x > boundary
    while t < period:
        spring, rest = (
            (1 + stiffness, stiffness * boundary / (1 + stiffness)) if inside else (1.0, 0.0)
        )
        p, wd = force / complex(spring - w * w, damping * w), math.sqrt(spring - damping**2 / 4)
        a = x - rest - (p * np.exp(1j * w * t)).real
        b = (v - (1j * w * p * np.exp(1j * w * t)).real + damping / 2 * a) / wd

        def place(s, t=t, p=p, a=a, b=b, wd=wd, rest=rest):
            free = math.exp(-damping / 2 * (s - t)) * (
                a * math.cos(wd * (s - t)) + b * math.sin(wd * (s - t))
            )
            return rest + (p * np.exp(1j * w * s)).real + free

        def speed(s, t=t, p=p, a=a, b=b, wd=wd):
            c, d = b * wd - damping / 2 * a, a * wd + damping / 2 * b
            free = math.exp(-damping / 2 * (s - t)) * (
                c * math.cos(wd * (s - t)) - d * math.sin(wd * (s - t))
            )
            return (1j * w * p * np.exp(1j * w * s)).real + free

        end, step = period, 0.02 / wd
        grid = np.append(np.arange(t + 1e-6 / wd, period, step), period)
        outside = np.array([place(s) > boundary for s in grid]) != inside
        if outside.any():
            k = int(np.argmax(outside))
            end = brentq(
                lambda s, f=place: f(s) - boundary, grid[max(k - 1, 0)], grid[k], xtol=1e-16
            )
        result.append((t, end, place, speed, inside))
        t, x, v, inside = end, boundary, speed(end), not inside
    return result


@pytest.mark.parametrize("stiffness", [9.0, 1e4, 1e6])
def test_peak_margin_and_means_are_those_of_exact_arcs(stiffness):
    """The margin to the next graze above all: how deep the stop is pressed in, a thousandth of the
    motion in a thousandth of a period.
    """
    frequency = 1.1 / (2 * math.pi)
    system = LINEAR.with_values(boundary=0.5, stiffness=stiffness)
    given = {
        "stop": (
            lambda x, boundary, stiffness: sl.piecewise(
                (stiffness * (x - boundary), x > boundary), otherwise=0
            ),
            "N",
        )
    }
    ds = sl.frequency_response(system, np.array([frequency]), start=(0.0, 0.0), outputs=given)
    table = sl.attractors(system.with_values(frequency=frequency), (0.0, 0.0))
    whole = arcs(float(ds.response_x[0, 0]), float(ds.response_v[0, 0]), stiffness, 1 / frequency)
    turns = []
    for begin, end, place, speed, _ in whole:
        grid = np.linspace(begin, end, 60)
        signs = np.array([speed(s) > 0 for s in grid])
        turns += [
            place(brentq(speed, grid[i], grid[i + 1], xtol=1e-16))
            for i in np.flatnonzero(signs[1:] != signs[:-1])
        ]
    margin, peak = np.abs(np.array(turns) - 0.5).min(), np.abs(turns).max()
    integrals = [
        sum(
            quad(lambda s, f=f, n=n: f(s) ** n, a, b, epsabs=1e-14, limit=200)[0]
            for a, b, f, *_ in whole
        )
        for n in (1, 2)
    ]
    rms, mean = math.sqrt(integrals[1] * frequency), integrals[0] * frequency
    x, stop = ds.sel(output="x"), ds.sel(output="stop")
    assert ds.response_margin.item() == pytest.approx(margin, rel=1e-9)
    assert (ds.response_peak.item(), x.output_mean.item(), ds.response_rms.item()) == pytest.approx(
        (peak, mean, rms), rel=1e-11
    )
    assert stop.output_peak.item() == pytest.approx(stiffness * (max(turns) - 0.5), rel=1e-9)
    # a contact ends within rounding
    assert stop.output_minimum.item() == pytest.approx(0.0, abs=1e-15 * stiffness)
    assert table.attractor_margin.item() == pytest.approx(margin, rel=1e-9)
    assert (table.attractor_peak.item(), table.attractor_rms.item()) == pytest.approx(
        (peak, rms), rel=1e-11
    )


# -- methods with errors ---------------------------------------------------------------------------
@pytest.mark.parametrize("events", ["locate", "ignore"])
def test_ode45_has_the_numbers_of_its_own_motion(events):
    system = LINEAR.with_values(boundary=0.5, stiffness=9.0, frequency=1.1 / (2 * math.pi))
    exact = sl.attractors(system, (0.0, 0.0))
    start = [(float(exact.attractor_x[0, 0]), float(exact.attractor_v[0, 0]))]
    known, other = (
        numbers(system, start, [1]),
        numbers(system, start, [1], sl.ODE45(1e-9, 1e-12, events=events)),
    )
    for name in ("maximum", "minimum", "mean", "deviation", "harmonic"):
        np.testing.assert_allclose(getattr(other, name), getattr(known, name), rtol=1e-6, atol=1e-7)
    assert other.margin[0] == pytest.approx(known.margin[0], rel=1e-6)


# -- what users write ------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ([1.0], ParameterError, "must be a mapping such as"),
        ({"x": lambda x: x}, ParameterError, "has a state of this name"),
        ({"stop": lambda y: y}, TraceError, "asks for 'y'"),
        ({"stop": 3.0}, TraceError, "must be a function"),
    ],
)
def test_a_wrong_output_says_what_to_write(given, error, words):
    with pytest.raises(error, match=words):
        sl.frequency_response(LINEAR, FREQUENCIES, outputs=given)


def test_a_table_has_a_column_for_each_number_of_each_output(linear, tmp_path):
    header = sl.to_csv(linear, tmp_path / "linear.csv").read_text().splitlines()
    columns = next(line for line in header if not line.startswith("#")).split(",")
    assert {
        "applied amplitude [N]",
        "applied phase [rad]",
        "x peak to peak",
        "transmitted rms about mean",
    } <= set(columns)
    sl.save(linear, tmp_path / "linear.nc")
    assert sl.load(tmp_path / "linear.nc").identical(linear)


def test_an_impact_at_a_speed_is_no_graze():
    """A rigid stop turns the gap at zero: what counts is where it turns by itself, as in a run."""
    system = sl.models.impact_oscillator(restitution=0.5, gap=0.2)
    found = sl.attractors(system, (0.0, 0.0))
    assert found.attractor_contacts.item() == 1.0
    run = sl.simulate(system, (0.0, 0.0), periods=3000, keep=1)
    orbit = sl.simulate(system, (run.end_x.item(), run.end_v.item()), periods=3)
    margin = found.attractor_margin.item()
    assert margin == pytest.approx(orbit.smallest_gap_margin.item(), rel=1e-9)
    assert margin > 0.1
    assert sl.lyapunov(system, (0.0, 0.0), periods=300).near_graze.item() == 0
