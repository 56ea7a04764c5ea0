"""Poincare sections against closed forms, against a solver of another kind, and against a search
among dense samples.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import EPS, lab
from saltus.errors import ParameterError
from saltus.system.quantity import turning_surfaces, with_level, with_surface

solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp

#: One compilation for most of this file: the shared oscillator, the turning points of x, and a
#: level of x.
SYSTEM = with_level(turning_surfaces(lab, "x")[0], "x", 0.3)
OSCILLATOR = {"spring": 1.0, "boundary": 5.0}
STOP = {
    "spring": 1.0,
    "damping": 0.02,
    "force": 0.8,
    "boundary": 0.3,
    "stiffness": 40.0,
    "dashpot": 1.5,
    "frequency": 0.2,
}


@sl.system(states="x y z")
def lorenz(t, x, y, z, *, sigma=10.0, rho=28.0, beta=8 / 3):
    return sigma * (y - x), x * (rho - z) - y, x * y - beta * z


# -- closed forms ----------------------------------------------------------------------------------
def test_the_level_of_an_oscillator_is_crossed_at_arccos_times():
    section = sl.poincare(SYSTEM, (1.0, 0.0), "surface_level", t_end=99.0, values=OSCILLATOR)
    turn = np.arange(16) * 2 * math.pi
    exact = np.sort(np.concatenate([turn + math.acos(0.3), turn + 2 * math.pi - math.acos(0.3)]))
    exact = exact[exact < 99.0]
    assert section.sizes["crossing"] == len(exact) == int(section.crossings)
    # each step may add so much; the first crossings are exact
    rounding = 4 * EPS * int(section.steps)
    assert np.abs(section.crossing_time.values - exact).max() < rounding
    assert np.abs(section.crossing_time.values - exact)[:4].max() < 8 * EPS
    assert (section.x.values == 0.3).all()
    speed = math.sqrt(1 - 0.3**2)
    assert np.abs(section.v.values - speed * section.crossing_direction.values).max() < rounding
    assert section.crossing_rate.values == pytest.approx(section.v.values, rel=1e-12)
    assert section.crossing_direction.values.tolist() == [-1, 1] * (len(exact) // 2) + [-1] * (
        len(exact) % 2
    )


def test_one_direction_and_a_transient():
    section = sl.poincare(
        SYSTEM,
        (1.0, 0.0),
        "surface_level",
        direction=1,
        periods=2,
        transient=1,
        values=OSCILLATOR | {"frequency": 0.1},
    )
    exact = np.arange(10) * 2 * math.pi + 2 * math.pi - math.acos(0.3)
    exact = exact[(exact > 10.0) & (exact <= 30.0)]
    assert section.crossing_time.values == pytest.approx(exact, rel=1e-14)
    assert section.crossing_phase.values == pytest.approx(exact / 10.0 % 1.0, abs=1e-14)
    assert section.crossing_period.values.tolist() == (exact // 10.0).tolist()


def test_the_phase_is_that_of_the_forcing_wherever_the_run_begins():
    section = sl.poincare(
        SYSTEM,
        (1.0, 0.0),
        "surface_level",
        periods=1,
        t_start=3.0,
        values=OSCILLATOR | {"frequency": 0.1},
    )
    assert section.crossing_time.values[0] == pytest.approx(3.0 + math.acos(0.3), rel=1e-15)
    assert section.crossing_phase.values == pytest.approx(
        section.crossing_time.values / 10.0 % 1.0, abs=1e-14
    )


def test_turning_points_of_an_oscillator():
    section = sl.poincare(
        SYSTEM, (math.cos(1.0), -math.sin(1.0)), "x turns", t_end=50.0, values=OSCILLATOR
    )
    exact = np.arange(1, 17) * math.pi - 1.0
    assert section.crossing_time.values == pytest.approx(exact[exact < 50.0], rel=1e-14)
    assert (section.v.values == 0.0).all()
    assert np.abs(np.abs(section.x.values) - 1.0).max() < 1e-14
    # a maximum is met from + to -
    assert (section.crossing_direction.values == -np.sign(section.x.values)).all()


def test_the_interval_is_open_at_its_start_and_closed_at_its_end():
    start = (0.3, math.sqrt(1 - 0.3**2))
    section = sl.poincare(
        SYSTEM, start, "surface_level", t_end=2 * math.acos(0.3) + 1e-9, values=OSCILLATOR
    )
    assert section.crossing_time.values == pytest.approx([2 * math.acos(0.3)], rel=1e-14)
    # x = 0.3 t, exactly 0.3 at the end
    with_end = sl.poincare(SYSTEM, (0.0, 0.3), "surface_level", t_end=1.0, values={"boundary": 5.0})
    assert with_end.crossing_time.values.tolist() == [1.0]


def test_a_tangency_is_no_crossing():
    grazing = sl.poincare(
        SYSTEM, (0.3 - 0.5, 1.0), "surface_level", t_end=3.0, values={"lift": -1.0, "boundary": 5.0}
    )  # x = 0.3 - (t-1)^2/2
    assert grazing.sizes["crossing"] == 0
    assert int(grazing.tangencies) == 1


# -- with contacts ---------------------------------------------------------------------------------
def test_a_section_among_contacts_is_what_dense_samples_show():
    """The same motion without the surface, sampled 4000 times a period: as many changes of sign,
    each within a sample; as many contacts.
    """
    section = sl.poincare(
        SYSTEM, (0.0, 0.5), "surface_level", periods=40, values=STOP | {"surface_level": 0.1}
    )
    turning = sl.poincare(SYSTEM, (0.0, 0.5), "x turns", periods=40, values=STOP)
    plain = sl.simulate(lab, (0.0, 0.5), periods=40, samples=4000, values=STOP, time_errors="local")
    for found, signal in ((section, plain.x.values - 0.1), (turning, plain.v.values)):
        change = np.flatnonzero(np.diff(np.sign(signal)))
        assert found.sizes["crossing"] == len(change) > 60
        assert (found.crossing_time.values >= plain.time.values[change]).all()
        assert (found.crossing_time.values <= plain.time.values[change + 1]).all()
        assert int(found.contacts) == int(plain.events) > 60
        assert int(found.tangencies) == 0
        assert abs(float(found.end_x - plain.end_x)) < 1e-13


def test_a_guard_is_a_surface_too():
    section = sl.poincare(SYSTEM, (0.0, 0.5), "boundary", direction=1, periods=40, values=STOP)
    plain = sl.simulate(lab, (0.0, 0.5), periods=40, samples=1, values=STOP, time_errors="local")
    entries = plain.contact_time.values[plain.contact_direction.values == 1]
    assert section.crossing_time.values == pytest.approx(entries, rel=1e-13)


def test_a_surface_on_a_contact_changes_nothing():
    """Level and boundary in one place: both are met at one instant, and the contact does what it
    did.
    """
    section = sl.poincare(
        SYSTEM, (0.0, 0.5), "surface_level", periods=40, values=STOP | {"surface_level": 0.3}
    )
    contact = sl.poincare(
        SYSTEM, (0.0, 0.5), "boundary", periods=40, values=STOP | {"surface_level": 0.9}
    )
    assert section.crossing_time.values == pytest.approx(contact.crossing_time.values, rel=1e-13)
    # surfaces are no contacts
    assert int(section.contacts) == int(contact.contacts) == contact.sizes["crossing"] > 60


def test_many_trajectories_share_one_table():
    starts = {"x": [0.0, 0.1, 0.2], "v": 0.5}
    many = sl.poincare(
        SYSTEM,
        starts,
        "surface_level",
        periods=5,
        values=STOP | {"surface_level": [0.1, 0.0, -0.1]},
    )
    assert many.crossings.values.sum() == many.sizes["crossing"]
    for i, level in enumerate([0.1, 0.0, -0.1]):
        alone = sl.poincare(
            SYSTEM,
            (0.1 * i, 0.5),
            "surface_level",
            periods=5,
            values=STOP | {"surface_level": level},
        )
        mine = many.crossing_trajectory.values == i
        assert many.crossing_time.values[mine].tobytes() == alone.crossing_time.values.tobytes()


# -- other systems, other methods ------------------------------------------------------------------
def test_the_lorenz_section_against_another_solver():
    """z = rho - 1, seen by an 8th-order Runge-Kutta method of scipy's. Errors grow as exp(0.9 t):
    1e-13 to 1e-9 in ten seconds.
    """
    start, level = (1.0, 1.0, 20.0), 27.0
    section = sl.poincare(lorenz, start, ("z", level), t_end=10.0, transient=0.5)
    flow = lambda t, y: (10 * (y[1] - y[0]), y[0] * (28 - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2])  # noqa: E731
    run = solve_ivp(
        flow,
        (0, 10),
        start,
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        events=lambda t, y: y[2] - level,
    )
    late = run.t_events[0] > 0.5
    assert section.crossing_time.values == pytest.approx(run.t_events[0][late], abs=1e-8)
    assert np.abs(section.x.values - run.y_events[0][late, 0]).max() < 1e-7
    assert (section.z.values == level).all()
    assert np.isnan(section.crossing_phase.values).all()
    assert section.crossing_rate.values == pytest.approx(
        section.x.values * section.y.values - 8 / 3 * level, rel=1e-12
    )
    assert section.attrs["surface"] == "z = 27"


def test_ode45_locates_a_surface_and_refuses_to_step_over_it():
    exact = np.array([math.acos(0.3), 2 * math.pi - math.acos(0.3)])
    errors = []
    for rtol in (1e-4, 1e-8):
        section = sl.poincare(
            SYSTEM,
            (1.0, 0.0),
            "surface_level",
            t_end=6.0,
            values=OSCILLATOR,
            method=sl.ODE45(rtol, rtol * 1e-3),
        )
        errors.append(np.abs(section.crossing_time.values - exact).max())
    assert errors[0] < 1e-3
    assert errors[1] < 1e-7
    with pytest.raises(ParameterError, match="needs a method that locates contacts"):
        sl.poincare(
            SYSTEM, (1.0, 0.0), "surface_level", t_end=6.0, method=sl.ODE45(events="ignore")
        )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"surface": "levle"}, "no boundary 'levle'"),
        ({"surface": ("x", 0.3, 1)}, "a pair of a state and a value"),
        ({"surface": ("y", 0.3)}, "no state 'y'"),
        ({"surface": 3.0}, "no boundary 3.0"),
        ({"direction": 2}, "direction must be 0, 1 or -1"),
        ({"transient": -1}, "transient must be a whole number of at least 0"),
        ({"transient": 3, "periods": None, "t_end": 250.0}, "outlast the run"),
    ],
)
def test_what_cant_be_asked_for(arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.poincare(SYSTEM, (1.0, 0.0), **({"surface": "boundary", "periods": 1} | arguments))


def test_a_surface_that_is_a_guard_already_stands_beside_it():
    twice = with_surface(lab, lambda x, boundary: x - boundary)
    assert [guard.name for guard in twice.guards] == ["boundary", "surface"]


@sl.system(states="x v", forced_at="f", units={"f": "Hz"})
def hammer(t, x, v, *, gap=1e-4, f=28.0):
    """A mass on a spring that chatters against a stop until it rests."""
    push = 20.0 * sl.cos(2 * sl.pi * f * t) - 4.0 * v - 4e3 * x
    return v, push, sl.impact(x < gap, v, restitution=0.8)


def test_a_chatter_ends_where_its_turning_points_are_asked_for():
    """Each flight has a node at its turning point, whose height is rounded: flights lower than that
    rounding would all rebound with one speed, without an end.
    """
    run = sl.simulate(hammer, (0, 0), periods=60, progress=False, time_errors="local")
    turns = sl.poincare(hammer, (0, 0), "x turns", periods=60, progress=False)
    assert str(turns.status.values) == "ok"
    impacts = int((run.contact_kind == "impact").sum())
    assert turns.sizes["crossing"] < 3 * impacts
    assert (run.contact_kind.values == "hold").any()


@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=lambda one: one.name)
def test_the_force_of_a_stop_turns_in_contact_alone(method):
    """Once in each contact, where the velocity is zero: without damping, by closed form."""
    square, stiffness, gap, speed = 4e3, 5e4, 1e-3, 0.5
    made = sl.structure(
        [[1.0]], [[square]], names="x", sensors={"f": sl.contact_force("stop")},
        contacts=[sl.Contact("x", gap=gap, stiffness=stiffness, name="stop")],
    )  # fmt: skip
    section = sl.poincare(made, (0.0, speed), "f turns", t_end=0.3, method=method, progress=False)
    slow, fast = math.sqrt(square), math.sqrt(square + stiffness)
    met = math.asin(gap * slow / speed) / slow
    closing = math.sqrt(speed**2 - square * gap**2)
    centre = stiffness * gap / fast**2  # of the vibration in contact
    turn = math.atan2(closing / fast, gap - centre) / fast
    high = centre + math.hypot(gap - centre, closing / fast)
    cycle = 2 * (met + turn) + math.pi / slow
    exact = np.arange(met + turn, 0.3, cycle)
    assert (str(section["status"].values), len(exact)) == ("ok", 5)
    assert section.crossing_time.values == pytest.approx(exact, rel=1e-11)
    assert np.abs(section.f.values) == pytest.approx(stiffness * (high - gap), rel=1e-10)
