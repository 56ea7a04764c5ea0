"""What is said of a trajectory that used up its steps: how long the whole would take, or that no
number of steps leads on.
"""

import numpy as np
import xarray as xr

import saltus as sl
from saltus.analysis.inputs.spans import span
from saltus.analysis.inputs.starts import ensemble
from saltus.analysis.outcome_messages import messages


@sl.system(states="h", units={"h": "m"})
def tank(t, h, *, c=1.0):
    """A tank that runs empty: h = (1 - c*t/2)**2 until t = 2/c; at h = 0 the rate has no
    derivative.
    """
    return -c * sl.sqrt(h)


def stopped(level, time):
    """A run of it that used up its steps there."""
    end = xr.Variable((), level, {"units": "m"})
    return xr.Dataset(
        {"status": "budget_steps", "steps": 10**6, "end_time": time, "end_h": end},
        attrs={"states": "h"},
    )


def told(level, time):
    asked = span(tank, ensemble(tank, (1.0,), None), None, 3.0, 0.0)
    (text,) = messages(stopped(level, time), asked, tank)
    return text


def test_where_a_law_has_no_derivative_no_more_steps_are_advised():
    text = told(1.8e-27, 2.0)
    assert "at 1.2e+13 1/s" in text  # c/(2 sqrt(h))
    assert "No number of steps" in text
    assert "max_steps" not in text
    assert "at inf 1/s" in told(0.0, 2.0)


def test_elsewhere_it_is_said_how_long_the_whole_would_take():
    text = told(0.25, 1.0)
    assert "at this pace the whole takes 3.0e+06 steps" in text
    assert "Raise max_steps" in text
    assert "root" not in text


def test_a_law_that_ends_before_is_no_longer_singular():
    @sl.system(states="h", units={"h": "m"})
    def drained(t, h, *, c=1.0):
        return sl.piecewise((-c * sl.sqrt(h), h > 1e-9), otherwise=0.0)

    asked = span(drained, ensemble(drained, (1.0,), None), None, 3.0, 0.0)
    (text,) = messages(stopped(1e-10, 2.0), asked, drained)
    assert "Raise max_steps" in text
    assert np.all(drained.rhs(0.0, [1e-10]) == 0.0)


# -- roots that are zero ---------------------------------------------------------------------------
def at_rest(force):
    """What is said of a motion that ended where x = y = 0."""

    def rates(t, x, y, *, d=0.5):
        return force(x, y, d), 0.0

    system = sl.system(states="x y")(rates)
    end = {f"end_{name}": xr.Variable((), 0.0, {"units": ""}) for name in "xy"}
    run = xr.Dataset({"status": "nonfinite", "end_time": 0.0, **end}, attrs={"states": "x y"})
    (text,) = messages(run, None, system)
    return text


def test_a_root_of_zero_is_named_with_what_to_write():
    divided = at_rest(lambda x, y, d: d * x / sl.hypot(x, y))
    assert "hypot(x, y) is 0 there" in divided
    assert "sl.clearance(x, y, ...)" in divided
    varying = at_rest(lambda x, y, d: sl.piecewise((1, sl.hypot(x, y) > d + x), otherwise=0))
    assert "write x*x + y*y > d**2 in place of hypot(x, y) > d." in varying
    quotient = at_rest(lambda x, y, d: sl.piecewise((1, x / sl.hypot(x, y) > y - d), otherwise=0))
    assert "a comparison divides by it" in quotient
    assert "sqrt(x*x + y*y + d*x) is 0" in at_rest(
        lambda x, y, d: 1 / sl.sqrt(x * x + y * y + d * x)
    )


def test_where_no_root_is_zero_the_range_of_numbers_is_told():
    assert "left the range of numbers" in at_rest(lambda x, y, d: d / (x * x + y * y))
