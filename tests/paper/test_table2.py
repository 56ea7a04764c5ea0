"""Table 2 and Fig. 2(b) of Saunders et al. (2021) through the public interface."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import saltus as sl

REFERENCE = Path(__file__).parents[1] / "reference"
#: Accepted steps of the first thirteen legs.
STEPS = [6, 5, 3, 8, 3, 8, 3, 9, 3, 7, 5, 7, 3]


def table(name):
    with open(REFERENCE / f"{name}.csv") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def runs():
    rig = sl.models.delangre("b", force="4 N", frequency="7 Hz")
    return {
        "ode45": sl.simulate(
            rig, start=(0.0, 0.0), t_end=2.0, method=sl.ODE45(rtol=1e-4, atol=1e-7)
        ),
        "taylor": sl.simulate(rig, start=(0.0, 0.0), t_end=2.0),
    }


@pytest.mark.parametrize("row", table("table2"), ids=lambda row: row["marker"])
def test_the_printed_times_and_residuals(runs, row):
    run, event = runs["ode45"], int(row["event_number"]) - 1
    assert abs(run.contact_time.values[event] - float(row["time_s"])) < 2e-14
    assert abs(run.contact_x.values[event] - float(row["boundary_m"])) < 2e-16


def test_the_residual_at_a_has_all_printed_digits(runs):
    assert f"{runs['ode45'].contact_x.values[0] - 0.4e-3:.10e}" == "5.1499603193e-18"


def test_steps_of_every_leg(runs):
    assert list(np.diff(runs["ode45"].contact_steps.values, prepend=0)[:13]) == STEPS


@pytest.mark.parametrize("method", ["ode45", "taylor"])
def test_the_error_estimate_covers_the_true_error_of_all_63_contacts(runs, method):
    run = runs[method]
    exact = np.array([float(row["t_s"]) for row in table("fig2b_exact_events")])
    assert run.sizes["contact"] == len(exact) == 63
    true = np.abs(run.contact_time.values - exact)
    assert (true <= run.contact_time_error.values).all()
    # honest, not merely large: eight times what copies differ by
    assert run.contact_time_error.values.max() < 20 * true.max()
    if method == "taylor":
        assert true.max() < 1e-13
    else:
        assert true.max() > 2e-5  # what a residual of 1e-16 m hides
