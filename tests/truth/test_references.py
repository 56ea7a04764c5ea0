"""The Taylor flow against tests/reference: every row, to the digits that double precision holds.

Bounds are not tuned to what the flow happens to reach. They are either those that the package
promises (states to 1e-14 m and 1e-12 m/s, times of contacts to 1e-13 s) or follow from
:func:`rounding`.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import saltus as sl

REFERENCE = Path(__file__).parents[1] / "reference"
EPS = 2.0**-52
#: Truncation below rounding, so that rounding alone is judged; the default tolerance leaves some 64
#: times as much.
FINE = sl.Taylor(tolerance=EPS)


def rows(name):
    with (REFERENCE / f"{name}.csv").open() as file:
        return list(csv.DictReader(file))


def column(table, name):
    return np.array([row[name] for row in table], float)


def errors(values, texts):
    """|value - exact| for doubles and decimal texts, without rounding the texts first."""
    with mp.workdps(50):
        return np.array(
            [
                float(abs(mpf(float(value)) - mpf(text)))
                for value, text in zip(values, texts, strict=True)
            ]
        )


def name_of(row):
    return row.get("id") or row["name"]


# -- single runs -----------------------------------------------------------------------------------


def run_of(row, cubic):
    """A row of forced_linear.csv or runs.csv; applied_force_N there is the amplitude of the cosine
    itself.
    """
    w = 2 * np.pi * float(row["frequency_Hz"])
    rig = sl.models.delangre(
        "b",
        cubic=cubic,
        contact_stiffness=float(row["contact_stiffness_N_per_m"]),
        lower_gap=float(row["j1_m"]),
        upper_gap=float(row["j2_m"]),
        force=float(row["applied_force_N"]) / (1 - 18 / w**2),
        frequency=float(row["frequency_Hz"]),
    )
    return sl.simulate(
        rig, (float(row["x0_m"]), float(row["v0_m_per_s"])), int(row["periods"]), samples=1
    )


CASES = [(row, 0.0) for row in rows("forced_linear")] + [(row, 7e8) for row in rows("runs")]


@pytest.mark.parametrize(("row", "cubic"), CASES, ids=[row["id"] for row, _ in CASES])
def test_runs_end_where_they_should(row, cubic):
    run = run_of(row, cubic)
    times = (row.get("first_event_times_s") or row["first_event_time_s"]).split()
    assert run.status.item() == "ok"
    assert run.sizes["contact"] == int(row["events"])
    assert errors([run.end_x], [row["x_end_m"]]) < 1e-14
    assert errors([run.end_v], [row["v_end_m_per_s"]]) < 1e-12
    assert np.all(errors(run.contact_time.values[: len(times)], times) < 1e-13)


@pytest.fixture(scope="module")
def figure_2b():
    return sl.simulate(sl.models.delangre("b", frequency="7 Hz"), (0.0, 0.0), 14, samples=1), rows(
        "fig2b_exact_events"
    )


def test_all_contacts_of_figure_2b(figure_2b):
    run, table = figure_2b
    assert run.sizes["contact"] == len(table) == 63
    assert np.all(errors(run.contact_time.values, [row["t_s"] for row in table]) < 1e-13)
    assert run.contact_direction.values.tolist() == [int(row["direction"]) for row in table]
    assert run.contact_x.values.tolist() == column(table, "boundary_m").tolist()
    assert set(run.contact_kind.values) == {"crossing"}


def test_velocities_at_the_contacts_of_figure_2b(figure_2b):
    run, table = figure_2b
    exact = [row["velocity_m_per_s"] for row in table]
    assert np.max(errors(run.contact_v.values, exact)) < 1e-14
    assert np.max(errors(run.contact_velocity.values, exact)) < 1e-14


def test_contact_time_error_covers_the_error_and_is_not_absurd(figure_2b):
    run, table = figure_2b
    error = errors(run.contact_time.values, [row["t_s"] for row in table])
    claimed = run.contact_time_error.values
    assert np.max(error / claimed) <= 1
    assert np.max(claimed) < 1e-13  # the bound on the error itself
    assert np.median(claimed / np.maximum(error, np.spacing(run.contact_time.values))) < 100


# -- orbits ----------------------------------------------------------------------------------------

SAMPLES = 2000


@pytest.mark.parametrize("row", rows("orbits"), ids=name_of)
def test_orbit_returns_to_itself(row):
    rig = sl.models.delangre(
        "b",
        contact_stiffness=float(row["Kc_N_per_m"]),
        lower_gap=float(row["j1_m"]),
        upper_gap=float(row["j2_m"]),
        force=float(row["p_N"]),
        frequency=float(row["f_Hz"]),
    )
    start = float(row["x0_m"]), float(row["v0_m_per_s"])
    run = sl.simulate(rig, start, int(row["period_in_T"]), samples=SAMPLES)
    assert run.sizes["contact"] == int(row["contact_events_per_period"])
    assert errors([run.end_x], [row["x0_m"]]) < 1e-14
    assert errors([run.end_v], [row["v0_m_per_s"]]) < 1e-12
    assert np.all(errors(run.contact_time.values, row["event_times_s"].split()) < 1e-13)
    step = run.attrs["forcing_period_s"] / SAMPLES
    # an extremum between samples: |acceleration| step^2 / 8
    missed = np.max(np.abs(np.diff(run.v.values))) * step / 8 * 1.01
    assert 0 <= float(row["xmax_m"]) - run.x.values.max() + 1e-15 < missed
    assert 0 <= run.x.values.min() - float(row["xmin_m"]) + 1e-15 < missed
    rms = float(row["rms_m"])
    # trapezoid rule on a periodic function
    assert abs(np.sqrt(np.mean(run.x.values[:-1] ** 2)) - rms) < 1e-12 * rms


# -- 230 runs to 40 digits -------------------------------------------------------------------------

NUDGE = 1e-9


def case_b4():
    table = rows("rig_b4_15hz_5periods")
    return table, {}


def random_rigs():
    table = rows("rig_random_5periods")
    return table, {name: column(table, name) for name in list(table[0])[:9]}


RIGS = {"b4": case_b4, "random": random_rigs}


def simulate(table, values, method, nudge=(0.0, 0.0)):
    start = {"x": column(table, "x0_m") + nudge[0], "v": column(table, "v0_m_per_s") + nudge[1]}
    return sl.simulate(sl.models.delangre("b"), start, 5, values=values, samples=50, method=method)


@pytest.fixture(scope="module", params=RIGS)
def rigs(request):
    """Table, values, and the sensitivity d(end x, end v)/d(start x, start v) of every row, (rows,
    2, 2).
    """
    table, values = RIGS[request.param]()
    columns = []
    for nudge in ((NUDGE, 0.0), (0.0, 100 * NUDGE)):
        high, low = (simulate(table, values, FINE, np.array(nudge) * sign) for sign in (1, -1))
        change = np.stack([high.end_x - low.end_x, high.end_v - low.end_v], axis=1)
        columns.append(change / (2 * max(nudge)))
    return table, values, np.stack(columns, axis=2)


def rounding(run, sensitivity, tolerance):
    """Bound of the error of the end state, (rows, 2).

    Every step leaves each state wrong by at most ``tolerance`` (what its last terms are cut to) and
    half an ulp in each of a handful of operations, relative to the state's range: taken as
    ``tolerance + eps``. Every such error grows by what an error at the start grows by, or not at
    all if that is larger: a contact amplifies what came before it as much as what was there at the
    start.
    """
    size = np.stack([np.abs(run[name].values).max(axis=1) for name in "xv"], axis=1)
    grown = np.einsum("tij,tj->ti", np.abs(sensitivity), size)
    return run.steps.values[:, None] * (tolerance + EPS) * np.maximum(grown, size)


def end_errors(run, table):
    return np.stack(
        [
            errors(run.end_x.values, [r["x_end_m"] for r in table]),
            errors(run.end_v.values, [r["v_end_m_per_s"] for r in table]),
        ],
        1,
    )


def test_sensitivities_are_those_of_the_reference(rigs):
    table, _, sensitivity = rigs
    # not at rest on a boundary
    away = np.array(
        [row["v0_m_per_s"] != "0.0" or row["x0_m"] not in ("0.0", "0.0004") for row in table]
    )
    for j, name in enumerate(("dxend_dx0", "dxend_dv0_s")):
        exact = column(table, name)
        scale = np.abs(sensitivity[:, 0, j]) + np.median(np.abs(exact))
        assert np.all(np.abs(sensitivity[away, 0, j] - exact[away]) < 1e-3 * scale[away])


@pytest.mark.parametrize("method", [sl.Taylor(), FINE], ids=["default", "fine"])
def test_end_states_err_by_rounding_only(rigs, method):
    table, values, sensitivity = rigs
    run = simulate(table, values, method)
    assert set(run.status.values) == {"ok"}
    assert run.mode_violations.sum() == 0
    error = end_errors(run, table)
    assert np.max(error / rounding(run, sensitivity, method.tolerance)) < 1
    assert np.max(error[:, 0]) < 1e-14
    assert np.max(error[:, 1]) < 1e-11


def test_the_bound_can_fail(rigs):
    table, values, sensitivity = rigs
    run = simulate(table, values, FINE, nudge=(3e-15, 0.0))
    assert np.any(end_errors(run, table) > rounding(run, sensitivity, EPS))


@pytest.mark.parametrize("method", [sl.Taylor(), FINE], ids=["default", "fine"])
def test_every_contact_is_there_and_its_time_is_as_exact_as_it_says(rigs, method):
    table, values, sensitivity = rigs
    run = simulate(table, values, method)
    assert (
        np.bincount(run.contact_trajectory.values, minlength=len(table)).tolist()
        == column(table, "contacts").astype(int).tolist()
    )
    exact = [text for row in table for text in row["contact_times_s"].split()]
    error, claimed = errors(run.contact_time.values, exact), run.contact_time_error.values
    assert np.max(error) < 1e-13
    speed = np.abs(run.contact_velocity.values)
    # by what the steps before left
    carried = rounding(run, sensitivity, method.tolerance)[run.contact_trajectory.values, 0] / speed
    # only there is it more than a claim from two runs, which round alike, shows
    slow = speed < 0.01
    assert np.all(error[~slow] <= claimed[~slow])
    assert np.all(error[slow] <= claimed[slow] + carried[slow])
    assert np.median(claimed / np.maximum(error, np.spacing(run.contact_time.values))) < 100


@pytest.mark.parametrize(("rig", "number"), [("b4", 128), ("b4", 129), ("b4", 131), ("random", 48)])
def test_smallest_gap_margin_is_where_the_motion_turned_back(rig, number):
    """Rows whose margin is the gap left at a turning point (in the others it is the depth of a
    contact).
    """
    table, values = RIGS[rig]()
    margin = simulate(table, values, sl.Taylor()).smallest_gap_margin.values[number]
    assert np.isclose(margin, float(table[number]["margin_m"]), rtol=0.05, atol=0)


def test_smallest_gap_margin_is_infinite_where_the_motion_never_turned_back():
    table, values = RIGS["b4"]()
    # fast starts: straight through
    assert np.all(np.isinf(simulate(table, values, sl.Taylor()).smallest_gap_margin.values[:64]))
