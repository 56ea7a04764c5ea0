"""Published systems whose contacts are springs, dampers and pieces, against published or exact
results (tests/reference/published_models.csv).
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.closed.orbits import find_orbits
from saltus.flow.maps import Stroboscope
from saltus.language.evaluate import evaluate
from saltus.models import (
    bang_bang,
    bilinear_rig,
    double_scroll,
    find,
    hertz_stop,
    one_sided_spring,
    soft_stop,
    switched_rotor,
    two_masses,
)

with (Path(__file__).parents[2] / "reference" / "published_models.csv").open() as file:
    ROWS = {(row["model"], row["quantity"]): row for row in csv.DictReader(file)}


def numbers(text):
    return np.array([float(part) for part in text.split(";")])


def known(model, quantity):
    return float(ROWS[model, quantity]["value"])


def orbit(system, start):
    """The orbit of one period near a state: a point of it and its multipliers."""
    map_, start = Stroboscope(system, sl.Taylor()), np.array([start], float)
    found = find_orbits(map_, start, np.array([1]), 1 + np.abs(start), np.array([map_.noise]))
    assert found.period.tolist() == [1]
    return found.points[0, 0], found.multipliers[0]


# -- times of contacts -----------------------------------------------------------------------------
@pytest.mark.parametrize("model", ["spring_rebound", "thrown_mass"])
def test_contacts_of_a_mass_and_a_spring(model):
    row = ROWS[model, "contact_times"]
    exact = numbers(row["value"])
    run = sl.simulate(find(model)(), numbers(row["start"]), t_end=1.5 * exact[-1])
    np.testing.assert_allclose(run.contact_time.values, exact, rtol=4 * 2.0**-52)


def test_force_and_impulse_of_a_rebound():
    """code_aster prints 9950.37 N and 198.02 N*s."""
    system = find("spring_rebound")()
    k, stop, mass = (system.values[name] for name in ("stiffness", "stop_stiffness", "mass"))
    end = math.pi / math.sqrt((k + stop) / mass)
    half = sl.simulate(system, (0.0, 1.0), t_end=end / 2)
    assert float(stop * half.end_x) == pytest.approx(9950.37190209989, rel=1e-14)
    # what the stop gives the mass, the spring's share k/(k + stop) left out
    run = sl.simulate(system, (0.0, 1.0), t_end=end)
    assert float(mass * (1 - run.end_v) * stop / (k + stop)) == pytest.approx(
        198.019801980198, rel=1e-13
    )


def test_switches_of_the_hertz_stop():
    run = sl.simulate(hertz_stop(), (0.0, 0.0), t_end=3.0)
    gap = run.contact_guard.values == "gap"
    times = run.contact_time.values
    assert times[gap][0] == pytest.approx(known("hertz_stop", "first_contact"), abs=5e-11)
    # the damper ends where the stop is deepest; turning points out of contact switch nothing
    inside = np.cumsum(gap) % 2 == 1
    assert np.count_nonzero(gap | inside) == known("hertz_stop", "switches")
    np.testing.assert_array_equal(run.contact_guard.values[inside & ~gap], "v = 0")


def test_the_frequency_of_a_one_sided_spring():
    start = (0.0, math.sqrt(2 * 0.00650108331626))
    run = sl.simulate(one_sided_spring(), start, t_end=4.0)
    inward = run.contact_time.values[::2]
    assert 1 / (inward[1] - inward[0]) == pytest.approx(
        known("one_sided_spring", "frequency"), rel=1e-14
    )


# -- limit cycle -----------------------------------------------------------------------------------
def test_the_limit_cycle_of_the_switched_rotor():
    found = sl.attractors(switched_rotor(), (0.1, 1.0), every=0.5, method=sl.Taylor(lanes=4))
    assert found.attractor_type.values.tolist() == ["limit_cycle"]
    assert found.attractor_cycle.item() == pytest.approx(
        known("switched_rotor", "period"), rel=1e-11
    )
    multipliers = np.sort(found.attractor_multiplier_real.values[0])
    np.testing.assert_allclose(
        multipliers, [known("switched_rotor", "multiplier"), 1.0], atol=1e-10
    )


# -- grazes ----------------------------------------------------------------------------------------
def linear_response(drive, damping, w):
    """State at t = 0 of the response of x'' + damping x' + x = Re(drive exp(iwt))."""
    z = drive / (1 - w**2 + 1j * damping * w)
    return z.real, (1j * w * z).real


@pytest.mark.parametrize("contact", [False, True])
def test_the_graze_of_the_bilinear_rig(contact):
    """The response without contact grows with the frequency, by about as much as that."""
    w = known("bilinear_rig", "graze") * (1 + (1e-9 if contact else -1e-9))
    system = bilinear_rig(frequency=w)
    values = system.values
    start = linear_response(-1j * values["amplitude"] * w**2, 2 * values["damping_ratio"], w)
    run = sl.simulate(system, start, periods=1, samples=512)
    assert (run.sizes["contact"] > 0) == contact
    assert float(np.abs(run.x).max()) == pytest.approx(values["gap"], abs=1e-4)


@pytest.mark.parametrize("contact", [False, True])
def test_the_graze_of_the_soft_stop(contact):
    """The response without contact falls with the frequency."""
    w = known("soft_stop", "graze") * (1 + (-1e-9 if contact else 1e-9))
    system = soft_stop(frequency=w)
    start = linear_response(system.values["force"], system.values["damping"], w)
    run = sl.simulate(system, start, periods=1, samples=512)
    assert (run.sizes["contact"] > 0) == contact
    assert float(np.abs(run.x).max()) == pytest.approx(1.0, abs=1e-4)


# -- folds, doublings, tori ------------------------------------------------------------------------
def fold(model, start, path, end, reach=2e-5):
    """Where det(M - 1) of a branch is 0, M the derivative of the map: near a fold the parameter is
    a power series in s = det(M - 1) without a linear term.
    """
    for w in path:
        start, _ = orbit(model(frequency=w), start)
    frequencies = end + reach * np.array([1, 0.75, 0.5, 0.25]) * np.sign(path[0] - end)
    determinants = []
    for w in frequencies:
        start, multipliers = orbit(model(frequency=w), start)
        determinants.append(np.prod(multipliers - 1).real)
    s = np.array(determinants)
    return np.linalg.solve(np.stack([s**0, s**2, s**3, s**4], axis=1), frequencies)[0]


def test_the_upper_fold_of_the_soft_stop():
    end = known("soft_stop", "upper_fold")
    path = end - np.array([0.5, 0.3, 0.15, 0.08, 0.04, 0.02, 0.01, 3e-3, 1e-3, 3e-4, 1e-4])
    first = sl.attractors(soft_stop(frequency=path[0]), (0.0, 2.5))
    start = [first.attractor_x.values[0, 0], first.attractor_v.values[0, 0]]
    assert fold(soft_stop, start, path, end) == pytest.approx(end, abs=1e-9)


def test_the_lower_fold_of_the_soft_stop():
    """Between it and the graze the response of small contacts is alone with the large one."""
    end, graze = known("soft_stop", "lower_fold"), known("soft_stop", "graze")
    path = end + np.array([3e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6])
    start = linear_response(1.0, 0.1, graze)
    assert fold(soft_stop, start, path, end, reach=1e-6) == pytest.approx(end, abs=1e-9)


def test_the_fold_of_the_two_masses():
    row = ROWS["two_masses", "fold"]
    end = float(row["value"])
    path = end - np.array([1e-6, 5e-6, 2e-5])
    assert fold(two_masses, numbers(row["start"]), path, end) == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize("quantity", ["period_doubling", "neimark_sacker"])
def test_where_the_two_masses_lose_stability(quantity):
    row = ROWS["two_masses", quantity]
    system = two_masses(frequency=float(row["value"]))
    start = numbers(row["start"])
    point, multipliers = orbit(system, start)
    np.testing.assert_allclose(point, start, atol=1e-9)  # the frequency has 12 digits
    leading = multipliers[np.abs(multipliers).argmax()]
    assert abs(leading) == pytest.approx(1.0, abs=1e-9)
    assert (abs(leading.imag) < 1e-9) == (quantity == "period_doubling")
    assert leading.real < 0.5


# -- forces that flip, slopes that change ----------------------------------------------------------
def test_bang_bang_without_the_cubic_term_is_a_closed_form():
    """Half a period maps a state of the response to its negative."""
    system = bang_bang(cubic=0.0, frequency=0.7)
    force, damping = system.values["force"], system.values["damping"]
    half = math.pi / 0.7
    w = math.sqrt(1 - damping**2 / 4)
    decay = math.exp(-damping * half / 2)
    c, s = decay * math.cos(w * half), decay * math.sin(w * half) / w
    flow = np.array([[c + damping / 2 * s, s], [-s, c - damping / 2 * s]])
    rest = np.array([force, 0.0])
    exact = np.linalg.solve(np.eye(2) + flow, (flow - np.eye(2)) @ rest)
    found = sl.attractors(system, (0.0, 0.0))
    point = [found.attractor_x.values[0, 0], found.attractor_v.values[0, 0]]
    np.testing.assert_allclose(point, exact, rtol=1e-11)


def test_the_twin_of_a_bang_bang_response_is_its_mirror_image_half_a_period_later():
    first = sl.simulate(bang_bang(), (0.3, -1.0), t_end=5.0)
    shifted = sl.simulate(bang_bang(), (-0.3, 1.0), t_start=math.pi, t_end=5.0 + math.pi)
    np.testing.assert_allclose(
        [float(shifted.end_x), float(shifted.end_v)],
        [-float(first.end_x), -float(first.end_v)],
        rtol=1e-11,
    )


def test_the_double_scroll_rests_where_it_should_and_turns_as_published():
    """Eigenvalues of Chua, Komuro and Matsumoto (1986), printed to three digits."""
    system = double_scroll()
    for rest, bits, real, pair in (
        ((0.0, 0.0, 0.0), [True, False], 2.22, -0.97 + 2.71j),
        ((1.5, 0.0, -1.5), [True, True], -3.94, 0.19 + 3.05j),
    ):
        np.testing.assert_allclose(system.rhs(0.0, np.array(rest)), 0.0, atol=1e-14)
        scope = dict(zip(system.states, rest, strict=True))
        rows = [
            evaluate(row, states=scope, values=system.values, bits=bits) for row in system.jacobian
        ]
        found = np.linalg.eigvals(np.array(rows, float))
        assert found[found.imag == 0].real == pytest.approx([real], abs=5e-3)
        assert found[found.imag > 0][0] == pytest.approx(pair, abs=7e-3)
