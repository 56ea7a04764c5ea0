"""Backbones and nonlinear normal modes against closed forms and an independent solver."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import root
from scipy.special import ellipk

import saltus as sl
from saltus.errors import ParameterError

FREE = {"force": 0, "damping_ratio": 0}


@sl.system(states="x v")
def duffing(t, x, v, *, cubic=1.0):
    return v, -x - cubic * x**3


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def forced(t, x, v, *, c=0.2, cubic=0.0, force=1.0, omega=1.0):
    return v, force * sl.cos(omega * t + 0.3) - c * v - 4 * x - cubic * x**3


@sl.system(states="x v")
def between_walls(t, x, v, *, gap=1.0, restitution=1.0):
    stops = sl.impact(x < gap, v, restitution=restitution)
    return v, -x, stops, sl.impact(x > -gap, -v, restitution=restitution)


@sl.system(states="x y v w")
def two_masses(t, x, y, v, w, *, coupling=1.0, cubic=0.5):
    return v, w, -x - coupling * (x - y) - cubic * x**3, -y - coupling * (y - x)


def by_energy(case, high):
    """Frequency of the rig's free vibration with a largest displacement, by quadrature."""
    rig = sl.models.delangre(case).values
    natural = (2 * np.pi * rig["natural_frequency"]) ** 2

    def energy(x):
        into = max(x - rig["upper_gap"], 0.0) + min(x + rig["lower_gap"], 0.0)
        elastic = natural * x**2 / 2 + rig["cubic"] / rig["mass"] * x**4 / 4
        return elastic + rig["contact_stiffness"] / rig["mass"] * into**2 / 2

    low = -high
    for _ in range(60):  # the other turning point: Newton's method
        slope = (energy(low * (1 + 1e-7)) - energy(low * (1 - 1e-7))) / (2e-7 * low)
        low -= (energy(low) - energy(high)) / slope
    middle, half = (high + low) / 2, (high - low) / 2

    def pace(angle):
        x = middle + half * np.sin(angle)
        return half * np.cos(angle) / np.sqrt(2 * (energy(high) - energy(x)))

    kinks = [np.arcsin((edge - middle) / half) for edge in (-rig["lower_gap"], rig["upper_gap"])]
    ends = [-np.pi / 2, *kinks, np.pi / 2]
    parts = [quad(pace, *pair, epsabs=1e-13, epsrel=1e-12)[0] for pair in itertools.pairwise(ends)]
    return 1 / (2 * sum(parts))


@pytest.mark.parametrize(
    ("case", "high", "known"), [("a", 2e-3, 11.42066832049569), ("c", 3e-3, 12.47324906943082)]
)
def test_the_backbone_of_the_rig_by_its_energy(case, high, known):
    """``known``: an independent quadrature of the energy, to its last digits."""
    spine = sl.backbone(sl.models.delangre(case), ("0.1 mm", high), values=FREE)
    assert spine.attrs["end"] == "range"
    assert spine.point_output_maximum.values[-1, 0] == pytest.approx(high, rel=1e-12)
    assert spine.point_output_peak.values[0, 0] == pytest.approx(1e-4, rel=1e-12)
    assert spine.backbone_frequency.values[-1] == pytest.approx(by_energy(case, high), rel=1e-8)
    assert spine.backbone_frequency.values[-1] == pytest.approx(known, rel=1e-13)
    assert np.abs(spine.fictitious_damping).max() < 1e-9


@pytest.mark.parametrize("cubic", [0.1, 1.0])
def test_the_backbone_of_a_duffing_oscillator(cubic):
    """pi sqrt(1 + g A^2) / (2 K(m)), m = g A^2 / (2 (1 + g A^2))."""
    spine = sl.backbone(duffing, (0.01, 1.0), values={"cubic": cubic})
    a = spine.point_output_peak.values[:, 0]
    stiff = 1 + cubic * a**2
    exact = np.pi * np.sqrt(stiff) / (2 * ellipk(cubic * a**2 / (2 * stiff))) / (2 * np.pi)
    np.testing.assert_allclose(spine.backbone_frequency, exact, rtol=1e-11)
    # the same at A = 1, rad/s, from 40 digits
    known = {0.1: 1.0367169070746336, 1.0: 1.3177760649655266}[cubic]
    assert 2 * np.pi * spine.backbone_frequency.values[-1] == pytest.approx(known, rel=1e-14)


def test_the_backbones_of_rigid_stops():
    """M20: pi/(pi - acos(d/A)) on one side; M24: pi/(2 asin(d/A)), on both, A = v where x = 0."""
    one = sl.models.impact_oscillator(stiffness=1, gap=1)
    spine = sl.backbone(one, (1.3, 2.0), values={"force": 0, "damping": 0, "restitution": 1})
    assert spine.point_output_minimum.values[-1, 0] == pytest.approx(-2, abs=1e-12)
    assert 2 * np.pi * spine.backbone_frequency.values[-1] == pytest.approx(1.5, rel=1e-12)
    both = sl.backbone(between_walls, (1.2, 1.5), state="v")
    speed = both.point_output_peak.sel(output="v").values
    exact = 1 / (4 * np.arcsin(1 / speed))
    np.testing.assert_allclose(both.backbone_frequency, exact, rtol=1e-11)


@pytest.mark.parametrize("mode", [1, 2])
def test_a_nonlinear_normal_mode_closes_in_another_solver(mode):
    spine = sl.backbone(two_masses, (0.01, 1.2), mode=mode)
    linear = np.sqrt([1.0, 3.0])[mode - 1] / (2 * np.pi)
    assert spine.backbone_frequency.values[0] == pytest.approx(linear, rel=1e-4)
    assert spine.backbone_frequency.values[-1] > 1.02 * linear
    last = spine.isel(point=-1)
    start = [last[f"point_{state}"].item() for state in "xyvw"]

    def rates(_, s):
        x, y, v, w = s
        return [v, w, -x - (x - y) - 0.5 * x**3, -y - (y - x)]

    end = solve_ivp(
        rates, (0, last.point_period.item()), start, method="DOP853", rtol=1e-12, atol=1e-13
    ).y[:, -1]
    np.testing.assert_allclose(end, start, atol=1e-9)


# -- phase quadrature ------------------------------------------------------------------------------
def test_a_linear_oscillator_is_in_quadrature_at_its_natural_frequency():
    """The force is that of the damping alone."""
    spine = sl.backbone(forced, (0.01, 2.0), phase="quadrature")
    peak = spine.point_output_peak.sel(output="x").values
    assert (peak[0], peak[-1]) == pytest.approx((0.01, 2.0), rel=1e-12)
    np.testing.assert_allclose(spine.point_omega, 2.0, rtol=1e-14)
    np.testing.assert_allclose(spine.point_force, 0.2 * 2.0 * peak, rtol=1e-13)
    assert spine.point_stable.values.all()


def test_a_duffing_oscillator_in_quadrature_by_scipy():
    spine = sl.backbone(forced.with_values(cubic=1.0), (0.05, 2.0), phase="quadrature")
    last = spine.isel(point=-1)

    def defining(u):
        x, v, omega, force = u

        def rates(t, y):
            drive = np.cos(omega * t + 0.3)
            return [y[1], force * drive - 0.2 * y[1] - 4 * y[0] - y[0] ** 3, y[0] * drive]

        period = 2 * np.pi / omega
        run = solve_ivp(
            rates, (0, period), [x, v, 0.0], method="DOP853", rtol=1e-12, atol=1e-13,
            events=lambda t, y: y[1],
        )  # fmt: skip
        top = max(state[0] for state in run.y_events[0])
        return [run.y[0, -1] - x, run.y[1, -1] - v, run.y[2, -1], top - 2.0]

    known = [last[f"point_{name}"].item() for name in ("x", "v", "omega", "force")]
    other = root(defining, np.array(known) * (1 + 1e-4), tol=1e-11)
    np.testing.assert_allclose(known, other.x, rtol=1e-8, atol=1e-8)


def test_the_rig_in_quadrature_goes_over_into_free_vibration():
    """The frequencies differ by the square of the damping. The rig rests on its lower stop."""
    rig = sl.models.delangre("b").with_values(damping_ratio=4e-3)
    spine = sl.backbone(rig, ("0.3 mm", "1 mm"), phase="quadrature", points=200)
    assert spine.attrs["end"] == "range"
    high = spine.point_output_maximum.values[-1, 0]
    assert spine.backbone_frequency.values[-1] == pytest.approx(by_energy("b", high), rel=4e-3**2)


def test_what_has_no_quadrature_is_said_in_a_sentence():
    wrong = {
        "isn't forced": (duffing, {}),
        "no parameter 'forces'": (forced, {"force": "forces"}),
        "isn't the amplitude of a force": (forced, {"force": "c"}),
        "1 modes of small": (forced, {"mode": 2}),
    }
    for message, (system, more) in wrong.items():
        with pytest.raises(ParameterError, match=message):
            sl.backbone(system, (0.1, 1.0), phase="quadrature", **more)
    with pytest.raises(ParameterError, match='phase= is "free" or "quadrature"'):
        sl.backbone(forced, (0.1, 1.0), phase="90 degrees")


# -- the verb --------------------------------------------------------------------------------------
def test_what_has_no_backbone_is_said_in_a_sentence():
    rig = sl.models.delangre("a")
    wrong = {
        "its equations depend on time": (rig, ("0.1 mm", "2 mm"), {}),
        "undamped modes": (rig, ("0.1 mm", "2 mm"), {"values": {"force": 0}}),
        "must ascend from above zero": (rig, ("2 mm", "0.1 mm"), {"values": FREE}),
        "has no state 'z'": (rig, ("0.1 mm", "2 mm"), {"values": FREE, "state": "z"}),
        "2 undamped modes": (two_masses, (0.01, 1.0), {"mode": 3}),
        "doesn't conserve energy": (
            between_walls, (1.2, 1.5), {"state": "v", "values": {"restitution": 0.9}},
        ),
    }  # fmt: skip
    for message, (system, amplitude, more) in wrong.items():
        with pytest.raises(ParameterError, match=message):
            sl.backbone(system, amplitude, **more)


def test_a_backbone_as_a_picture():
    spine = sl.backbone(sl.models.delangre("a"), ("0.1 mm", "1 mm"), values=FREE)
    ax = sl.plot.backbone(spine)
    (line,) = [line for line in ax.lines if line.get_gid() == "backbone"]
    x, y = np.array(line.get_data())[:, np.isfinite(line.get_xdata())]
    np.testing.assert_allclose(x, spine.backbone_frequency)
    np.testing.assert_allclose(y, spine.point_output_peak[:, 0] * 1e3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("frequency [Hz]", "peak |x| [mm]")
    assert "5.00" in sl.describe(spine)
