"""Rigid stops in the modal flow where modes go together, and beside records: closed forms, Taylor's
method.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from saltus.system.quantity import quantity, with_impulses, with_losses
from two_flows import FOLLOWS, runs, same_rows, times

TIMES = np.linspace(0.0, 4.0, 21)
HEIGHTS = np.random.default_rng(3).normal(size=21)
DRIVES = {
    "linear record": sl.recorded(TIMES, HEIGHTS, kind="linear"),
    "spline": sl.recorded(TIMES, HEIGHTS),
    "square wave": lambda t: sl.square(11.0 * t),
}


def structure(rng, degrees, kind):
    """A random structure of unit masses with two rigid stops, whose modes go together, or that is
    driven by a record.
    """
    root = rng.normal(size=(degrees, degrees))
    stiffness = 200.0 * (root @ root.T / degrees + np.eye(degrees))
    damping, w = rng.uniform(0.0, 2.0) * np.eye(degrees), float(rng.uniform(5, 20))
    force, dead = rng.uniform(5, 30, degrees), rng.normal(0, 3, degrees)
    values, vectors = np.linalg.eigh(stiffness)
    if kind == "free":
        chain = np.diff(np.eye(degrees), axis=0)
        stiffness, dead = 100.0 * chain.T @ chain, np.abs(dead)
    elif kind == "critical damping":
        damping = vectors @ np.diag(2.0 * np.sqrt(values)) @ vectors.T
    elif kind == "resonance":
        damping, w = 0.0 * damping, float(np.sqrt(values[0]))
    drive = DRIVES.get(kind, lambda t: sl.cos(w * t))
    stops = [
        (int(rng.integers(degrees)), float(rng.uniform(0.003, 0.05)), float(rng.uniform(0, 0.9)))
        for _ in range(2)
    ]

    def equation(t, *z):
        x, v = z[:degrees], z[degrees:]
        rates = [
            sum(
                -float(stiffness[i, k]) * x[k] - float(damping[i, k]) * v[k] for k in range(degrees)
            )
            + float(force[i]) * drive(t)
            + float(dead[i])
            for i in range(degrees)
        ]
        laws = [sl.impact(x[i] < gap, v[i], restitution=e) for i, gap, e in stops]
        return (*v, *rates, *laws)

    names = [f"{letter}{i + 1}" for letter in "xv" for i in range(degrees)]
    space, given = {"equation": equation}, ", ".join(names)
    exec(f"def f(t, {given}):\n return equation(t, {given})", space)
    return sl.system(states=" ".join(names))(space["f"])


KINDS = ["free", "critical damping", "resonance", *DRIVES]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.slow
def test_stops_beside_blocks_and_records_act_as_by_taylor(kind, seed):
    """Every row: impacts, rests, releases. Errors grow from contact to contact; by the tolerance it
    is asked that they grow no faster than by a third at each.
    """
    rng = np.random.default_rng([20261125, KINDS.index(kind), seed])
    degrees = int(rng.integers(1, 5))
    system = structure(rng, degrees, kind)
    modal, taylor = runs(system, np.zeros(2 * degrees), t_end=4.0)
    assert str(modal.status.values) == str(taylor.status.values) == "ok"
    same = same_rows(modal, taylor, 1.0)
    if same < 40:
        assert same == modal.sizes["contact"] == taylor.sizes["contact"]
        for name in system.states:
            assert float(modal[f"end_{name}"]) == pytest.approx(
                float(taylor[f"end_{name}"]), abs=1e-8
            )


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.5, 0.9])
@pytest.mark.parametrize("floor", [0.0, 2.0])
def test_a_ball_without_a_spring_comes_to_rest_at_the_exact_time(restitution, floor):
    """Flights between impacts last 2 e^n v/g, n = 1, 2, ...: a geometric series."""

    @sl.system(states="x v")
    def ball(t, x, v, *, gravity=9.81, restitution=restitution, floor=floor):
        return v, -gravity, sl.impact(x > floor, -v, restitution=restitution)

    assert isinstance(sl.Modal().serving(ball), sl.Modal)
    fall = math.sqrt(2 * 10 / 9.81)
    end = fall * (1 + restitution) / (1 - restitution)
    run = sl.simulate(ball, (10.0 + floor, 0.0), t_end=1.2 * end, method=sl.Modal(), **FOLLOWS)
    assert times(run, "impact")[0] == pytest.approx(fall, rel=1e-14)
    assert run.contact_velocity.values[0] == pytest.approx(-9.81 * fall, rel=1e-14)
    assert times(run, "hold") == pytest.approx([end], rel=1e-13)
    assert (float(run.end_x), float(run.end_v), str(run.status.values)) == (floor, 0.0, "ok")


def test_modes_that_go_together_while_a_contact_rests():
    """The first body is pressed onto its stop. The second, on a critical damper, creeps towards it;
    the third has no spring and falls.
    """

    @sl.system(states="x y z u v w")
    def three(t, x, y, z, u, v, w, *, gravity=9.81):
        pull = 0.2 * (x - y) - 2.0 * math.sqrt(0.2) * v
        return u, v, w, 5.0 - 0.2 * (x - y), pull, -gravity, sl.impact(x < 0.25, u, restitution=0)

    run = sl.simulate(
        three, (0.25, 1.0, 2.0, 0.0, -0.3, 4.0), t_end=5.0, samples=50, method=sl.Modal(), **FOLLOWS
    )
    t, rate = run["time"].values, math.sqrt(0.2)
    creeps = 0.25 + (0.75 + (0.75 * rate - 0.3) * t) * np.exp(-rate * t)
    assert run.sizes["contact"] == 0
    assert set(run["x"].values) == {0.25}
    np.testing.assert_allclose(run["y"].values, creeps, rtol=0, atol=1e-14)
    np.testing.assert_allclose(run["z"].values, 2.0 + 4.0 * t - 0.5 * 9.81 * t**2, atol=1e-12)


def test_a_record_that_pulls_releases_a_contact_at_rest_at_its_break():
    """A square wave presses a body onto its stop and pulls it off again, at whole seconds."""

    @sl.system(states="x v")
    def pressed(t, x, v):
        return v, 3.0 * sl.square(sl.pi * t) - 0.5 * x, sl.impact(x < 0, v, restitution=0.0)

    run = sl.simulate(pressed, (0.0, 0.0), t_end=1.5, method=sl.Modal(), **FOLLOWS)
    assert times(run, "release").tolist() == pytest.approx([1.0], abs=1e-15)
    w = math.sqrt(0.5)
    assert float(run.end_x) == pytest.approx(-6.0 * (1.0 - math.cos(w * 0.5)), abs=1e-14)


@sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
def pair(t, x, y, v, u, *, w=3.0, gap=0.1):
    law = sl.impact(x < y + gap, v - u, restitution=0.7, inertia={"v": 1.0, "u": 2.0})
    return v, u, 3.0 * sl.cos(w * t) - 4.0 * x, -3.0 * y, law


@pytest.mark.nojit
def test_contacts_at_rest_are_released_together_at_a_break():
    """What presses them jumps to the other side, and grows again from there."""

    @sl.system(states="x y v u")
    def two(t, x, y, v, u):
        pull = 3.0 * sl.square(sl.pi * t) + 0.1 * sl.sin(sl.pi * t)
        return (
            v, u, pull - x, 2.0 * pull - y,
            sl.impact(x < 0, v, restitution=0.0), sl.impact(y < 0, u, restitution=0.0),
        )  # fmt: skip

    run = sl.simulate(two, np.zeros(4), t_end=1.4, method=sl.Modal(), **FOLLOWS)
    assert times(run, "release").tolist() == pytest.approx([1.0, 1.0], abs=1e-15)


@pytest.mark.nojit
def test_states_before_impacts_are_told():
    modal, taylor = runs(pair, np.zeros(4), periods=8)
    assert modal.sizes["contact"] > 4
    for name in ("v", "u"):
        before, after = (modal[f"contact_{name}{kind}"].values for kind in ("_before", ""))
        assert np.abs(before - after).min() > 0
        assert before == pytest.approx(taylor[f"contact_{name}_before"].values, abs=1e-9)


def test_what_impacts_change_besides_is_carried_or_left_to_taylor():
    """Impulses are linear in the closing velocity, losses of energy aren't."""
    summed = with_impulses(pair, {0: "pushed"})
    ends = []
    for method in (sl.Modal(), sl.Taylor()):
        assert isinstance(method.serving(summed), type(method))
        run = sl.simulate(summed, np.zeros(5), periods=5, method=method, **FOLLOWS)
        ends.append([float(run[f"end_{name}"]) for name in summed.states])
    assert abs(ends[0][-1]) > 0.1
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)
    stored, _ = quantity(pair, lambda v, u: 0.5 * v * v + u * u, "the energy")
    lossy = with_losses(pair, stored, "lost", "")
    assert isinstance(sl.Modal().serving(lossy), sl.Taylor)
