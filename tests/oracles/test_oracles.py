"""The oracles against each other, against formulas and against the reference data. None of this
touches the package.
"""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.linalg import expm

from oracles import generate_reference, high_precision, piecewise_linear
from oracles.verdict import compare

REFERENCE = Path(__file__).parents[1] / "reference"
RIG = {
    "mass": 3.0,
    "damping_ratio": 0.03,
    "natural_frequency": 5.0,
    "cubic": 7e8,
    "contact_stiffness": 1.4e4,
}
LINEAR = {**RIG, "cubic": 0.0}


def rows(name):
    with (REFERENCE / f"{name}.csv").open() as file:
        return list(csv.DictReader(file))


def numbers(text):
    return np.array(text.split(), float)


def worst(values, reference):
    with mp.workdps(50):
        return float(max(abs(a - mpf(b)) for a, b in zip(values, reference, strict=True)))


def run_row(row):
    """Parameters of a row of forced_linear.csv or runs.csv; the force there is the amplitude
    itself.
    """
    return {
        "contact_stiffness": row["contact_stiffness_N_per_m"],
        "lower_gap": row["j1_m"],
        "upper_gap": row["j2_m"],
        "drive": row["applied_force_N"],
        "frequency": row["frequency_Hz"],
    }


def floats(parameters):
    return {key: float(value) for key, value in parameters.items()}


# --- closed form of piecewise-linear arcs ---------------------------------------------------------


@pytest.mark.parametrize("row", rows("forced_linear"), ids=lambda row: row["id"])
@pytest.mark.slow
def test_closed_form_and_40_digits_give_the_forced_linear_runs(row):
    parameters = {**LINEAR, **run_row(row)}
    exact = high_precision.simulate(
        {**parameters, "damping_ratio": "0.03"}, row["x0_m"], row["v0_m_per_s"], int(row["periods"])
    )
    assert len(exact.times) == int(row["events"])
    assert worst([exact.x, exact.v], [row["x_end_m"], row["v_end_m_per_s"]]) < 1e-20
    assert worst(exact.times[:3], row["first_event_times_s"].split()) < 4e-20
    end = float(row["periods"]) / float(row["frequency_Hz"])
    closed = piecewise_linear.contacts(
        floats(parameters), float(row["x0_m"]), float(row["v0_m_per_s"]), end
    )
    assert closed.guard.tolist() == exact.guards
    assert np.all(np.abs(closed.time - np.array(exact.times, float)) < 5 * closed.time_error)
    assert abs(closed.end_x[0] - float(row["x_end_m"])) < 1e-16
    assert abs(closed.end_v[0] - float(row["v_end_m_per_s"])) < 1e-15


@pytest.mark.slow
def test_closed_form_knows_its_own_rounding():
    parameters, x, v, end = piecewise_linear.random_cases(12, seed=3)
    closed = piecewise_linear.contacts(parameters, x, v, end)
    for i in np.flatnonzero(closed.count < 60)[:3]:
        one = {key: float(values[i]) for key, values in parameters.items()}
        exact = high_precision.simulate({**one, "cubic": 0.0}, float(x[i]), float(v[i]), 10)
        mine = closed.of(i)
        assert closed.guard[mine].tolist() == exact.guards
        assert np.all(
            np.abs(closed.time[mine] - np.array(exact.times, float)) < 6 * closed.time_error[mine]
        )
        assert (
            np.sign(np.array(exact.velocities, float)).tolist() == closed.direction[mine].tolist()
        )
        assert abs(float(exact.margin) - closed.margin[i]) < 1e-3 * closed.margin[i]


@pytest.mark.nightly
def test_compiled_closed_form_is_the_plain_one():
    """Only the nightly million of contacts uses it."""
    case = piecewise_linear.random_cases(20, seed=5)
    plain, compiled = (
        piecewise_linear.contacts(*case, compiled=compiled) for compiled in (False, True)
    )
    assert plain.count.tolist() == compiled.count.tolist()
    assert np.all(np.abs(plain.time - compiled.time) < 12 * plain.time_error)


@pytest.mark.parametrize(
    ("amplitude", "period"), [(0.5e-3, 0.16589082306112917), (1e-3, 0.10930388037521438)]
)
def test_free_vibration_in_a_symmetric_clearance(amplitude, period):
    still = {
        **LINEAR,
        "damping_ratio": 0.0,
        "lower_gap": 0.4e-3,
        "upper_gap": 0.4e-3,
        "drive": 0.0,
        "frequency": 1.0,
    }
    found = piecewise_linear.contacts(still, amplitude, 0.0, 10.5 * period)
    assert np.diff(found.time)[3::4].size >= 9
    assert abs((found.time[40] - found.time[0]) / 10 - period) < 1e-15


@pytest.mark.parametrize(
    ("stiffness", "hertz", "tolerance"),
    [
        (1.4e4, 7.0530955250738664, 1e-13),
        (7e4, 8.3232818492544424, 1e-13),
        (1.4e10, 9.9954032936792037, 1e-9),
    ],
)
def test_bilinear_frequency(stiffness, hertz, tolerance):
    one_sided = {
        **LINEAR,
        "damping_ratio": 0.0,
        "contact_stiffness": stiffness,
        "lower_gap": 1.0,
        "upper_gap": 0.0,
        "drive": 0.0,
        "frequency": 1.0,
    }
    found = piecewise_linear.contacts(one_sided, -1e-3, 0.0, 20.6 / hertz)
    assert abs(20 / (found.time[40] - found.time[0]) - hertz) < tolerance


def test_shallow_excursions_are_two_contacts_and_near_misses_none():
    free = {**LINEAR, "damping_ratio": 0.0, "lower_gap": 1.0, "drive": 0.0, "frequency": 1.0}
    for depth in (1e-5, 1e-8, 1e-11, 1e-13):
        touching = piecewise_linear.contacts({**free, "upper_gap": 1e-3 - depth}, -1e-3, 0.0, 0.19)
        missing = piecewise_linear.contacts({**free, "upper_gap": 1e-3 + depth}, -1e-3, 0.0, 0.19)
        assert (touching.count[0], missing.count[0]) == (2, 0)
        assert abs(missing.margin[0] - depth) < 1e-17
        assert touching.margin[0] < 1.01 * depth
    tangent = piecewise_linear.contacts({**free, "upper_gap": 1e-3}, -1e-3, 0.0, 0.19)
    assert tangent.status.tolist() == [piecewise_linear.UNDECIDED]


def test_verdict_sees_a_missed_and_an_invented_contact():
    case = piecewise_linear.random_cases(30, seed=8)
    truth = piecewise_linear.contacts(*case)
    same = compare(truth, truth.trajectory, truth.time, truth.guard)
    assert (same.missed, same.invented, same.worst, same.compared + same.left_out) == (
        [],
        [],
        0.0,
        truth.time.size,
    )
    k = truth.of(7)[3]
    without = np.delete(np.arange(truth.time.size), k)
    assert compare(
        truth, truth.trajectory[without], truth.time[without], truth.guard[without]
    ).missed == [7]
    between = 0.5 * (truth.time[k - 1] + truth.time[k])
    more = [
        np.insert(column, k, value)
        for column, value in ((truth.trajectory, 7), (truth.time, between), (truth.guard, 1))
    ]
    assert compare(truth, *more).invented == [7]
    later = dataclasses.replace(truth, time=truth.time * (1 + 3e-12))
    assert 0.5 < compare(truth, later.trajectory, later.time, later.guard).worst <= 3.001


# --- 40 digits ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_40_digits_give_all_contacts_of_figure_2b():
    b4 = {
        **RIG,
        "damping_ratio": "0.03",
        "lower_gap": 0.0,
        "upper_gap": "0.0004",
        "force": 4,
        "frequency": 7,
    }
    exact = high_precision.simulate(b4, 0, 0, 14)
    table = rows("fig2b_exact_events")
    assert worst(exact.times, [row["t_s"] for row in table]) < 1e-20
    assert worst(exact.velocities, [row["velocity_m_per_s"] for row in table]) < 1e-17
    assert [1 if v > 0 else -1 for v in exact.velocities] == [
        int(row["direction"]) for row in table
    ]


@pytest.mark.slow
def test_40_digits_hold_when_the_order_changes():
    exact = [
        high_precision.simulate(generate_reference.B4, 1e-3, 0.0, 3, order=order)
        for order in (48, 60)
    ]
    assert worst([exact[0].x, *exact[0].times], [exact[1].x, *exact[1].times]) < 1e-40


@pytest.mark.slow
def test_40_digits_give_the_run_of_the_full_rig():
    row = rows("runs")[0]
    exact = high_precision.simulate(
        {**RIG, **run_row(row)}, row["x0_m"], row["v0_m_per_s"], int(row["periods"])
    )
    assert len(exact.times) == int(row["events"])
    assert abs(float(exact.x) - float(row["x_end_m"])) < 6e-16
    assert abs(float(exact.v) - float(row["v_end_m_per_s"])) < 1e-15 / 0.01
    assert abs(float(exact.times[0]) - float(row["first_event_time_s"])) < 1e-16


@pytest.mark.slow
def test_40_digits_close_the_doubling_of_case_b():
    """Row G07 of branches_rig.csv: R = 0 and det(M + I) = 0, M by central differences."""
    (row,) = (row for row in rows("branches_rig") if row["id"] == "G07")
    words = dict(word.split("=") for word in row["check"].partition(";")[0].split()[1:])
    with mp.workdps(50):
        x, v, frequency = mpf(words["x0"]), mpf(words["v0"]), row["value"]
        parameters = {
            "mass": 3, "damping_ratio": "0.03", "natural_frequency": 5, "cubic": "7e8",
            "contact_stiffness": 14000, "lower_gap": 0, "upper_gap": "0.0004", "force": 4,
            "frequency": frequency,
        }  # fmt: skip

        def end(dx, dv):
            run = high_precision.simulate(parameters, x + dx, v + dv, 1)
            return np.array([run.x, run.v])

        assert np.all(np.abs(end(0, 0) - [x, v]) < mpf("1e-19"))
        dx, dv = mpf("1e-17"), mpf("1e-15")
        by_x = (end(dx, 0) - end(-dx, 0)) / (2 * dx)
        by_v = (end(0, dv) - end(0, -dv)) / (2 * dv)
        # an error of 1e-12 in the frequency would make it 1e-10
        assert abs((by_x[0] + 1) * (by_v[1] + 1) - by_x[1] * by_v[0]) < mpf("1e-16")


@pytest.mark.parametrize("number", [5, 70, 128])
@pytest.mark.slow
def test_reference_file_is_what_the_generator_makes(number):
    row = rows("rig_b4_15hz_5periods")[number]
    _, x, v = generate_reference.starts()[number]
    assert (repr(x), repr(v)) == (row["x0_m"], row["v0_m_per_s"])
    exact = high_precision.simulate(generate_reference.B4, x, v, generate_reference.PERIODS)
    assert worst([exact.x, exact.v], [row["x_end_m"], row["v_end_m_per_s"]]) < 1e-30
    assert len(exact.times) == int(row["contacts"])


# --- heyoka ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def systems():
    pytest.importorskip("heyoka", reason="extra `reference` isn't installed")
    from oracles import heyoka_systems

    return heyoka_systems


def on_boundary_at_rest(row):
    return float(row["v0_m_per_s"]) == 0.0 and float(row["x0_m"]) in (0.0, 0.4e-3)


@pytest.mark.slow
def test_heyoka_agrees_with_40_digits_on_case_b(systems):
    for row in rows("rig_b4_15hz_5periods"):
        if on_boundary_at_rest(row):
            continue
        run = systems.simulate(
            "delangre",
            generate_reference.B4,
            (float(row["x0_m"]), float(row["v0_m_per_s"])),
            5 / 15,
        )
        assert run.times.size == int(row["contacts"])
        assert abs(run.end[0] - float(row["x_end_m"])) < 1e-15
        assert np.all(np.abs(run.times - numbers(row["contact_times_s"])) < 1e-14)


def test_heyoka_agrees_with_40_digits_on_random_rigs(systems):
    for row in rows("rig_random_5periods"):
        parameters = {key: float(row[key]) for key in systems.SYSTEMS["delangre"].parameters}
        run = systems.simulate(
            "delangre",
            parameters,
            (float(row["x0_m"]), float(row["v0_m_per_s"])),
            5 / parameters["frequency"],
        )
        assert run.times.size == int(row["contacts"])
        assert abs(run.end[0] - float(row["x_end_m"])) < 1e-13
        assert np.all(np.abs(run.times - numbers(row["contact_times_s"])) < 1e-12)


@pytest.mark.parametrize("row", rows("orbits"), ids=lambda row: row["name"])
def test_orbits_close(systems, row):
    parameters = {
        **RIG,
        "contact_stiffness": float(row["Kc_N_per_m"]),
        "lower_gap": float(row["j1_m"]),
        "upper_gap": float(row["j2_m"]),
        "force": float(row["p_N"]),
        "frequency": float(row["f_Hz"]),
    }
    start = float(row["x0_m"]), float(row["v0_m_per_s"])
    run = systems.simulate(
        "delangre", parameters, start, int(row["period_in_T"]) / parameters["frequency"]
    )
    assert run.times.size == int(row["contact_events_per_period"])
    assert np.all(np.abs(run.times - numbers(row["event_times_s"])) < 3e-15)
    assert abs(run.end[0] - start[0]) < 1e-15
    assert abs(run.end[1] - start[1]) < 1e-13


CHAIN = {
    "first_mass": 1.0,
    "second_mass": 0.5,
    "ground_stiffness": 1e3,
    "coupling_stiffness": 400.0,
    "ground_damping": 0.6,
    "coupling_damping": 0.3,
    "ground_contact_stiffness": 2e4,
    "ground_gap": 1e-3,
    "coupling_contact_stiffness": 1e4,
    "coupling_gap": 0.5e-3,
    "force": 3.0,
    "frequency": 8.0,
}
GEARS = {
    "mesh_mass": 0.25,
    "damping_ratio": 0.05,
    "mesh_stiffness": 4e8,
    "stiffness_variation": 0.2,
    "gap": 20e-6,
    "mean_force": 800.0,
    "alternating_force": 400.0,
    "mesh_frequency": 4e3,
}
SECTION = {
    "airspeed": 12.0,
    "mass": 12.4,
    "inertia": 0.065,
    "imbalance": 0.25,
    "half_chord": 0.135,
    "elastic_axis": -0.6,
    "plunge_stiffness": 2840.0,
    "pitch_stiffness": 40.0,
    "pitch_gap": 0.01,
    "plunge_damping": 27.4,
    "pitch_damping": 0.036,
    "air_density": 1.225,
    "lift_slope": 6.28,
}


def test_chain_without_coupling_is_the_closed_form(systems):
    apart = {
        **CHAIN,
        "coupling_stiffness": 0.0,
        "coupling_damping": 0.0,
        "coupling_contact_stiffness": 0.0,
    }
    run = systems.simulate("chain", apart, (0.3e-3, 0.0, 0.02, 0.1), 1.0)
    natural = np.sqrt(1e3)
    oscillator = {
        "mass": 1.0,
        "damping_ratio": 0.6 / (2 * natural),
        "natural_frequency": natural / (2 * np.pi),
        "contact_stiffness": 2e4,
        "lower_gap": 1e-3,
        "upper_gap": 1e-3,
        "drive": 3.0,
        "frequency": 8.0,
    }
    closed = piecewise_linear.contacts(oscillator, 0.3e-3, 0.02, 1.0)
    ground = run.clearances == 0
    assert np.count_nonzero(ground) == closed.time.size > 20
    assert np.all(np.abs(run.times[ground] - closed.time) < 1e-14 + 20 * closed.time_error)
    assert abs(run.end[0] - closed.end_x[0]) < 1e-16 + 20 * closed.end_x_error[0]


def test_chain_against_the_two_mass_matrix_exponential(systems):
    m, c, k = (
        np.diag([1.0, 0.5]),
        np.array([[0.9, -0.3], [-0.3, 0.3]]),
        np.array([[1400.0, -400.0], [-400.0, 400.0]]),
    )
    w = 16 * np.pi
    matrix = np.zeros((6, 6))  # x, v and the forcing as a rotating pair
    matrix[:2, 2:4] = np.eye(2)
    matrix[2:4, :2], matrix[2:4, 2:4] = -np.linalg.solve(m, k), -np.linalg.solve(m, c)
    matrix[2, 4], matrix[4, 5], matrix[5, 4] = 3.0, -w, w
    start = np.array([0.3e-3, -0.2e-3, 0.02, 0.1])
    run = systems.simulate("chain", {**CHAIN, "ground_gap": 1.0, "coupling_gap": 1.0}, start, 0.7)
    assert run.times.size == 0
    assert np.allclose(
        run.end, (expm(0.7 * matrix) @ np.r_[start, 1.0, 0.0])[:4], rtol=0, atol=1e-13
    )


def test_gears_in_mesh_rest_where_the_mean_force_puts_them_and_fly_apart_freely(systems):
    quiet = {**GEARS, "alternating_force": 0.0, "stiffness_variation": 0.0}
    rest = systems.simulate("gear_pair", quiet, (22e-6, 0.0), 0.01)
    assert np.allclose(rest.end, (22e-6, 0.0), rtol=0, atol=1e-15)
    damping = 2 * 0.05 * np.sqrt(4e8 * 0.25)
    free = systems.simulate("gear_pair", {**quiet, "gap": 1.0}, (0.0, 0.0), 1e-4)
    assert abs(free.end[1] - 800 / damping * -np.expm1(-damping * 1e-4 / 0.25)) < 1e-14


def test_section_inside_its_freeplay_is_a_matrix_exponential(systems):
    b, a, speed = 0.135, -0.6, 12.0
    lift = 1.225 * speed**2 * b * 6.28 * np.array([0.0, 1.0, 1 / speed, (0.5 - a) * b / speed])
    mass = np.array([[12.4, 12.4 * 0.25 * b], [12.4 * 0.25 * b, 0.065]])
    loads = np.array(
        [-lift - [2840.0, 0.0, 27.4, 0.0], (0.5 + a) * b * lift - [0.0, 0.0, 0.0, 0.036]]
    )
    matrix = np.vstack([np.eye(4)[2:], np.linalg.solve(mass, loads)])
    start = np.array([1e-3, 0.0, 0.0, 0.01])
    run = systems.simulate("aeroelastic", {**SECTION, "pitch_gap": 100.0}, start, 0.3)
    assert np.allclose(run.end, expm(0.3 * matrix) @ start, rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("name", "parameters", "start", "end"),
    [
        ("chain", CHAIN, (0.3e-3, -0.2e-3, 0.02, 0.1), 8 / 8.0),
        ("gear_pair", GEARS, (0.0, 0.1), 50 / 4e3),
        ("aeroelastic", SECTION, (0.01, 0.0, 0.0, 0.5), 5.0),
    ],
)
@pytest.mark.slow
def test_heyoka_holds_when_its_tolerance_changes(systems, name, parameters, start, end):
    fine, coarse = (
        systems.simulate(name, parameters, start, end, tolerance=tolerance)
        for tolerance in (1e-16, 1e-13)
    )
    assert fine.times.size == coarse.times.size > 70
    assert np.all(fine.sides == coarse.sides)
    assert np.allclose(fine.times, coarse.times, rtol=0, atol=1e-11)
    assert np.allclose(fine.end, coarse.end, rtol=1e-9, atol=1e-13)
    assert fine.margin > 1e-9


def test_an_event_that_starts_at_zero_loses_its_next_root_in_heyoka():
    """Why arcs begin one floating-point number inside their mode. If this fails, heyoka was
    repaired and the step may go.
    """
    hy = pytest.importorskip("heyoka")
    x, v = hy.make_vars("x", "v")
    found = []
    for start in (0.0, -5e-324):
        event = hy.t_event(x, direction=hy.event_direction.positive, cooldown=0.0)
        integrator = hy.taylor_adaptive([(x, v), (v, 1.0 - x)], [start, -0.1], t_events=[event])
        integrator.step(0.5)
        found.append(integrator.time)
    assert found[0] == 0.5
    assert abs(found[1] - 2 * np.arctan(0.1)) < 1e-15
