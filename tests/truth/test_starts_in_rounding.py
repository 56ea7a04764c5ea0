"""Motions that begin at rest on a boundary, which they leave with a high power of time: lower
powers are sums of modes that cancel but for rounding.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl

STIFFNESS = np.array([[4e3, -5e2], [-5e2, 9e3]])
DAMPING_RATIO, RATE = 0.01, 40.0
METHODS = (sl.Taylor(), sl.Modal())


def shaken(contact, sign, power=1):
    """Two masses on springs, of which the second is shaken and the first has a stop at 0: the first
    begins to move with time**(power + 4).
    """
    return structure([sl.Contact("x", gap=0.0, **contact)], sign, power)


def structure(contacts, sign, power=1):
    """The masses with some contacts."""
    return sl.structure(
        np.eye(2), STIFFNESS, modes=2, damping_ratio=DAMPING_RATIO, names="x y", contacts=contacts,
        base=sl.Base("y", lambda t: 8 * sign * sl.sin(RATE * t) ** power),
    )  # fmt: skip


def deflections(run, stiffness=STIFFNESS):
    """x, y and their rates at the end of a run."""
    shapes = sl.structure_modes(np.eye(2), stiffness, 2)["shape"].values
    q = np.array([run[f"end_{name}"].item() for name in run.attrs["states"].split()])
    return np.concatenate([shapes @ q[:2], shapes @ q[2:]])


def integrated(sign, power, force, t_end, held=False):
    """The same motion by DOP853; x is held, or has a force."""
    shapes = sl.structure_modes(np.eye(2), STIFFNESS, 2)["shape"].values
    rates = 2 * DAMPING_RATIO * np.sqrt(np.linalg.eigvalsh(STIFFNESS))
    damping = shapes @ np.diag(rates) @ shapes.T

    def slope(t, state):
        push = np.array([force(state[0]), -8 * sign * np.sin(RATE * t) ** power])
        acceleration = push - STIFFNESS @ state[:2] - damping @ state[2:]
        acceleration[0] *= not held
        return [*state[2:], *acceleration]

    return solve_ivp(
        slope, (0, t_end), np.zeros(4), method="DOP853", rtol=1e-12, atol=1e-18, max_step=5e-4
    ).y[:, -1]


@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("power", [1, 3])
def test_a_spring_that_is_met_or_left_from_rest(method, sign, power):
    """The side is that of the first power that isn't rounding; no contact is recorded there."""
    run = sl.simulate(
        shaken({"stiffness": 5e4}, sign, power), np.zeros(4), t_end=0.06, method=method,
        progress=False,
    )  # fmt: skip
    assert str(run["status"].values) == "ok"
    assert run.sizes["contact"] == 0
    truth = integrated(sign, power, lambda x: -5e4 * max(x, 0.0), 0.06)
    assert deflections(run) == pytest.approx(truth, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_rigid_stop_that_is_pressed_or_left_from_rest(method, sign):
    """The push begins at zero, too: the stop holds, or is left, without an impact."""
    run = sl.simulate(
        shaken({"restitution": 0.5}, sign), np.zeros(4), t_end=0.06, method=method, progress=False
    )
    assert str(run["status"].values) == "ok"
    assert run.sizes["contact"] == 0
    truth = integrated(sign, 1, lambda _: 0.0, 0.06, held=sign < 0)
    assert deflections(run) == pytest.approx(truth, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
@pytest.mark.parametrize("friction", [None, 0.3])
def test_a_spring_beside_a_rigid_stop_that_rests(friction, method):
    """Its gap is a sum of modes that stays zero while the stop holds x: it doesn't stray."""
    stops = [
        sl.Contact("x", gap=0.0, restitution=0.5, preload=5.0),
        sl.Contact("x", gap=0.0, stiffness=5e4, side="lower", friction=friction,
                   sliding=friction and "y"),
    ]  # fmt: skip
    made = structure(stops, -1)
    run = sl.simulate(made, np.zeros(4), t_end=0.06, method=method, progress=False)
    assert str(run["status"].values) in ("ok", "resting")
    assert set(run["contact_guard"].values) <= {"stop2 slides"}
    truth = integrated(-1, 1, lambda _: 0.0, 0.06, held=True)
    assert deflections(run) == pytest.approx(truth, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_a_spring_at_the_place_of_a_stop_is_a_part_of_the_structure(restitution):
    """The stop lets x be positive alone, where the spring acts. The velocity behind a stop without
    rebound is the rounding of its modes. Which rebounds are too low to be followed is left out.
    """
    stop = sl.Contact("x", gap=0.0, side="lower", restitution=restitution, name="stop")
    spring, more = sl.Contact("x", gap=0.0, stiffness=5e4, name="spring"), np.diag([5e4, 0.0])
    found = []
    for stiffness, contacts in ((STIFFNESS, [stop, spring]), (STIFFNESS + more, [stop])):
        made = sl.structure(
            np.eye(2), stiffness, modes=2, names="x y", contacts=contacts,
            base=sl.Base({"x": 1.0, "y": 0.7}, lambda t: -8 * sl.sin(RATE * t)),
        )  # fmt: skip
        run = sl.simulate(made, np.zeros(4), t_end=0.3, method=sl.Modal(), progress=False)
        assert str(run["status"].values) == "ok"
        hard = np.abs(run["contact_velocity"].values) > 1e-6
        found.append((run["contact_time"].values[hard], deflections(run, stiffness)))
    assert len(found[0][0]) > 1
    assert found[0][0] == pytest.approx(found[1][0], rel=1e-9)
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-8, abs=1e-11)


@pytest.mark.parametrize("speed", [1e-5, 1e-9])
def test_small_rebounds_at_a_start_are_impacts(speed):
    """Flights lower than the rounding of the gap's terms: x as a state, and as a sum of modes."""
    shapes = sl.structure_modes(np.eye(2), STIFFNESS, 2)["shape"].values
    pulled, moving = np.array([0.0, 5e-3]), np.array([speed, 0.0])
    times = []
    for modes in (None, 2):
        made = sl.structure(
            np.eye(2), STIFFNESS, modes=modes, names="x y",
            contacts=[sl.Contact("x", gap=0.0, restitution=0.5)],
        )  # fmt: skip
        turned = np.eye(2) if modes is None else shapes.T
        start = np.concatenate([turned @ pulled, turned @ moving])
        for method in METHODS:
            run = sl.simulate(made, start, t_end=0.004, method=method, progress=False)
            assert str(run["status"].values) == "ok"
            times.append(run.contact_time.values)
    assert len(times[0]) > 5
    for other in times[1:]:
        assert other == pytest.approx(times[0], rel=1e-6)


@pytest.mark.nojit
@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
def test_the_first_step_from_rest(method):
    """The same, short enough for plain Python."""
    run = sl.simulate(
        shaken({"restitution": 0.5}, -1), np.zeros(4), t_end=0.01, method=method, progress=False
    )
    assert (str(run["status"].values), run.sizes["contact"]) == ("ok", 0)
    assert abs(deflections(run)[0]) < 1e-18


def test_a_curved_contact_where_a_stop_lets_go():
    """A structure by its degrees of freedom moves as by all its modes, though the accelerations
    cancel in other terms there.
    """

    def contacts(modes):
        made = sl.structure(
            np.eye(2), STIFFNESS, modes=modes, damping_ratio=DAMPING_RATIO, names="x y",
            contacts=[
                sl.Contact("x", gap=0.0, restitution=0.0, preload=10.0),
                sl.Contact("x", gap=0.0, stiffness=1.8e5, power=1.5, side="lower"),
            ],
            base=sl.Base({"x": 1.0, "y": 1.0}, lambda t: 30 * sl.sin(RATE * t)),
        )  # fmt: skip
        start = np.array([-1e-3, 0, 0, 0])
        if modes:
            start[:2] = sl.structure_modes(np.eye(2), STIFFNESS, 2)["shape"].values.T @ start[:2]
        run = sl.simulate(made, start, t_end=0.2, progress=False)
        assert str(run["status"].values) in ("ok", "graze_unresolved")
        return run.contact_time.values[run.contact_kind.values == "release"]

    assert contacts(None) == pytest.approx(contacts(2), abs=1e-8)


def test_a_linear_motion_of_any_size():
    """Squares of its rates overflow, which says nothing of its contacts."""
    made = sl.structure([[1.0]], [[4e3]], names="x",
                        contacts=[sl.Contact("x", gap=0.0, stiffness=5e4)])  # fmt: skip
    small, large = (
        sl.simulate(made, (size, 0), t_end=0.3, method=sl.Taylor(), progress=False)
        for size in (1.0, 2.0**660)
    )
    assert str(large["status"].values) == "ok"
    assert large.contact_time.values == pytest.approx(small.contact_time.values, rel=1e-13)
