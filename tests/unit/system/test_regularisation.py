"""What `sl.regularise` takes, refuses and returns."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.contact import STEPS
from saltus.errors import ParameterError, TraceError, UnitError

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


@sl.system(states="x v", units={"x": "m", "v": "m/s"})
def both(t, x, v, *, gap="1 mm", rate="2 m/s", mass="1 kg", force="3 N"):
    joined = sl.where((x > gap) & ~(v > rate) | (t < 1), force, 0)
    return v, joined / mass


def test_weights_of_joined_conditions():
    smooth = sl.regularise(both, width={"gap": "0.1 mm", "rate": "0.2 m/s"})
    x, v = np.meshgrid(np.linspace(5e-4, 2e-3, 7), np.linspace(1.5, 2.5, 5))
    a, b = (1 + np.tanh((x - 1e-3) / 1e-4)) / 2, (1 + np.tanh((v - 2) / 0.2)) / 2
    states = np.stack([x.ravel(), v.ravel()])
    late = smooth.rhs(np.full(35, 2.0), states)[1]
    assert np.allclose(late, 3 * (a * (1 - b)).ravel(), rtol=0, atol=1e-12)
    assert np.allclose(smooth.rhs(np.full(35, 0.5), states)[1], 3, rtol=0, atol=1e-12)


def test_boundaries_without_a_width_stay():
    smooth = sl.regularise(both, width={"rate": 0.2})
    assert [guard.name for guard in smooth.guards] == ["gap"]
    assert smooth.units["width_rate"] == "m/s"
    inside = smooth.rhs(2.0, [2e-3, 2.0])[1]
    assert inside == pytest.approx(1.5)
    assert smooth.rhs(2.0, [0.0, 2.0])[1] == 0


def test_abs_min_and_max():
    @sl.system(states="x v")
    def three(t, x, v, *, gap=1.0):
        return sl.abs(x), sl.max(x, v) - sl.min(v, gap)

    smooth = sl.regularise(three, width=0.1)
    x, v = 0.05, 0.02
    step = lambda u: (1 + np.tanh(u / 0.1)) / 2  # noqa: E731
    largest = v + step(x - v) * (x - v)
    smallest = 1.0 + step(1.0 - v) * (v - 1.0)
    expected = [x * np.tanh(x / 0.1), largest - smallest]
    assert np.allclose(smooth.rhs(0.0, [x, v]), expected, rtol=1e-14)


def test_a_boundary_inside_a_boundary():
    @sl.system(states="x v")
    def nested(t, x, v, *, gap=1.0):
        return v, -sl.where(sl.abs(x) > gap, x, 0)

    smooth = sl.regularise(nested, width=0.1)
    size = 1.02 * np.tanh(10.2)
    assert smooth.guards == ()
    assert smooth.rhs(0.0, [1.02, 0.0])[1] == pytest.approx(
        -1.02 * (1 + np.tanh((size - 1) / 0.1)) / 2, rel=1e-14
    )


@pytest.mark.parametrize("law", STEPS)
def test_data_and_names(law):
    smooth = sl.regularise(RIG, law, width="1 um")
    again = type(smooth).from_dict(smooth.to_dict())
    assert again.fingerprint() == smooth.fingerprint() != RIG.fingerprint()
    assert smooth.with_values(width="2 um").fingerprint() == smooth.fingerprint()
    assert smooth.units["width"] == "m"
    assert smooth.values["width"] == 1e-6
    assert law in smooth.name
    assert "Regularised" in again.description
    assert f"delangre regularised by {law}" in repr(smooth)
    if law == "polynomial":
        names = [guard.name for guard in smooth.guards]
        assert names[:2] == ["x = upper_gap - width", "x = upper_gap + width"]
    else:
        assert smooth.guards == ()


def test_a_law_of_ones_own():
    logistic = sl.regularise(RIG, lambda u: 1 / (1 + sl.exp(-u)), width=1e-4)
    own = sl.regularise(RIG, "sigmoid", width=1e-4)
    states = np.array([[4.3e-4, -2e-5], [0.1, 0.2]])
    assert np.allclose(logistic.rhs(0.0, states), own.rhs(0.0, states), rtol=1e-12)
    for wrong in (lambda u: u, lambda u: "1", lambda u: -u):
        with pytest.raises(ParameterError, match="a step from 0 to 1"):
            sl.regularise(RIG, wrong, width=1e-4)


@sl.system(states="x v", forced_at="frequency")
def damped(t, x, v, *, gap=0.5, frequency=0.2):
    return v, sl.cos(2 * sl.pi * frequency * t) - x - v - sl.where(x > gap, 4 * (x - gap), 0)


def test_every_analysis_runs(few_scouts):
    smooth, quiet = sl.regularise(damped, width=0.1), {"progress": False}
    assert sl.simulate(smooth, (0.0, 0.0), periods=2).sizes["contact"] == 0
    map_ = sl.basins(smooth, x=(-1, 1, 2), v=(-1, 1, 2), **quiet)
    (peak,) = map_.attractor_peak.values
    one = sl.attractors(smooth, (0.0, 0.0), **quiet)
    curve = sl.frequency_response(smooth, frequency=[0.2, 0.3], **quiet)
    widths = sl.bifurcation_diagram(smooth, {"width": [0.05, 0.1]}, **quiet)
    peaks = [one.attractor_peak[0], curve.peak[0, 0], widths.peak[1, 0]]
    assert np.allclose(peaks, peak, rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"width": 0.0}, ParameterError, "must be positive"),
        ({"width": "1 N"}, UnitError, "width"),
        ({"width": {}}, ParameterError, "no boundary"),
        ({"width": {"uper_gap": 1e-6}}, ParameterError, "upper_gap"),
        ({"width": 1e-6, "law": "tan"}, ParameterError, "tanh"),
        ({"width": 1e-6, "law": 3}, ParameterError, "function of gap/width"),
    ],
)
def test_refusals(arguments, error, words):
    with pytest.raises(error, match=words):
        sl.regularise(RIG, **arguments)


def test_refused_systems():
    with pytest.raises(ParameterError, match="m and m/s"):
        sl.regularise(both, width=1e-3)
    with pytest.raises(ParameterError, match="no boundary"):
        sl.regularise(sl.regularise(RIG, width=1e-6), width=1e-6)
    with pytest.raises(ParameterError, match="takes a System"):
        sl.regularise(lambda t, x: x, width=1e-6)

    @sl.system(states="x v")
    def hertz(t, x, v, *, wall=1.0):
        return v, -sl.where(x > wall, (x - wall) ** 1.5, 0)

    with pytest.raises(TraceError, match="no values on the other side"):
        sl.regularise(hertz, width=1e-3)


@sl.system(states="x v", forced_at="frequency")
def belt(t, x, v, *, speed=0.3, slip=0.5, stick=0.8, gap=1.0, frequency=0.1):
    push = sl.cos(2 * sl.pi * frequency * t) - sl.where(x > gap, 5 * (x - gap), 0)
    return v, push - x - sl.friction(v - speed, slip=slip, stick=stick)


def test_friction_slips_only():
    smooth = sl.regularise(belt, width={"speed": 0.1, "gap": 0.01})
    assert smooth.guards == ()
    assert smooth.rhs(0.0, [0.2, 0.35])[1] == pytest.approx(0.8 - 0.5 * np.tanh(0.5), rel=1e-12)
    assert "static limit is left out" in smooth.description
    with pytest.raises(ParameterError, match="has a static limit"):
        sl.regularise(belt, width={"gap": 0.1})


def test_creep_where_friction_sticks():
    """At rest on the belt the force that it needs is slip*tanh(creep/width)."""

    @sl.system(states="x v")
    def dragged(t, x, v, *, speed=0.2, slip=0.5):
        return v, -0.1 * v - sl.friction(v - speed, slip=slip)

    assert "static" not in sl.regularise(dragged, width=1e-3).description
    smooth = sl.regularise(dragged, width=1e-3)
    run = sl.simulate(smooth, (0.0, 0.0), t_end=20.0)
    creep = run.end_v.item() - 0.2
    assert 0.5 * np.tanh(creep / 1e-3) == pytest.approx(-0.1 * run.end_v.item(), rel=1e-9)


def test_where_a_state_jumps_nothing_is_smooth():
    @sl.system(states="x v")
    def stop(t, x, v, *, gap=1.0):
        return v, -x, sl.impact(x < gap, v, restitution=0.8)

    with pytest.raises(ParameterError, match="the state jumps"):
        sl.regularise(stop, width=0.1)
