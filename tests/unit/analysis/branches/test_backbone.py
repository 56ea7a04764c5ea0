"""Backbones and nonlinear normal modes against closed forms and an independent solver."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipk

import saltus as sl
from saltus.errors import ParameterError

FREE = {"force": 0, "damping_ratio": 0}


@sl.system(states="x v")
def duffing(t, x, v, *, cubic=1.0):
    return v, -x - cubic * x**3


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


@pytest.mark.parametrize(("case", "high"), [("a", 2e-3), ("c", 3e-3)])
def test_the_backbone_of_the_rig_by_its_energy(case, high):
    spine = sl.backbone(sl.models.delangre(case), ("0.1 mm", high), values=FREE)
    assert spine.attrs["end"] == "range"
    assert spine.point_output_maximum.values[-1, 0] == pytest.approx(high, rel=1e-12)
    assert spine.point_output_peak.values[0, 0] == pytest.approx(1e-4, rel=1e-12)
    assert spine.backbone_frequency.values[-1] == pytest.approx(by_energy(case, high), rel=1e-8)
    assert np.abs(spine.fictitious_damping).max() < 1e-9


def test_the_backbone_of_a_duffing_oscillator():
    """pi sqrt(1 + g A^2) / (2 K(m)), m = g A^2 / (2 (1 + g A^2))."""
    spine = sl.backbone(duffing, (0.01, 1.0))
    a = spine.point_output_peak.values[:, 0]
    stiff = 1 + a**2
    exact = np.pi * np.sqrt(stiff) / (2 * ellipk(a**2 / (2 * stiff))) / (2 * np.pi)
    np.testing.assert_allclose(spine.backbone_frequency, exact, rtol=1e-11)


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
    np.testing.assert_allclose(line.get_xdata(), spine.backbone_frequency)
    np.testing.assert_allclose(line.get_ydata(), spine.point_output_peak[:, 0] * 1e3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("frequency [Hz]", "peak |x| [mm]")
    assert "5.00" in sl.describe(spine)
