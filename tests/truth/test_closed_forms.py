"""Rows of tests/reference/closed_forms.csv that soft contacts can express, each by its id.

Left out: R05, R07, R11b (restitution: the state jumps), R08 (sticking), R10 (sliding along a
boundary), R09 (a thermostat's mode depends on its past, not on the state). They need jumps, sliding
or memory, which this version doesn't follow.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.codegen import blocks
from saltus.system import checks

EPS = 2.0**-52


def rows():
    with (Path(__file__).parents[1] / "reference" / "closed_forms.csv").open() as file:
        return {row["id"]: row["value"] for row in csv.DictReader(file)}


VALUES = rows()
STILL = {"cubic": 0.0, "damping_ratio": 0.0, "force": 0.0, "frequency": 1.0}


def magnet(frequency):
    """The rig's amplitude of force for a nominal 1 N: 1 - 18 / w^2."""
    return 1 - 18 / (2 * math.pi * frequency) ** 2


def swing(rig, amplitude, guess, per_period, periods=10):
    """Period [s] of a free vibration from a turning point: the time of ``periods`` returns to the
    same contact, divided.
    """
    run = sl.simulate(rig, (amplitude, 0.0), t_end=(periods + 1) * guess, samples=1)
    times = run.contact_time.values
    assert run.status.item() == "ok"
    assert set(run.contact_kind.values) == {"crossing"}
    return (times[per_period * periods] - times[0]) / periods


# -- free vibration --------------------------------------------------------------------------------


def test_r01_dead_zone_only():
    clearance = sl.models.delangre(
        "a",
        **{**STILL, "mass": 1.0, "natural_frequency": 0.0, "contact_stiffness": 1.0},
        lower_gap=1.0,
        upper_gap=1.0,
    )
    exact = float(VALUES["R01"])
    assert abs(swing(clearance, 2.0, exact, 4) - exact) < 4 * EPS * exact


@pytest.mark.parametrize(("row", "amplitude"), [("R02a", 0.5e-3), ("R02b", 1e-3)])
def test_r02_symmetric_freeplay(row, amplitude):
    exact = float(VALUES[row])
    assert (
        abs(swing(sl.models.delangre("a", **STILL), amplitude, exact, 4) - exact) < 16 * EPS * exact
    )


@pytest.mark.parametrize(("row", "stiffness"), [("R03a", 1.4e4), ("R03b", 7e4), ("R03c", 1.4e10)])
def test_r03_bilinear_frequency(row, stiffness):
    one_sided = sl.models.delangre(
        "b", **STILL, contact_stiffness=stiffness, lower_gap=1.0, upper_gap=0.0
    )
    exact = 1 / float(VALUES[row])
    assert abs(swing(one_sided, -1e-3, exact, 2) - exact) < 16 * EPS * exact


@pytest.mark.parametrize("angle", [0.3, 0.6, 0.9, 1.2, 1.5])
@pytest.mark.parametrize("turned", [1.0, 1.1, 1.6])
def test_arcsine_from_the_middle(angle, turned):
    """x = sin(w t) v/w meets a boundary at w t = angle. At the start the acceleration is zero: no
    curvature to judge a Newton step by.

    The run ends at w t = angle * turned, so that the contact lies in different places of its step.
    """
    speed, w = 0.02, 10 * math.pi
    place = speed / w * math.sin(angle)
    rig = sl.models.delangre("b", **STILL, lower_gap=10.0, upper_gap=place, contact_stiffness=1.0)
    run = sl.simulate(rig, (0.0, speed), t_end=angle * turned / w + 1e-9, samples=1)
    exact = math.asin(place * w / speed) / w
    assert run.sizes["contact"] >= 1
    assert abs(run.contact_time.values[0] - exact) < 8 * EPS * exact / math.cos(angle)
    assert abs(
        run.contact_velocity.values[0] - speed * math.cos(angle)
    ) < 8 * EPS * speed / math.cos(angle)


# -- grazing of a forced linear oscillator ---------------------------------------------------------


def steady_state(rig):
    """State at t = 0 of the linear rig's steady motion without contact, and its amplitude [m]."""
    p = rig.values
    wn, w = 2 * math.pi * p["natural_frequency"], 2 * math.pi * p["frequency"]
    motion = (
        p["force"]
        * magnet(p["frequency"])
        / p["mass"]
        / (wn**2 - w**2 + 2j * p["damping_ratio"] * wn * w)
    )
    return (motion.real, (1j * w * motion).real), abs(motion)


def contacts_in_steady_state(rig, periods=3):
    start, _ = steady_state(rig)
    return sl.simulate(rig, start, periods, samples=1)


@pytest.mark.parametrize("above", [1e-3, 1e-6, 1e-9])
def test_r06a_grazing_amplitude(above):
    w = 1 / (2 * math.pi)
    force = float(VALUES["R06a"]) / magnet(w)
    unit = sl.models.delangre(
        "b",
        mass=1.0,
        natural_frequency=w,
        damping_ratio=0.05,
        cubic=0.0,
        frequency=w,
        lower_gap=10.0,
        upper_gap=1.0,
        contact_stiffness=1e-12,
    )  # so soft a stop that the motion goes on beyond it
    assert abs(steady_state(unit.with_values(force=force))[1] - 1) < 4 * EPS
    touching = contacts_in_steady_state(unit.with_values(force=force * (1 + above)))
    missing = contacts_in_steady_state(unit.with_values(force=force * (1 - above)))
    assert set(touching.contact_guard.values) == {"upper_gap"}
    assert (touching.sizes["contact"], missing.sizes["contact"]) == (6, 0)
    apart = np.diff(touching.contact_time.values)[touching.contact_direction.values[:-1] > 0]
    assert np.allclose(apart, 2 * math.acos(1 / (1 + above)), rtol=1e-4 + EPS / above, atol=0)
    assert math.isclose(missing.smallest_gap_margin.item(), above, rel_tol=1e-4)


def test_r06b_grazing_frequency_of_the_rig():
    exact = float(VALUES["R06b"])
    rig = sl.models.delangre("a", cubic=0.0)
    amplitude = steady_state(rig.with_values(frequency=exact))[1]
    assert abs(amplitude - rig.values["upper_gap"]) < 8 * EPS * amplitude
    below = contacts_in_steady_state(rig.with_values(frequency=exact * (1 - 1e-9)))
    above = contacts_in_steady_state(rig.with_values(frequency=exact * (1 + 1e-9)))
    assert above.sizes["contact"] == 0  # beyond the resonance the motion gets smaller
    assert below.sizes["contact"] >= 4


# -- contacts whose force jumps --------------------------------------------------------------------


@pytest.fixture(scope="module")
def block():
    """A unit mass on a unit spring, on a rough table, before a Kelvin-Voigt stop at 0 that may or
    may not pull.
    """

    @sl.system(states="x v")
    def block(t, x, v, *, spring=0.0, friction=0.0, stiffness=1.0, damping=0.1, pull=1e9):
        stop = sl.piecewise((sl.max(stiffness * x + damping * v, -pull), x > 0), otherwise=0)
        return v, -spring * x - sl.piecewise((friction, v > 0), otherwise=-friction) - stop

    return block


def rebound(block):
    """Speed at which the block leaves the stop, thrown at it with unit speed."""
    run = sl.simulate(block, (-0.5, 1.0), t_end=10.0, samples=1)
    assert run.status.item() == "ok"
    assert run.end_x.item() < 0
    return -run.end_v.item()


def test_r12a_kelvin_voigt_stop(block):
    assert abs(rebound(block) - float(VALUES["R12a"])) < 8 * EPS


def test_r12b_stop_that_cannot_pull(block):
    assert abs(rebound(block.with_values(pull=0.0)) - float(VALUES["R12b"])) < 8 * EPS


def test_r11a_saltation_at_a_dry_friction_crossing(block):
    """d v(after) / d v(before) across v = 0, at x = -2.2: the accelerations' ratio. Times so short
    that the spring's force stands still.
    """
    slide = block.with_values(spring=1.0, friction=0.4)
    before = np.array([-2e-4, -1e-4])
    run = sl.simulate(slide, {"x": [-2.2, -2.2], "v": before}, t_end=2e-4, samples=1)
    assert run.sizes["contact"] == 2
    assert math.isclose(np.diff(run.end_v.values)[0] / 1e-4, float(VALUES["R11a"]), rel_tol=1e-6)


# -- invariants of the rig's orbits ----------------------------------------------------------------


def orbits():
    with (Path(__file__).parents[1] / "reference" / "orbits.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("row", orbits(), ids=lambda row: row["name"])
def test_r15_multipliers_and_exponents_of_orbits(row):
    """Monodromy by central differences of the flow, to fourth order: determinant exp(-2 zeta wn n
    T), multipliers as in orbits.csv.
    """
    rig = sl.models.delangre(
        "b",
        contact_stiffness=float(row["Kc_N_per_m"]),
        lower_gap=float(row["j1_m"]),
        upper_gap=float(row["j2_m"]),
        force=float(row["p_N"]),
        frequency=float(row["f_Hz"]),
    )
    size = np.array([1e-8, 1e-6])  # small beside the depth of the shallowest contact, 1e-6 m
    start = np.array([float(row["x0_m"]), float(row["v0_m_per_s"])])
    places = np.array(
        [start + k * size * direction for direction in np.eye(2) for k in (-2, -1, 1, 2)]
    )
    periods = int(row["period_in_T"])
    run = sl.simulate(rig, places, periods, samples=1, method=sl.Taylor(tolerance=EPS))
    ends = np.stack([run.end_x.values, run.end_v.values], axis=1).reshape(2, 4, 2)
    monodromy = (np.array([1, -8, 8, -1]) @ ends / 12 / size[:, None]).T
    span = periods * run.attrs["forcing_period_s"]
    total = math.log(np.linalg.det(monodromy)) / span
    assert math.isclose(total, float(VALUES["R15b"]), rel_tol=1e-6)
    multipliers = np.sort_complex(np.linalg.eigvals(monodromy))
    exact = np.sort_complex(
        [
            complex(text.strip("()").replace(" ", ""))
            for text in row["floquet_multipliers"].replace("i", "j").split(";")
        ]
    )
    assert np.allclose(multipliers, exact, rtol=0, atol=1e-6)
    exponent = math.log(np.max(np.abs(multipliers))) / span
    if row["LLE_per_s"]:
        assert math.isclose(exponent, float(row["LLE_per_s"]), rel_tol=1e-5)
    if np.all(multipliers.imag != 0):
        assert math.isclose(exponent, float(VALUES["R15a"]), rel_tol=1e-6)


@pytest.mark.parametrize("length", [24, 25])
@pytest.mark.slow
def test_an_oscillator_driven_by_many_harmonics(length, monkeypatch):
    """Its code is cut into blocks, here into short ones, at any place: between sine and cosine of a
    harmonic too.
    """
    monkeypatch.setattr(blocks, "WHOLE", 50)
    monkeypatch.setattr(blocks, "LENGTH", length)
    decay, end, orders = 0.05, 0.5, np.arange(1, 13)

    @sl.system(states="x v", forced_at="f", name=f"in blocks of {length}")
    def driven(t, x, v, *, k=1.0, c=2 * decay, f=1.0):
        return v, -k * x - c * v + sum(sl.cos(2 * sl.pi * n * f * t) / n**2 for n in range(1, 13))

    w, own = 2 * np.pi * orders, math.sqrt(1 - decay**2)
    steady = 1 / orders**2 / (1 - w**2 + 2j * decay * w)
    x, v = 0.3 - steady.real.sum(), -(1j * w * steady).real.sum()
    free = math.exp(-decay * end) * (
        x * math.cos(own * end) + (v + decay * x) / own * math.sin(own * end)
    )
    run = sl.simulate(driven, (0.3, 0.0), t_end=end, method=sl.Taylor(8), samples=1)
    assert run.end_x.item() == pytest.approx(
        free + (steady * np.exp(1j * w * end)).real.sum(), rel=1e-13
    )


def ladder(rungs):
    """A mass that meets one spring after the other: levels and the system."""
    levels = np.linspace(0.1, 0.9, rungs)

    @sl.system(states="x v")
    def ladder(t, x, v, *, k=0.05):
        return v, -x - sum(k * sl.max(x - float(level), 0.0) for level in levels)

    return levels, ladder


@pytest.mark.nightly
def test_as_many_boundaries_as_a_system_may_have():
    """Up through all of them and down again, with the energy that it began with."""
    levels, mass = ladder(52)
    run = sl.simulate(mass, (0.0, 2.0), t_end=4.0, samples=50, time_errors="local")
    x, v = run.end_x.item(), run.end_v.item()
    assert run.sizes["contact"] == 2 * 52
    assert run.mode.values.max() == 2**52 - 1
    assert v**2 / 2 + x**2 / 2 + 0.05 / 2 * (np.maximum(x - levels, 0) ** 2).sum() == pytest.approx(
        2.0, abs=1e-14
    )


def test_more_boundaries_than_that_are_refused(monkeypatch):
    assert checks.MOST_GUARDS == 52
    monkeypatch.setattr(checks, "MOST_GUARDS", 4)
    with pytest.raises(sl.SaltusError, match="5 boundaries, and at most 4"):
        ladder(5)
