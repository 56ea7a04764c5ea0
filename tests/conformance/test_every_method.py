"""The contract of a method: whatever stands in saltus.flow.methods keeps it, one that is added
later too.

Every way of crossing that a method's docstring names is put through it.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus as sl
from conformance.systems import ball_of_clay, bent, bits, lab, pinched
from saltus.analysis.basins import pipeline
from saltus.errors import SaltusWarning
from saltus.flow import engine
from saltus.flow.methods import METHODS
from saltus.study.setting.setting import method_of
from saltus.study.tables.methods import METHODS as TABLES
from saltus.study.tables.signature import documented

#: Options on which the errors depend, by name: fine, and the same rough ones twice, the second
#: finer by a factor. A new option of this sort has its row here.
FINE = {"step": 2e-4, "rtol": 1e-6, "atol": 1e-9}
ROUGH = {"step": (0.1, 4.0), "rtol": (1e-4, 1e3), "atol": (1e-4, 1e3), "tolerance": (1e-4, 1e3)}


def ways(cls):
    """A method in each of its ways across a contact, with fine steps."""
    known = {field.name for field in dataclasses.fields(cls)}
    written = documented(cls).get("events", ("", ""))[0] if "events" in known else ""
    fine = {name: value for name, value in FINE.items() if name in known}
    return [
        cls(**fine, **({"events": way} if way else {}))
        for way in (written.strip("{}").replace('"', "").split(", "))
    ]


EVERY = [one for cls in METHODS.values() for one in ways(cls)]
every = pytest.mark.parametrize("method", EVERY, ids=lambda one: one.label)
each = pytest.mark.parametrize("name", METHODS)
APPROXIMATE = pytest.mark.parametrize(
    "method", [one for one in EVERY if not one.exact], ids=lambda one: one.label
)


# -- closed forms ----------------------------------------------------------------------------------
#: x'' = 1 - x - 0.2 x' from rest: in 8 s a damped turn about x = 1 and a bit, no contact.
LINEAR = lab.with_values(spring=1.0, damping=0.2, lift=1.0, boundary=9.0)


def linear(t):
    """x and v of LINEAR from rest."""
    turn = math.sqrt(0.99)
    swing = math.exp(-0.1 * t)
    return (
        1 - swing * (math.cos(turn * t) + 0.1 / turn * math.sin(turn * t)),
        swing / turn * math.sin(turn * t),
    )


def error(method, t_end=8.0):
    """Distance of the end from the closed form."""
    run = sl.simulate(LINEAR, (0.0, 0.0), t_end=t_end, samples=1, method=method)
    assert str(run.status.values) == "ok"
    return math.hypot(*(np.array([run.end_x, run.end_v]) - linear(t_end)))


@every
def test_a_linear_motion_is_right_within_the_noise_that_the_method_claims(method):
    assert error(method) < method.noise


@each
def test_finer_steps_and_tolerances_bring_smaller_errors(name):
    """A factor of 4 in the step, of 1000 in a tolerance, is worth ten at the least."""
    cls = METHODS[name]
    own = {field.name for field in dataclasses.fields(cls)} & set(ROUGH)
    if {"step", "tolerance"} <= own:  # the tolerance is that of locating
        own -= {"tolerance"}
    if not own:
        assert cls().exact  # there is nothing to make finer
        return
    first = {option: ROUGH[option][0] for option in own}
    second = {option: rough / factor for option, (rough, factor) in ROUGH.items() if option in own}
    if "order" in documented(cls):
        first["order"] = second["order"] = 6
    assert 10 * error(cls(**second)) < error(cls(**first)) < 0.1


#: A unit mass is pushed by a force of 1 against a stop of stiffness 25 at x = 1, from rest at 0.
STOP = lab.with_values(lift=1.0, stiffness=25.0)


def contact_times():
    """Times at which STOP enters its contact and leaves it: x = t^2 / 2 before, an oscillation
    about 1 + 1/25 within.
    """
    enter, turn = math.sqrt(2.0), 5.0
    beyond = lambda s: enter / turn * math.sin(turn * s) + (1 - math.cos(turn * s)) / 25  # noqa: E731
    return np.array([enter, enter + brentq(beyond, 0.5, 1.0, xtol=1e-15)])


@every
def test_contacts_are_where_they_are_within_the_errors_that_are_told(method):
    run = sl.simulate(STOP, (0.0, 0.0), t_end=3.0, samples=1, method=method)
    assert str(run.status.values) == "ok"
    if not method.records_contacts:
        assert run.sizes.get("contact", 0) == 0
        return
    assert run.contact_direction.values.tolist() == [1, -1]
    assert run.contact_mode_before.values.tolist() == [0, 1]
    off = np.abs(run.contact_time.values - contact_times())
    assert (off <= 1.01 * run.contact_time_error.values + 1e-14).all()
    assert (off < method.noise * 3.0).all()  # of the time, as of the range of the speed
    assert np.abs(run.contact_velocity.values) == pytest.approx(
        math.sqrt(2), abs=method.noise * 2 * math.sqrt(2)
    )


#: A ball that falls from a height of 1 onto a stop and rebounds with e = 0.8.
@sl.system(states="x v")
def ball(t, x, v, *, restitution=0.8):
    return v, -2.0, sl.impact(x > 0.0, -v, restitution=restitution)


@every
def test_an_impact_is_where_it_is_within_the_errors_that_are_told(method):
    """At t = 1 with the speed 2; at rest on the stop from t = 9 on, where only the exact method
    goes on.
    """
    run = sl.simulate(ball, (1.0, 0.0), t_end=2.0, samples=1, method=method, time_errors="local")
    assert str(run.status.values) == "ok"
    assert run.contact_kind.values.tolist() == ["impact"]
    assert run.contact_direction.values.tolist() == [-1]
    off = abs(run.contact_time.values[0] - 1.0)
    told = run.contact_time_error.values[0]  # without how errors of v grow into x: another of them
    assert off <= 2.0 * told + 1e-14
    if not method.records_contacts:  # met at the next node
        return
    assert off < 3.0 * method.noise
    assert run.contact_velocity.values[0] == pytest.approx(-2.0, rel=method.noise)
    assert float(run.end_x) == pytest.approx(1.6 - 1.0, abs=3.0 * method.noise)
    assert float(run.end_v) == pytest.approx(1.6 - 2.0, abs=3.0 * method.noise)


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
@every
def test_impacts_that_accumulate_are_completed_or_named(method):
    run = sl.simulate(ball, (1.0, 0.0), t_end=12.0, samples=1, method=method, time_errors="local")
    if method.exact:
        assert (str(run.status.values), float(run.end_x)) == ("ok", 0.0)
    else:
        assert str(run.status.values) in ("budget_events", "turned")


#: Both balls of `pinched` meet the third at 1, with the speed 1.
BOTH_SIDES = (-1.0, 0.0, 1.0, 1.0, 0.0, -1.0)


def of_pinched(method, start=BOTH_SIDES, **values):
    """Status, end and velocities there of a run of 2 s."""
    run = sl.simulate(
        pinched.with_values(**values), start, t_end=2.0, samples=1, method=method,
        time_errors="local",
    )  # fmt: skip
    return str(run.status.values), float(run.end_time), [float(run[f"end_{n}"]) for n in "uvw"]


@every
def test_impacts_at_one_instant_whose_order_matters_end_a_trajectory(method):
    """Equal elastic balls exchange velocities, in any order; three of masses 1, 3, 1 end as -0.5,
    -0.25, 1.25 or as the mirror of it, and with e = 0.5 the orders differ too.
    """
    assert of_pinched(method) == ("ok", 2.0, [-1.0, 0.0, 1.0])
    for values in ({"middle": 3.0}, {"restitution": 0.5}):
        with pytest.warns(SaltusWarning, match="depends on which is taken first"):
            status, end, velocities = of_pinched(method, **values)
        assert (status, velocities) == ("ambiguous_impact", [1.0, 0.0, -1.0])
        assert end == pytest.approx(1.0, abs=1e-12 if method.records_contacts else 0.21)


@pytest.mark.parametrize(
    "method", [one for one in EVERY if one.records_contacts], ids=lambda one: one.label
)
def test_one_of_two_impacts_a_little_later_is_no_question(method):
    for sign in (-1, 1):
        moved = (-1.0 + 1e-9 * sign, *BOTH_SIDES[1:])
        status, _, velocities = of_pinched(method, moved, middle=3.0)
        assert status == "ok"
        first = [-0.5, -0.25, 1.25] if sign > 0 else [-1.25, 0.25, 0.5]
        assert velocities == pytest.approx(first, abs=1e-12)


@every
def test_a_restitution_that_leaves_its_bounds_ends_a_trajectory(method):
    """Of 0.5 + v or 0.5 - v: at -sqrt(2) it is negative or above 1, at -0.1 it is 0.4 or 0.6. At
    the start it is an initial condition.
    """

    def run(slope, start, t_end):
        return sl.simulate(
            ball_of_clay.with_values(slope=slope), start, t_end=t_end, samples=1, method=method,
            time_errors="local",
        )  # fmt: skip

    for slope in (1.0, -1.0):
        for start in ((1.0, 0.0), (0.0, -math.sqrt(2.0))):
            with pytest.warns(SaltusWarning, match=r"outside \[0, 1\]"):
                found = run(slope, start, 3.0)
            assert str(found.status.values) == "invalid_restitution"
            assert int(found.events) == 0
            off = 3.0 * method.noise if method.records_contacts else 0.31
            assert float(found.end_v) == pytest.approx(-math.sqrt(2.0), abs=off)
        if method.records_contacts:
            found = run(slope, (0.005, 0.0), 0.11)
            assert found.contact_v.values == pytest.approx([0.05 - slope * 0.01], rel=0.03)


@sl.system(states="v")
def rub(t, v, *, friction=1.0):
    """It sticks once 1 + 0.5 sin(t) - t is zero: there the force is weaker than the friction."""
    return 0.5 * sl.cos(t) - friction * sl.sign(v)


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
@every
def test_friction_that_sticks_is_followed_or_named(method):
    """Only what isn't located goes to and fro across v = 0."""
    stops = brentq(lambda t: 1 + 0.5 * math.sin(t) - t, 1.0, 2.0, xtol=1e-15)
    method = dataclasses.replace(method, max_steps=20_000)
    run = sl.simulate(rub, (1.0,), t_end=3.0, samples=1, method=method, time_errors="local")
    if method.exact:
        assert (str(run.status.values), float(run.end_v)) == ("ok", 0.0)
        assert run.contact_time.values == pytest.approx([stops], rel=1e-14)
        return
    assert abs(float(run.end_v)) < 3.0 * method.noise + FINE["step"]
    if method.records_contacts:
        assert str(run.status.values) == "sliding"
        assert float(run.end_time) == pytest.approx(stops, abs=3.0 * method.noise + FINE["step"])


# -- one trajectory and many -----------------------------------------------------------------------
RIG = sl.models.delangre("b", force="4 N", frequency="7 Hz")
START = np.random.default_rng(5).uniform((-1e-3, -0.1), (1e-3, 0.1), (6, 2))


def run(method, start=START, **more):
    return sl.simulate(RIG, start, 5, samples=7, method=method, time_errors="local", **more)


@every
def test_a_trajectory_is_the_same_alone_and_in_any_threads_and_pieces(method, monkeypatch):
    whole = run(method, threads=1)
    assert whole.equals(run(method, threads=3))
    alone, among = bits(run(method, tuple(START[2]))), bits(whole, 2)
    assert {name: among[name] for name in alone} == alone
    monkeypatch.setattr(engine, "SLICE", 20)
    assert whole.equals(run(method, threads=1))
    exact = sl.simulate(RIG, START, 5, samples=7)
    assert np.abs(whole.x - exact.x).max() < 1e-6  # [m], of some mm


@pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")
@every
def test_a_blow_up_stays_in_its_lane(method):
    """x'' = x^3 from 1e5 is at infinity long before the end."""
    runaway = bent.with_values(cubic=-1.0, boundary=0.5)
    healthy = {"x": np.array([0.1, -0.2, 0.45]), "v": np.array([0.01, 0.3, -0.4])}
    mixed = {"x": np.insert(healthy["x"], 1, 1e5), "v": np.insert(healthy["v"], 1, 1e9)}
    few = dataclasses.replace(method, max_steps=20_000)
    alone, among = (
        sl.simulate(runaway, start, t_end=1.0, samples=3, method=few, time_errors="local")
        for start in (healthy, mixed)
    )
    assert among.status.values.tolist() == ["ok", "nonfinite", "ok", "ok"]
    assert np.isfinite([among.end_x[1], among.end_v[1], among.end_time[1]]).all()
    assert [bits(among, i) for i in (0, 2, 3)] == [bits(alone, i) for i in range(3)]


@every
def test_what_a_stopped_run_has_is_that_of_the_whole(method, monkeypatch):
    monkeypatch.setattr(engine, "CHUNK", 1)
    whole, stop = run(method, threads=1), sl.Stop()
    with stop, pytest.raises(sl.Interrupted) as stopped:
        run(method, threads=1, progress=lambda share: stop.set() if share > 0 else None)
    part = stopped.value.partial
    assert set(part.status.values.tolist()) <= {"ok", "interrupted", "not_computed"}
    there = np.isfinite(part.x.values)
    assert there.any()
    np.testing.assert_array_equal(part.x.values[there], whole.x.values[there])
    for i in np.flatnonzero(part.status.values == "ok"):
        assert bits(part, i) == bits(whole, i)


# -- what is said ----------------------------------------------------------------------------------
@every
def test_a_method_says_what_it_is(method):
    cls = type(method)
    assert METHODS[method.name] is cls is getattr(sl, method.name)
    assert repr(method).startswith(f"{method.name}(")
    assert method.label.lower().startswith(method.name.lower())
    assert cls(**method.options()) == method
    assert hash(cls(**method.options())) == hash(method)
    made = run(method)
    assert made.attrs["method"] == method.name
    assert json.loads(made.attrs["method_options"]) == method.options()
    assert method.companion().exact


def test_methods_that_differ_have_labels_that_differ():
    labels = [one.label for one in EVERY]
    assert len(set(labels)) == len(labels)


@each
def test_options_that_are_none_are_refused_in_a_sentence(name):
    cls = METHODS[name]
    right = {field: value for field, value in FINE.items() if field in documented(cls)}
    for option, wrong in itertools.product(
        documented(cls), (math.nan, math.inf, -1, 0, [2], "many")
    ):
        with pytest.raises(sl.SaltusError, match=rf"^[^\n]*{option}[^\n]*\.$"):
            cls(**{**right, option: wrong})
    for option in documented(cls):
        with pytest.raises(
            sl.SaltusError,
            match=f"sl.{name} has no option '{option}z'. (Did you mean '{option}'|Write)",
        ):
            cls(**right, **{f"{option}z": 1})
    with pytest.raises(sl.SaltusError, match=r"takes .*=, not 99 values in a row"):
        cls(*range(99))
    with pytest.raises(sl.SaltusError, match=f"method must be such as .*, not {name} itself"):
        sl.simulate(RIG, (0.0, 0.0), 1, method=cls)


@every
def test_a_study_file_asks_for_the_same_method(method):
    assert set(TABLES) == set(METHODS)
    written = {key: value for key, value in method.options().items() if value is not None}
    table = TABLES[method.name].model_validate({"name": method.name, **written})
    assert method_of(table, RIG) == method


# -- in every question -----------------------------------------------------------------------------
FREQUENCY = ("7 Hz", "8 Hz", 2)
IN_QUESTIONS = {
    "attractors": lambda method: sl.attractors(RIG, START, method=method),
    "responses": lambda method: sl.frequency_response(RIG, FREQUENCY, method=method),
    "diagram": lambda method: sl.bifurcation_diagram(RIG, {"frequency": FREQUENCY}, method=method),
}


@pytest.fixture(scope="module")
def exactly():
    """The exact answers to these questions."""
    return {name: asked(sl.Taylor()) for name, asked in IN_QUESTIONS.items()}


@APPROXIMATE
@pytest.mark.slow
def test_orbits_are_the_exact_ones(exactly, method):
    found = {name: asked(method) for name, asked in IN_QUESTIONS.items()}
    for name in ("attractors", "diagram"):
        kind = "attractor_type" if name == "attractors" else "type"
        assert found[name][kind].values.tolist() == exactly[name][kind].values.tolist()
    for name, peak in (("attractors", "attractor_peak"), ("responses", "peak")):
        np.testing.assert_allclose(found[name][peak], exactly[name][peak], rtol=1e-4)


@pytest.mark.slow
def test_all_are_compared_side_by_side(monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    approximate = [one for one in EVERY if not one.exact]
    table = sl.compare_methods(RIG, sl.frequency_response, approximate, frequency=["7 Hz"])
    assert table.sizes["method"] == 1 + len(approximate)
    assert (table["method_agreement"] == 1.0).all()
    assert (table["step_error"].isel(method=slice(1, None)) > 0.0).all()
    assert (table["steps_per_period"] > 0.0).all()
    stopped = sl.compare_methods(
        sl.models.impact_oscillator(),
        sl.frequency_response,
        [sl.ODE45(1e-6, 1e-9), sl.RK4(5e-3), sl.RK4(5e-3, "ignore")],
        frequency=("1 rad/s", "1.1 rad/s", 2),
    )
    exact, ode45, located, late = stopped["step_error"].values.max(axis=1)
    assert (stopped["method_agreement"] == 1.0).all()
    assert exact == 0.0
    assert max(ode45, located) < 1e-6
    assert late > 1e-4  # h = 5e-3, and the impact is up to a step late
    rests = sl.compare_methods(
        sl.models.bouncing_ball(),
        sl.bifurcation_diagram,
        [sl.ODE45(1e-6, 1e-9)],
        vary={"amplitude": (1.1, 1.2, 2)},
        start=(2.0, 0.0),
    )
    assert (rests["type"].values[1] == "failed").all()
    assert np.isnan(rests["step_error"].values[1]).all()
    maps = sl.compare_methods(
        RIG,
        sl.basins,
        [sl.RK4("2 ms", "henon"), sl.ODE23(1e-3, 1e-6)],
        x=("-1 mm", "1 mm", 4),
        v=("-0.1 m/s", "0.1 m/s", 4),
    )
    assert (maps["method_agreement"] == 1.0).all()
