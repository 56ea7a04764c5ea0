"""Systems without attractors, beside volumes of states that motions carry along."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.system.volume import nothing_attracts


@sl.system(states="x y v w")
def pair(t, x, y, v, w, *, a=0.0, b=0.0, c=0.0, gyro=0.0, stop=0.0, pad=0.0, rub=0.0, curved=0.0):
    """Two masses: dampers, a whirl, a stop, one with a damper, friction, damping by x squared."""
    hit = sl.piecewise((stop * (x - 0.1) + pad * v, x > 0.1), otherwise=0.0)
    return (
        v, w,
        -x - a * v - c * (v - w) + gyro * w - hit - rub * sl.sign(v) - curved * x**2 * v,
        -2 * y - b * w - c * (w - v) - gyro * v - y**3 + sl.cos(t),
    )  # fmt: skip


def growth(system, random, span=9.0, step=1e-6):
    """Logarithm of the volume that grows from 1 about a random start, by differences of motions."""
    start, apart = random.normal(size=4), step * np.eye(4)
    both = np.concatenate([start + apart, start - apart])
    run = sl.simulate(system, both, t_end=span, samples=2, progress=False)
    ends = np.stack([run[name].values[:, -1] for name in system.states], axis=1)
    return float(np.linalg.slogdet((ends[:4] - ends[4:]) / (2 * step))[1])


@pytest.mark.parametrize(
    ("values", "sign"),
    [
        ({}, 0),
        ({"gyro": 0.7, "stop": 4.0}, 0),
        ({"a": 0.3, "b": -0.3, "stop": 2.0}, 0),
        ({"a": -0.05}, 1),
        ({"a": -0.2, "c": 0.05, "stop": 3.0}, 1),
        ({"c": 0.02}, -1),
        ({"a": -0.1, "b": 0.2}, -1),
        ({"pad": 0.3, "stop": 3.0}, -1),
        ({"rub": 0.3}, -1),
        ({"curved": 0.2}, -1),
    ],
)
def test_volumes_of_states_grow_as_said(values, sign):
    system = pair.with_values(**values)
    said = nothing_attracts(system)
    assert ("Nothing damps" in said, "negative damping" in said) == (sign == 0, sign > 0)
    measured = growth(system, np.random.default_rng(20261126))
    assert abs(measured) < 1e-3 if sign == 0 else measured * sign > 1e-2


def test_a_loss_in_one_direction_is_not_outweighed_in_the_contact_alone():
    assert nothing_attracts(pair.with_values(a=-0.1, pad=0.3, stop=3.0)) == ""
    assert nothing_attracts(pair.with_values(a=-0.4, pad=0.3, stop=3.0)) != ""


@pytest.mark.parametrize(("restitution", "attracts"), [(1.0, False), (0.9, True)])
def test_an_impact_that_loses_nothing_keeps_volumes(restitution, attracts):
    box = sl.models.ball_in_box().with_values(restitution=restitution)
    assert (nothing_attracts(box) == "") == attracts


def test_results_name_no_attractors_where_there_are_none():
    rig = sl.models.delangre("b", force="4 N", damping_ratio=0.0)
    found = sl.attractors(rig, (0.0, 0.0), periods=50, progress=False)
    said = sl.describe(found)
    assert "Nothing damps" in said
    assert "1 motion\n" in said
    assert "settled" not in said
