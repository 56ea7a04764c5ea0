"""Contacts whose force is steep where they begin, as ``depth**0.25``: no tangent passes, the flow
is smooth all the same. Its derivatives are held against Liouville's formula and exact tangents.
"""

import itertools

import numpy as np
import pytest

import saltus as sl
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule

HERTZ = sl.models.hertz_stop()
BRANCH = {"frequency": (12.6, 15.4)}


def test_where_the_derivative_of_a_force_is_infinite_is_known():
    """Of powers below one of the depth only: not of depth**1.5, nor of a root elsewhere."""

    def of(power):
        @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
        def stop(t, x, v, *, gap=0.5, w=1.0):
            depth = x - gap
            return v, sl.cos(w * t) - x - sl.piecewise((depth**power, depth > 0), otherwise=0)

        return stop

    assert [of(power).is_steep for power in (0.25, 0.5, 1.5, 2.5)] == [True, True, False, False]
    assert HERTZ.is_steep
    assert HERTZ.with_values(gap=0.004).is_steep
    assert not sl.models.delangre("b", force="4 N").is_steep

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def rooted(t, x, v, *, gap=0.5, w=1.0):
        force = sl.piecewise((x - gap, x > gap), otherwise=0)
        return v, sl.cos(w * t) - x - force * sl.sqrt(1.0 + x**2)

    assert not rooted.is_steep


def contraction(system, start, periods, divergence):
    """exp of the integral of the divergence: by Gauss' rule between the contacts, in a variable
    that is flat at both ends, in which their powers of the depth are smooth.
    """
    flow = Stroboscope(system, sl.Taylor())
    run = sl.simulate(system, tuple(start[0]), periods=periods, samples=4, time_errors="local")
    edges = np.concatenate([[0.0], run.contact_time.values, [run.time.values[-1]]])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u, total = 0.5 * (nodes + 1.0), 0.0
    share = u**4 * (35.0 - 84.0 * u + 70.0 * u**2 - 20.0 * u**3)
    slope = 140.0 * u**3 * (1.0 - u) ** 3
    for a, b in itertools.pairwise(edges):
        if b - a > 1e-12:
            count, fraction = np.divmod((a + (b - a) * share) / flow.period, 1.0)
            seen = flow.run(start, periods, Schedule(count.astype(np.int64), fraction))
            total += (b - a) * 0.5 * float(weights * slope @ divergence(*seen.samples[0].T))
    return np.exp(total)


def test_the_flow_contracts_areas_as_liouville_says():
    values, start = HERTZ.values, np.array([[0.0, 0.02]])
    loss = values["loss"] * np.sqrt(values["mass"] * values["stop_stiffness"])

    def divergence(x, v):
        damper = loss * np.maximum(x - values["gap"], 0.0) ** 0.25 * (v > 0)
        return -(values["damping"] + damper) / values["mass"]

    _, derivative = Stroboscope(HERTZ, sl.Taylor()).tangent(start, 5)
    # the determinant is a difference of products some 1e4 times larger
    assert np.linalg.det(derivative[0]) == pytest.approx(
        contraction(HERTZ, start, 5, divergence), rel=1e-6
    )


@pytest.mark.parametrize("seed", range(6))
def test_random_steep_dampers(seed):
    """Stops from soft to hard, dampers of any power below one: Liouville's formula again."""
    random = np.random.default_rng(seed)
    power, gap = random.choice([0.2, 0.25, 0.4, 0.5, 0.75]), random.uniform(-0.3, 0.5)
    hardness, loss = 10 ** random.uniform(0, 6), 10 ** random.uniform(-1, 2)

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def stop(t, x, v, *, k=float(hardness), c=float(loss), gap=float(gap), w=1.3):
        depth = x - gap
        force = sl.piecewise(
            (k * depth**1.5 + c * depth ** float(power) * v, depth > 0), otherwise=0
        )
        return v, sl.cos(w * t) - 0.2 * v - x - force

    def divergence(x, v):
        return -(0.2 + loss * np.maximum(x - gap, 0.0) ** power + 0.0 * v)

    start = np.array([[gap - random.uniform(0.1, 1.0), random.uniform(-1.0, 0.2)]])
    assert stop.is_steep
    _, derivative = Stroboscope(stop, sl.Taylor()).tangent(start, 2)
    noise = 1e-9 * (1.0 + np.abs(derivative).max())
    assert np.linalg.det(derivative[0]) == pytest.approx(
        contraction(stop, start, 2, divergence),
        rel=1e-9,
        abs=noise * np.abs(derivative).max() + noise**2,
    )


def test_differences_are_the_tangents_where_there_are_some():
    rig = Stroboscope(sl.models.delangre("b", force="4 N", frequency="15 Hz"), sl.Taylor())
    start = np.array([[0.001, 0.02], [-0.002, 0.1]])
    directions = np.array([[[1.0, 0.3], [0.0, 40.0]], [[1.0, 0.0], [0.0, 1.0]]])
    end, exact = rig.tangent(start, 2, directions)
    same, differences = rig._by_differences(start, 2, directions)
    np.testing.assert_allclose(end, same, rtol=1e-12)
    size = np.abs(exact).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(differences / size, exact / size, atol=1e-9)


def test_responses_and_branches_of_a_damped_hertz_stop_are_found():
    """They were `failed` after 30 s, and "no periodic orbit is known"."""
    settled = sl.stroboscope(HERTZ, (0.0, 0.0), 60, keep=1)
    found = sl.frequency_response(HERTZ, [13.0, 14.0], (0.0, 0.0), progress=False)
    assert found.response_type.values.tolist() == ["periodic", "periodic"]
    assert found.response_period.values.tolist() == [1, 1]
    orbits = sl.periodic_orbits(HERTZ, (0.001, 0.0), periods=1, progress=False)
    at = [orbits[name].values.ravel()[0] for name in ("orbit_x", "orbit_v")]
    np.testing.assert_allclose(
        at, [settled.x.values[-1, 0], settled.v.values[-1, 0]], rtol=1e-11, atol=1e-14
    )
    branches = sl.branches(HERTZ, BRANCH, (0.0, 0.0), at=2, progress=False)
    assert branches.sizes["branch"] == 1
    assert bool(branches.point_stable.all())
