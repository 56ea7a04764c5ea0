"""Both flows from end to end in sizes so small that they also run as plain Python:
NUMBA_DISABLE_JIT=1 pytest -m nojit --cov=saltus.

The numbers are closed forms. With the JIT off a product and a sum round twice, so the last digits
differ; bounds allow for that.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from oracles import piecewise_linear
from power_laws import duration_of, power_stop
from saltus.errors import SaltusWarning
from saltus.flow import engine
from saltus.language.evaluate import evaluate

pytestmark = pytest.mark.nojit

ODE45 = sl.ODE45(1e-8, 1e-11)


def thrown(gap, force=-2.0, **values):
    """x'' = force between boundaries -gap and gap that don't push back (the gear pair with slack
    teeth): x = v0 t + force t^2 / 2.
    """
    slack = {
        "mesh_mass": 1.0,
        "damping_ratio": 0.0,
        "mesh_stiffness": 0.0,
        "alternating_force": 0.0,
        "mesh_frequency": 0.1,
    }
    return sl.models.gear_pair(**{**slack, "gap": gap, "mean_force": force, **values})


@pytest.fixture(autouse=True)
def _silent():
    """Idle lanes divide zero by zero; compiled arithmetic doesn't say so, NumPy's does."""
    with np.errstate(all="ignore"):
        yield


def sides(system, state, t=0.0):
    """Mode bits of a state off all boundaries."""
    gaps = evaluate(
        [g.gap for g in system.guards],
        t=t,
        states=dict(zip(system.states, state, strict=True)),
        values=system.values,
    )
    return sum(1 << i for i, gap in enumerate(gaps) if gap > 0)


def linear_rig(**values):
    return sl.models.delangre("b", **{"cubic": 0.0, **values})


def closed_form(rig, x, v, end):
    p = dict(rig.values)
    drive = p["force"] * (1 - 18 / (2 * math.pi * p["frequency"]) ** 2)
    return piecewise_linear.contacts({**p, "drive": drive}, x, v, end)


# -- laws without a Taylor series on a boundary ----------------------------------------------------


@pytest.mark.slow
def test_hertz_contacts_last_as_long_as_the_closed_form_says():
    system = power_stop.with_values(stiffness=1e6)
    run = sl.simulate(
        system,
        [(0.0, 0.2), (0.0, -0.2)],
        t_end=0.02,
        method=sl.Taylor(order=12, lanes=2),
    )
    assert list(run.status.values) == ["ok"] * 2
    first = run.contact_time.values[run.contact_trajectory.values == 0]
    assert np.abs(first - duration_of(0.2, 1e6, 1.5)) < 1e-15


# -- Taylor ----------------------------------------------------------------------------------------


def test_contacts_samples_and_end_of_the_linear_rig():
    rig = linear_rig()
    run = sl.simulate(rig, (1e-3, 0.05), 2, samples=7)
    truth = closed_form(rig, 1e-3, 0.05, run.end_time.item())
    assert run.status.item() == "ok"
    assert run.mode_violations.item() == 0
    assert run.events.item() == truth.time.size > 3
    assert run.contact_x.values.tolist() == [
        (-0.0, -rig.values["lower_gap"], rig.values["upper_gap"])[side] for side in truth.guard
    ]
    assert run.contact_direction.values.tolist() == truth.direction.tolist()
    assert np.max(np.abs(run.contact_time.values - truth.time)) < 1e-14
    assert np.max(np.abs(run.contact_velocity.values - truth.velocity)) < 1e-12
    assert abs(run.end_x.item() - truth.end_x[0]) < 1e-14
    assert abs(run.end_v.item() - truth.end_v[0]) < 1e-12
    assert np.all(run.contact_time_error.values < 1e-13)
    for k in (1, 5, 9, 13):
        there = closed_form(rig, 1e-3, 0.05, run.time.values[k])
        assert abs(run.x.values[k] - there.end_x[0]) < 1e-14
        assert run.mode.values[k] == sides(rig, (run.x.values[k], run.v.values[k]))


def test_a_batch_whose_trajectories_differ_in_everything():
    frequencies, forces = np.array([15.0, 17.0, 9.0]), np.array([4.0, 1.5, 6.0])
    starts = {"x": np.array([1e-3, -1e-4, 0.0]), "v": np.array([0.0, 0.2, 0.0])}
    run = sl.simulate(
        linear_rig(),
        starts,
        1,
        samples=2,
        values={"frequency": frequencies, "force": forces},
        threads=2,
    )
    for i in range(3):
        alone = linear_rig(frequency=frequencies[i], force=forces[i])
        same = sl.simulate(alone, (starts["x"][i], starts["v"][i]), 1, samples=2)
        assert (run.end_x.values[i], run.end_v.values[i]) == (same.end_x.item(), same.end_v.item())
        mine = run.contact_trajectory.values == i
        assert run.contact_time.values[mine].tolist() == same.contact_time.values.tolist()


def test_nothing_changes_when_a_kernel_is_interrupted_every_few_steps(monkeypatch):
    whole = sl.simulate(linear_rig(), [(1e-3, 0.05), (0.0, 0.0)], 2, samples=3)
    monkeypatch.setattr(engine, "SLICE", 3)
    monkeypatch.setattr(engine, "RECORDS", 64)
    shares = []
    sliced = sl.simulate(
        linear_rig(), [(1e-3, 0.05), (0.0, 0.0)], 2, samples=3, progress=shares.append, threads=1
    )
    for name in (
        "x",
        "v",
        "mode",
        "contact_time",
        "contact_time_error",
        "contact_velocity",
        "steps",
        "events",
        "smallest_gap_margin",
    ):
        assert np.array_equal(whole[name].values, sliced[name].values, equal_nan=True), name
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_shallow_graze_is_two_contacts(depth):
    run = sl.simulate(thrown(1 - depth), (0.0, 2.0), t_end=1.6, samples=1)
    half = math.sqrt(depth)
    assert run.contact_direction.values.tolist() == [1, -1]
    assert np.allclose(run.contact_time.values, [1 - half, 1 + half], rtol=0, atol=4e-16 / half)
    assert run.status.item() == "ok"


def test_tangency_is_one_graze_and_a_near_miss_none():
    touching, missing = (
        sl.simulate(thrown(gap), (0.0, 2.0), t_end=1.6, samples=1) for gap in (1.0, 1 + 1e-12)
    )
    assert len(touching.contact_kind) == 1
    assert str(touching.contact_kind.values[0]) in ("graze", "graze_unresolved")
    assert abs(touching.contact_time.item() - 1) < 1e-7
    assert touching.contact_mode_before.item() == touching.contact_mode_after.item()
    assert missing.sizes["contact"] == 0
    assert math.isclose(missing.smallest_gap_margin.item(), 1e-12, rel_tol=1e-3)


@pytest.mark.parametrize(("force", "velocity"), [(2.0, 0.0), (-2.0, 0.0), (-2.0, 1.0), (2.0, -1.0)])
def test_start_on_a_boundary(force, velocity):
    """The first derivative that isn't zero decides the side; the start is no contact."""
    system = thrown(0.5, force)
    # 40 in a period of 10 s: two
    run = sl.simulate(system, (0.5, velocity), t_end=0.25, samples=40)
    assert run.sizes["contact"] == 0
    assert run.status.item() == "ok"
    after = sides(system, (0.5 + 1e-3 * (velocity or force), velocity))
    assert run.mode.values.tolist() == [after, after]


def test_rest_on_a_boundary_is_a_status():
    run = sl.simulate(thrown(0.5, 0.0), (0.5, 0.0), t_end=0.2, samples=1)
    assert run.status.item() == "resting"
    assert run.sizes["contact"] == 0
    assert run.end_x.item() == 0.5


def test_contact_exactly_at_the_end_is_reported_once():
    run = sl.simulate(thrown(0.75), (0.0, 2.0), t_end=0.5, samples=2)
    assert run.contact_time.values.tolist() == [0.5]
    after = sl.simulate(thrown(0.75), (0.75, 1.0), t_start=0.5, t_end=0.9, samples=1)
    assert after.sizes["contact"] == 0


def test_phase_is_kept_by_the_stroboscope():
    rig = linear_rig(lower_gap=1.0, upper_gap=1.0)  # never in contact: the steady state repeats
    p = rig.values
    wn, w = 2 * math.pi * p["natural_frequency"], 2 * math.pi * p["frequency"]
    motion = (
        p["force"] * (1 - 18 / w**2) / p["mass"] / (wn**2 - w**2 + 2j * p["damping_ratio"] * wn * w)
    )
    strobe = sl.stroboscope(rig, [(motion.real, (1j * w * motion).real)], 6, keep=3)
    assert strobe.period.values.tolist() == [4, 5, 6]
    assert np.max(np.abs(strobe.x.values - motion.real)) < 1e-17


# -- ends that are none ----------------------------------------------------------------------------


@pytest.mark.parametrize("method", [sl.Taylor, sl.ODE45])
def test_budgets(method):
    with pytest.warns(SaltusWarning, match="budget_steps"):
        short = sl.simulate(
            linear_rig(),
            (1e-3, 0.05),
            2,
            samples=1,
            method=method(max_steps=5),
            time_errors="local",
        )
    assert short.status.item() == "budget_steps"
    assert 5 <= short.steps.item() <= 6
    with pytest.warns(SaltusWarning, match="budget_events"):
        few = sl.simulate(
            linear_rig(),
            (1e-3, 0.05),
            2,
            samples=1,
            method=method(max_events=2),
            time_errors="local",
        )
    assert few.status.item() == "budget_events"
    assert 2 <= few.events.item() <= 3
    assert few.end_time.item() < 2 / 15


@pytest.mark.parametrize("method", [sl.Taylor(), ODE45])
def test_overflow_is_a_status_and_stays_in_its_lane(method):
    rig = sl.models.delangre("b")
    with pytest.warns(SaltusWarning, match="nonfinite"):
        run = sl.simulate(
            rig,
            {"x": [1e120, 1e-3], "v": [0.0, 0.0]},
            1,
            samples=1,
            method=method,
            time_errors="local",
        )
    assert run.status.values.tolist() == ["nonfinite", "ok"]
    alone = sl.simulate(rig, (1e-3, 0.0), 1, samples=1, method=method, time_errors="local")
    assert run.end_x.values[1] == alone.end_x.item()


# -- ode45 -----------------------------------------------------------------------------------------


def test_ode45_follows_a_parabola_to_rounding():
    """The pair is exact for it; the contact lies on its quartic, found to 128 ulp of time."""
    # 100 in a period of 10 s
    run = sl.simulate(thrown(0.75), (0.0, 2.0), t_end=1.2, samples=100, method=sl.ODE45())
    assert run.sizes["time"] == 13
    assert np.allclose(run.contact_time.values, [0.5], rtol=0, atol=128 * np.spacing(1.2))
    assert run.contact_direction.values.tolist() == [1]
    assert np.allclose(run.x.values, 2 * run.time.values - run.time.values**2, rtol=0, atol=1e-14)
    assert abs(run.end_v.item() + 0.4) < 1e-14


def test_ode45_with_location_on_the_linear_rig():
    rig = linear_rig()
    run = sl.simulate(rig, (1e-3, 0.05), 1, samples=3, method=ODE45)
    truth = closed_form(rig, 1e-3, 0.05, run.end_time.item())
    assert run.events.item() == truth.time.size
    error = np.abs(run.contact_time.values - truth.time)
    assert np.max(error) < 1e-7
    assert np.all(error <= run.contact_time_error.values)
    assert abs(run.end_x.item() - truth.end_x[0]) < 1e-8
    for k in (1, 2):
        assert (
            abs(run.x.values[k] - closed_form(rig, 1e-3, 0.05, run.time.values[k]).end_x[0]) < 1e-8
        )


def test_ode45_steps_over_contacts_if_told_to():
    rig = linear_rig()
    run = sl.simulate(
        rig, (1e-3, 0.05), 1, samples=3, method=sl.ODE45(1e-8, 1e-11, events="ignore")
    )
    truth = closed_form(rig, 1e-3, 0.05, run.end_time.item())
    assert run.sizes["contact"] == 0
    assert abs(run.end_x.item() - truth.end_x[0]) < 1e-8


def test_ode45_is_the_same_when_interrupted(monkeypatch):
    whole = sl.simulate(linear_rig(), (1e-3, 0.05), 1, samples=3, method=ODE45, time_errors="local")
    monkeypatch.setattr(engine, "SLICE", 2)
    monkeypatch.setattr(engine, "RECORDS", 4)
    sliced = sl.simulate(
        linear_rig(), (1e-3, 0.05), 1, samples=3, method=ODE45, time_errors="local"
    )
    for name in ("x", "v", "contact_time", "steps", "rejected_steps"):
        assert np.array_equal(whole[name].values, sliced[name].values), name
