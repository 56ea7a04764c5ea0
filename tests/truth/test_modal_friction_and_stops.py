"""Friction beside rigid stops in the modal flow: closed forms, Taylor's method, differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from rubbing_bodies import BODIES, drawn, made
from saltus.flow.maps import Stroboscope
from saltus.system.linearity import linear_pieces
from two_flows import FOLLOWS, runs, same_rows, times

SEED = 20261126


# -- closed forms ----------------------------------------------------------------------------------
@sl.system(states="x y u v")
def thrown(t, x, y, u, v, *, level=0.5, e=0.5):
    """A free body, and a rough one that it strikes."""
    law = sl.impact(x < y, u - v, restitution=e, inertia={"u": 1.0, "v": 1.0})
    return u, v, 0.0, -sl.friction(v, slip=level), law


def test_a_blow_throws_a_body_that_sticks():
    """Of its speed c the striker keeps (1 - e) c / 2. The struck body gets (1 + e) c / 2, slides
    (1 + e)^2 c^2 / (8 level), and sticks until it is overtaken.
    """
    assert isinstance(sl.Modal().serving(thrown), sl.Modal)
    run = sl.simulate(thrown, (-1, 0, 1, 0), t_end=3.95, method=sl.Modal(), **FOLLOWS)
    speed, now, place, known = 1.0, 1.0, 0.0, []
    for _ in range(3):
        push, speed = 0.75 * speed, 0.25 * speed
        known += [(now, "impact"), (now, "release"), (now + push / 0.5, "hold")]
        place, now = place + push**2, now + push**2 / speed
    assert run.contact_kind.values.tolist() == [kind for _, kind in known]
    assert run.contact_time.values == pytest.approx([time for time, _ in known], rel=1e-13)
    assert (float(run.end_y), float(run.end_v)) == (pytest.approx(place, rel=1e-13), 0.0)
    assert float(run.end_u) == pytest.approx(speed, rel=1e-13)


def test_a_body_leaves_a_stop_where_static_friction_along_it_is_overcome():
    """How both share the force isn't said. While they do the body rests, and it rests on until it
    is pulled away by more than friction holds. Modes leave it to Taylor's method.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def rubbed(t, x, v, *, w=0.7, lag=0.0, level=0.3, stick=0.3, gap=0.2, e=0.5):
        law = sl.impact(x < gap, v, restitution=e)
        return v, sl.cos(w * t + lag) - x - sl.friction(v, slip=level, stick=stick), law

    @sl.system(states="x v")
    def jointed(t, x, v):
        law = sl.impact(x < 1.0, v, restitution=0.5)
        return v, -x - sl.slider(x, stiffness=2.0, limit=1.0), law

    assert "along the direction" in str(linear_pieces(rubbed))
    assert "follows the direction" in str(linear_pieces(jointed))
    for stick in (0.3, 0.45):
        system = rubbed.with_values(stick=stick)
        run = sl.simulate(system, (0.2, 0.0), t_end=4.0, method=sl.Modal(), **FOLLOWS)
        assert times(run, "release")[-1] == pytest.approx(math.acos(0.2 - stick) / 0.7, rel=1e-13)
    # thrown onto the stop without rebound while friction at rest alone can hold it
    system, lag = rubbed.with_values(stick=0.45, e=0.0, lag=0.7 * 2.45), 0.7 * 2.45
    run = sl.simulate(system, (0.1, 5.0), t_end=1.0, **FOLLOWS)
    assert run.contact_kind.values.tolist() == ["impact", "hold", "release"]
    known = (math.acos(-0.25) - lag) / 0.7
    assert times(run, "release")[0] == pytest.approx(known, rel=1e-12)


@pytest.mark.nojit
@pytest.mark.parametrize("method", [sl.Modal(), sl.Taylor()])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_body_at_rest_moves_when_static_friction_is_overcome(method, way):
    """It is pulled by 1.2 + 0.5 sin t, more than friction in motion; friction at rest holds 1.5."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def pulled(t, x, v, *, w=1.0, mean=1.2, rise=0.5, slip=1.0, stick=1.5):
        return v, mean + rise * sl.sin(w * t) - sl.friction(v, slip=slip, stick=stick)

    system = pulled.with_values(mean=1.2 * way, rise=0.5 * way)
    run = sl.simulate(system, (0.0, 0.0), t_end=1.5, method=method, **FOLLOWS)
    assert times(run, "release") == pytest.approx([math.asin(0.6)], rel=1e-13)
    assert float(run.end_x) * way > 0.1


# -- beside other solvers --------------------------------------------------------------------------
@pytest.fixture(scope="module")
def system():
    return made()


@pytest.mark.parametrize(
    "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 8))]
)
def test_random_bodies_rub_and_strike_as_by_taylor(system, seed):
    """Every row, of frictions, the memory, impacts, rests."""
    one, start = drawn(system, np.random.default_rng([SEED, seed]))
    modal, taylor = runs(one, start, periods=5)
    assert str(modal.status.values) == str(taylor.status.values) == "ok"
    same = same_rows(modal, taylor, 2 * math.pi / one.values["w"])
    if same < 40:
        assert same == modal.sizes["contact"] == taylor.sizes["contact"]
        for name in one.states:
            known = float(taylor[f"end_{name}"])
            assert float(modal[f"end_{name}"]) == pytest.approx(known, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_random_bodies_begin_at_rest_as_by_taylor(system, seed):
    """From exact rest, the first body pulled by more than friction in motion, by less than friction
    at rest holds, to either side.
    """
    one, start = drawn(system, np.random.default_rng([SEED, 2, seed]))
    v, way = one.values, 1 - 2 * (seed % 2)
    pull = 1.1 * way * v["slip"] - v["force0"] * math.cos(v["lag0"])
    one = one.with_values(stick=1.2 * v["slip"], belt=0.0, sway=0.0, dead0=pull, e=0.5, f=0.5)
    modal, taylor = runs(one, 0.0 * start, periods=1)
    assert str(modal.status.values) == str(taylor.status.values) == "ok"
    held = 1 << [guard.name for guard in one.guards].index("v0 = belt + sway*cos(w*t) held")
    assert int(modal.mode.values.ravel()[0]) & int(taylor.mode.values.ravel()[0]) & held
    assert same_rows(modal, taylor, 2 * math.pi / v["w"]) >= min(40, modal.sizes["contact"])


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_are_those_of_the_motion(system, seed):
    """Central differences of 1e-6."""
    one, start = drawn(system, np.random.default_rng([SEED, 1, seed]))
    one = one.with_values(e=0.4, f=0.7)
    size = 2 * BODIES
    _, found = Stroboscope(one, sl.Modal()).tangent(start[None], 1)
    beside = start + 1e-6 * np.vstack([np.eye(len(start)), -np.eye(len(start))])
    run = sl.simulate(one, beside, periods=1, samples=2, method=sl.Modal(), progress=False)
    assert {"impact", "hold", "release"} <= set(run.contact_kind.values.tolist())
    ends = np.array([run[f"end_{name}"].values for name in one.states])
    known = (ends[:, : len(start)] - ends[:, len(start) :]) / 2e-6
    apart = np.abs(found[0] - known)[:, :size].max()
    assert apart <= 1e-5 * np.abs(known).max()


@sl.system(states="x y z u v w")
def wedge(t, x, y, z, u, v, w, *, a=0.1, b=0.9, c=0.1, e=0.9, push=0.2, weight=1.0, slip=0.05):
    """A body that slides on a floor into an overhanging wall, and rubs along z."""
    return (
        u, v, w, push, -weight, -sl.friction(w, slip=slip),
        sl.impact(y > 0, -v, restitution=e),
        sl.impact(a * x + b * y + c * z < 0, a * u + b * v + c * w, restitution=e,
                  inertia={"u": 1.0, "v": 1.0, "w": 1.0}),
    )  # fmt: skip


def thrown_along(a, b, c, e, pairs):
    """Speed -w after blows of the wall and the floor in turn, of a closing velocity of 1."""
    velocity = np.array([1 / a, 0.0, 0.0])
    for _ in range(pairs):
        velocity -= (1 + e) * np.dot((a, b, c), velocity) * np.array([a, b, c])
        velocity[1] = abs(velocity[1]) * e
    return -velocity[2]


PUSH, SLIP = 0.2, 0.05


def wedged():
    """The body, a start that comes to the wedge at t = 1, and its velocities behind all impacts:
    after the 50 that are taken one by one it slides along z as before, the others turn it.
    """
    b, e = 0.9995, 0.9
    a = c = math.sqrt((1 - b * b) / 2)
    some, every = (thrown_along(a, b, c, e, pairs) for pairs in (25, 5000))
    share = (some + every) / 2
    speed = share * a / (1 - share * c)
    one = wedge.with_values(a=a, b=b, c=c, e=e, push=PUSH, slip=SLIP)
    start = (-1 + PUSH / 2, 0.0, -speed - SLIP / 2, 1 - PUSH, 0.0, speed + SLIP)
    return one, start, speed - every * (a + c * speed)


def test_impacts_without_end_that_turn_a_friction_are_completed_on_its_other_side():
    """Floor and wall throw the body to and fro at one instant, t = 1."""
    one, start, left = wedged()
    for run in runs(one, start, t_end=1.2):
        assert str(run.status.values) == "ok"
        assert left < 0
        # on the wall and the floor it is moved along (c, 0, -a)
        assert float(run.end_w) == pytest.approx(left - 0.2 * (PUSH - SLIP) / 2, abs=1e-9)
        assert float(run.end_u) == pytest.approx(-float(run.end_w), abs=1e-12)


def test_impacts_without_end_that_turn_a_friction_have_the_rates_behind_it():
    """Central differences. How early they come depends on the place of the start."""
    one, start, _ = wedged()
    given = {"t_end": 1.2, "samples": 2, "method": sl.Taylor(), "progress": False}
    found = sl.sensitivity(one, start, to=["x(0)", "z(0)"], extremes=False, **given)
    assert str(found.status.values) == "ok"
    for column, at in enumerate((0, 2)):
        beside = start + 1e-6 * np.outer([1.0, -1.0], np.arange(6) == at)
        run = sl.simulate(one, beside, **given)
        ends = np.array([run[f"end_{name}"].values for name in one.states])
        known = (ends[:, 0] - ends[:, 1]) / 2e-6
        assert found.end_derivative.values[:, column] == pytest.approx(known, abs=1e-7)
