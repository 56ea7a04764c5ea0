"""Motions that aren't isolated, as where static friction holds a body, and contacts that are held
all the time: against closed forms.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors import unsettled
from saltus.errors import ParameterError

#: Below its limit the joint is a spring that ends anywhere: x and the joint go together.
ELASTIC = sl.models.jenkins_oscillator(force=0.075)
DAMPING, STIFFNESS = (
    ELASTIC.values["damping"],
    sum(ELASTIC.values[name] for name in ("stiffness", "joint_stiffness")),
)


@sl.system(states="x v y w", forced_at="frequency")
def pressed(t, x, v, y, w, *, stiffness=4.0, damping=0.2, link=0.3, preload=5.0, frequency=0.5):
    pull = link * (x - y)
    rates = v, sl.cos(2 * sl.pi * frequency * t) - stiffness * x - damping * v - pull, w
    return *rates, pull - 3 * y - 0.1 * w + preload, sl.impact(y < 0.1, w, restitution=0.5)


@sl.system(states="x v")
def block(t, x, v, *, stiffness=2.0, slip=0.3, stick=0.5):
    return v, -stiffness * x - sl.friction(v, slip=slip, stick=stick)


def size(found, prefix):
    return np.hypot(found[f"{prefix}_multiplier_real"], found[f"{prefix}_multiplier_imag"]).values


def test_a_joint_that_never_yields_leads_to_one_family():
    """Two multipliers are those of the linear oscillator, the third is 1; each response is that of
    the linear oscillator about a place of its own.
    """
    offsets = np.array([0.0, 0.1, -0.2])
    found = sl.attractors(ELASTIC, {"x": 0.0, "v": 0.0, "joint": offsets})
    period = ELASTIC.period(ELASTIC.values)
    decay = np.exp(-DAMPING / 2 * period)
    assert found.sizes["attractor"] == 1
    assert found["basin"].values.tolist() == [0, 0, 0]
    np.testing.assert_allclose(size(found, "attractor")[0], [1.0, decay, decay], rtol=1e-9)
    assert "family   1 of these" in sl.describe(found)
    exponents = sl.lyapunov(ELASTIC, (0.0, 0.0, 0.1), periods=64)
    assert exponents["kind"].item() == "periodic"
    np.testing.assert_allclose(
        exponents["lyapunov_exponent"].values[0], [0, -DAMPING / 2, -DAMPING / 2], atol=1e-9
    )
    frequency = np.linspace(0.2, 0.8, 4)
    response = sl.frequency_response(ELASTIC, frequency.tolist(), start=(0.0, 0.0, 0.0))
    peak = 0.075 / np.abs(STIFFNESS - frequency**2 + 1j * DAMPING * frequency)
    np.testing.assert_allclose(response["response_peak"].values, peak, rtol=1e-9)
    with pytest.raises(ParameterError, match="multiplier of 1"):
        sl.branches(ELASTIC, {"frequency": (0.2, 0.8)}, (0.0, 0.0, 0.0), at=1)


def test_a_block_that_sticks_rests_in_one_family():
    found = sl.basins(block, x=(-1, 1, 6), v=(-1, 1, 6))
    assert (found["basin"].values == 0).all()
    assert found["attractor_type"].item() == "equilibrium"
    assert found.attrs["flip_rate"] == 0
    exponents = sl.lyapunov(block, (0.0, 0.5), periods=64)
    assert exponents["kind"].item() == "equilibrium"
    assert exponents["lyapunov_exponent"].values.tolist() == [[0.0, -np.inf]]
    slip = sl.bifurcation_diagram(block, {"slip": (0.2, 0.4, 2)}, start=(1.0, 0.0))
    assert slip["response_type"].values.tolist() == 2 * ["equilibrium"]


def test_a_body_that_a_stop_holds_all_the_time_has_no_multipliers_of_its_own():
    """What is left is the oscillator: its multipliers have the size exp(-damping T / 2)."""
    start = {"x": 0.0, "v": 0.0, "y": 0.1, "w": 0.0}
    branch = sl.branches(pressed, {"frequency": (0.5, 0.6)}, start, at=1)
    assert branch["point_stable"].values.all()
    assert (branch["branch_begin"].item(), branch["branch_end"].item()) == ("range", "range")
    decay = np.exp(-0.1 / branch["point_frequency"].values)
    np.testing.assert_allclose(
        size(branch, "point"), np.stack([decay, decay, 0 * decay, 0 * decay], axis=1), atol=1e-12
    )
    exponents = sl.lyapunov(pressed, start, periods=64)["lyapunov_exponent"].values[0]
    np.testing.assert_allclose(exponents[:2], -0.1, rtol=1e-9)
    assert np.isneginf(exponents[2:]).all()


def test_what_a_chaotic_transient_settles_to_at_last_is_found(monkeypatch):
    """On the rig's chaotic saddle at 13.5 Hz many motions stay longer than a short survey lasts;
    some of those that are watched on leave it, and settle to what the other starts lead to.
    """
    monkeypatch.setattr(unsettled, "SURVEY_ITERATES", 256)
    rig = sl.models.delangre("b", force="4 N", frequency="13.5 Hz")
    random = np.random.default_rng(3).uniform(-1, 1, (2, 150))
    found = sl.attractors(rig, {"x": 5e-3 * random[0], "v": random[1]}, periods=128)
    late = found["periods_to_settle"].values > 128 + 256
    assert late.any()
    assert (found["basin"].values[late] >= 0).all()
    assert set(found["attractor_period"].values.tolist()) == {1, 2}


def test_a_coordinate_that_rests_within_rounding_hides_no_response():
    """A coordinate that presses a rough floor rests but for rounding. The slowest decay is
    its own, damping / (2 mass) = 1 s^-1.
    """
    stiffness = np.diag([8e3, 8e3, 8e3, 8e3, 4e3, 1e3])
    for i in range(4):
        stiffness[i, i + 1] = stiffness[i + 1, i] = -4e3
    floor = {"gap": "-0.5 mm", "friction": 0.5, "sliding": "x5", "name": "floor"}
    chain = sl.structure(
        0.5 * np.eye(6),
        stiffness,
        1e-3 * stiffness,
        frequency="5 Hz",
        contacts=[
            sl.Contact("x6", stiffness="50 kN/m", **floor),
            sl.Contact("x1", stiffness="20 kN/m", gap="0.1 mm"),
        ],
        forces=[sl.Force("x1", "4 N")],
    )
    response = sl.frequency_response(chain, ["5 Hz"], np.zeros(12))
    assert response["response_of"].values.tolist() == [[0]]
    largest = np.hypot(response["response_multiplier_real"], response["response_multiplier_imag"])
    np.testing.assert_allclose(largest.values[0, :2], np.exp(-1 / 5), rtol=1e-9)
