"""Gaps may be negative where that means something. Truth: forces written out by hand."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope


@sl.system(states="x v")
def two_sided(t, x, v, *, stiffness=2.0, clearance=0.5):
    return v, -sl.freeplay(x, stiffness=stiffness, gap=clearance)


@sl.system(states="x y")
def between(t, x, y, *, stiffness=2.0, lower=0.5, upper=0.25):
    force = sl.freeplay(2 * (x - y), stiffness=stiffness, lower_gap=lower, upper_gap=upper)
    return -force, force


@sl.system(states="x v")
def one_sided(t, x, v, *, stiffness=2.0, gap="1 mm"):
    return v, -sl.piecewise((stiffness * (x - gap), x > gap), otherwise=0)


@sl.system(states="x v")
def interference(t, x, v, *, stiffness=2.0, gap=-0.5):
    return v, -sl.freeplay(x, stiffness=stiffness, lower_gap=gap) - sl.freeplay(
        x, stiffness=stiffness, upper_gap=gap
    )


def test_a_clearance_is_not_negative_whatever_its_name():
    says = (
        r"two_sided: with clearance = -0.5 the contacts at x = -clearance and x = clearance "
        r"overlap.* can't be negative.*sum of two"
    )
    with pytest.raises(ParameterError, match=says):
        two_sided.with_values(clearance=-0.5)
    assert two_sided.with_values(clearance=0.0).values["clearance"] == 0.0


def test_of_two_stops_the_distance_counts():
    # both stops on one side: a clearance from 0.1 to 0.3
    moved = between.with_values(lower=-0.1, upper=0.3)
    # pressed against the lower one at the start
    np.testing.assert_allclose(moved.rhs(0.0, (0.0, 0.0)), [0.2, -0.2])
    np.testing.assert_allclose(moved.rhs(0.0, (0.1, 0.0)), 0.0, atol=0)
    with pytest.raises(ParameterError, match=r"with lower = -0.4, upper = 0.3 the contacts"):
        between.with_values(lower=-0.4, upper=0.3)


def test_one_stop_may_be_preloaded():
    for gap in ("-1 mm", -1e-3):
        preloaded = one_sided.with_values(gap=gap)
        np.testing.assert_allclose(preloaded.rhs(0.0, (0.0, 0.0)), [0.0, -2e-3])
        np.testing.assert_allclose(preloaded.rhs(0.0, (-2e-3, 0.0)), 0.0, atol=0)


def test_springs_that_touch_on_both_sides_are_a_sum():
    for x in (-0.7, -0.3, 0.0, 0.4, 0.9):
        force = 2.0 * ((x + 0.5) * (x > -0.5) + (x - 0.5) * (x < 0.5))
        np.testing.assert_allclose(interference.rhs(0.0, (x, 0.0)), [0.0, -force], atol=1e-15)


def test_pieces_that_overlap_for_all_values_are_the_users_choice():
    system = sl.system(states="x", name="chain")(
        lambda t, x, *, k=1.0: -sl.piecewise((k, x < 1), (2 * k, x > 0), otherwise=0)
    )
    assert system.values["k"] == 1.0


def test_each_trajectory_is_asked():
    with pytest.raises(ParameterError, match=r"clearance = -0.2 \(trajectory 1 of 3\)"):
        sl.simulate(two_sided, (0.0, 1.0), t_end=1.0, values={"clearance": [0.1, -0.2, 0.0]})
    with pytest.raises(ParameterError, match=r"lower = 0.5, upper = -0.7 \(trajectory 1 of 2\)"):
        Stroboscope(between, sl.Taylor(), np.array([[2.0, 0.8, -0.7], [2.0, 0.5, -0.7]]), every=1.0)
