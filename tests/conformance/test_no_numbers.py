"""Formulas that give no number end a motion with status nonfinite, by modes too."""

import pytest

import saltus as sl


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def gap(t, x, v, *, w=1.0, p=-1.0):
    spring = sl.piecewise((4.0 * (x - sl.sqrt(p)), x > sl.sqrt(p)), otherwise=0)
    return v, sl.cos(w * t) - x - spring


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stiffness(t, x, v, *, w=1.0, p=-1.0):
    return v, sl.cos(w * t) - sl.sqrt(p) * x - sl.piecewise((4 * (x - 0.2), x > 0.2), otherwise=0)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def force(t, x, v, *, w=1.0, p=-1.0):
    return v, sl.log(p) * sl.cos(w * t) - x - sl.piecewise((x - 0.2, x > 0.2), otherwise=0)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def stop(t, x, v, *, w=1.0, p=-1.0):
    return v, sl.cos(w * t) / sl.sqrt(p) - x, sl.impact(x < 0.2, v, restitution=0.5)


@pytest.mark.filterwarnings("ignore:.*nonfinite")
@pytest.mark.parametrize("system", [gap, stiffness, force, stop], ids=lambda one: one.name)
def test_a_formula_without_a_number_ends_its_motion_alone(system):
    """The other trajectories are as they are without it."""
    ask = {"periods": 2, "progress": False, "time_errors": "local", "method": sl.Modal()}
    alone = sl.simulate(system, (0.1, 0.0), **ask)
    assert str(alone.status.values) == "nonfinite"
    both = sl.simulate(system, (0.1, 0.0), values={"p": [2.0, -1.0, 3.0]}, **ask)
    assert both.status.values.tolist() == ["ok", "nonfinite", "ok"]
    one = sl.simulate(system, (0.1, 0.0), values={"p": 3.0}, **ask)
    assert both.end_x.values[2] == one.end_x.item()
