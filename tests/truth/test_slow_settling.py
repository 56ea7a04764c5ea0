"""Motions that settle slowly to an orbit look quasi-periodic for long: their kinds against closed
forms of linear motions and of maps.
"""

import math
import warnings

import numpy as np
import pytest

import saltus as sl
from function_maps import FunctionMap
from saltus.analysis.attractors.settling import may_settle

#: Two masses between springs, whose stop is never met.
STIFFNESS = 1e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
NATURAL = 100.0 * np.sqrt([1.0, 3.0])  # [rad/s]


def pair(damping_ratio, frequency=13.0):
    return sl.structure(
        np.eye(2), STIFFNESS, frequency=frequency, damping_ratio=damping_ratio, modes=2,
        contacts=[sl.Contact("x2", stiffness="1 MN/m", gap="1 m")],
        forces=[sl.Force("x1", 5.0)], sensors={"tip": "x2"},
    )  # fmt: skip


def slowest(damping_ratio, frequency=13.0):
    """Largest exponent [per period]: that of the first mode."""
    return -damping_ratio * NATURAL[0] / frequency


def rotating(radius):
    """A map that turns the plane by an angle without a period, after ``radius`` of each radius."""
    angle = math.pi * (math.sqrt(5) - 1)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def image(z):
        size = np.sqrt((z**2).sum(axis=1, keepdims=True))
        return (z @ turn.T) * radius(size) / size

    def derivative(z, step=1e-6):
        sides = [(image(z + step * one) - image(z - step * one)) / (2 * step) for one in np.eye(2)]
        return np.stack(sides, axis=2)

    return FunctionMap(image, "x y", derivative)


def motion(map_, count):
    states = [np.array([[0.3, 0.4]])]
    for _ in range(count - 1):
        states.append(map_.launch(states[-1], 1).advance(1)[:, -1])
    return np.stack(states, axis=1)


@pytest.mark.parametrize(
    ("radius", "settles"),
    [
        (lambda r: 0.999 * r, True),  # a third of its distance is left
        (lambda r: 0.99999 * r, True),  # nearly all of it is, and nobody can tell
        (lambda r: r + 0.1 * r * (1 - r**2), False),  # a circle that attracts, its centre doesn't
        (lambda r: r + 0.1 * r * (r - 0.2) * (1 - r**2), False),  # both do
    ],
)
def test_a_motion_settles_where_its_way_to_an_orbit_shrinks_or_may_shrink(radius, settles):
    map_ = rotating(radius)
    assert may_settle(map_, motion(map_, 1024), np.ones((1, 2))).tolist() == [settles]


@pytest.mark.parametrize("damping_ratio", [0.002, 0.005, 0.01])
def test_what_settles_isn_t_called_quasi_periodic_after_few_periods(damping_ratio):
    early = sl.lyapunov(pair(damping_ratio), periods=64, transient=10, progress=False)
    assert str(early["kind"].values[0]) == "unclear"
    assert "may not have settled in 74 blocks" in str(sl.describe(early))
    late = sl.lyapunov(pair(damping_ratio), periods=64, transient=4000, unit="1/period",
                       progress=False)  # fmt: skip
    assert str(late["kind"].values[0]) == "periodic"
    assert late["lyapunov_exponent"].values[0, 0] == pytest.approx(slowest(damping_ratio), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damping_ratio", "kind"),
    [(0.0, "quasi_periodic"), (3e-5, "unconverged"), (1e-4, "periodic")],
)
def test_responses_that_settle_slowly_aren_t_quasi_periodic(damping_ratio, kind):
    """In 4000 periods the free motion comes to 1, 0.4 and 0.05 of itself."""
    found = sl.frequency_response(pair(damping_ratio), ["13 Hz"], progress=False)
    assert found["type"].values.ravel().tolist() == [kind]


def test_chaos_is_told_for_as_long_as_it_was_watched():
    """A chain whose chaos may end after some 10 000 periods, in an orbit of one period."""
    stiffness = 1e4 * (2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1))
    chain = sl.structure(
        np.eye(6), stiffness, frequency="13 Hz", damping_ratio=3e-4, modes=6,
        contacts=[sl.Contact("x6", stiffness="1 MN/m", gap="2 mm")], forces=[sl.Force("x1", 5.0)],
    )  # fmt: skip
    found = sl.frequency_response(chain, ["13 Hz"], periods=100, progress=False)
    kinds = set(found["response_type"].values.tolist())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = str(sl.describe(found))
    assert ("chaotic" in kinds) == ("watched, at least 100 periods" in told)
    assert kinds <= {"chaotic", "not_repeating"}
