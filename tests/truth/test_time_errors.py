"""`contact_time_error` against contact times to 22 digits of stiff two-mass systems and a chaotic
circuit, where roundings grow most.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

import saltus as sl
from conformance.systems import circuit, two_masses

with (Path(__file__).parents[1] / "reference" / "grown_contacts.csv").open() as file:
    ROWS = list(csv.DictReader(file))
SYSTEMS = {"two_masses": two_masses, "circuit": circuit}


def run_of(row, **options):
    system = SYSTEMS[row["system"]]
    values = dict(zip(system.values, map(float, row["values"].split()), strict=True))
    span = {"periods": 12} if system.forced_at else {"t_end": 30.0}
    start = [float(value) for value in row["start"].split()]
    return sl.simulate(
        system, start, values=values, samples=1, **span, **{"method": sl.Taylor(lanes=2), **options}
    )


def errors(run, row):
    """Errors of the contact times [s], and what is claimed for them, up to where the sequence of
    contacts is another.
    """
    guards = [str(name) for name in run.guard.values]
    exact = row["contact_times_s"].split()
    count = min(len(exact), run.sizes["contact"])
    ours = np.array([guards.index(name) for name in run.contact_guard.values[:count].tolist()])
    differ = ours != np.array([int(i) for i in row["guards"].split()[:count]])
    count = int(np.argmax(differ)) if differ.any() else count
    with mp.workdps(40):
        error = np.array(
            [
                float(abs(mpf(float(t)) - mpf(e)))
                for t, e in zip(run.contact_time.values[:count], exact[:count], strict=True)
            ]
        )
    return error, run.contact_time_error.values[:count]


@pytest.fixture(scope="module")
def runs():
    return {row["id"]: (run_of(row), row) for row in ROWS}


@pytest.mark.parametrize("name", [row["id"] for row in ROWS])
def test_time_errors_cover_roundings_that_have_grown(runs, name):
    """Every contact lies within its estimate, and most estimates are finite."""
    error, claimed = errors(*runs[name])
    assert len(error) > 20
    assert np.all(error <= claimed)
    assert np.isfinite(claimed).sum() > 0.5 * len(error)


def test_time_errors_are_not_merely_large(runs):
    """Estimates are some 60 times the error (or an ulp); in one trajectory the ratio is made by
    chance, so all are asked together.
    """
    ratios = []
    for run, row in runs.values():
        error, claimed = errors(run, row)
        known = np.isfinite(claimed)
        ratios.append(
            np.median(
                (claimed / np.maximum(error, np.spacing(run.contact_time.values[: len(error)])))[
                    known
                ]
            )
        )
    assert np.exp(np.mean(np.log(ratios))) < 200


def test_a_step_alone_does_not_tell():
    """The same with the error of the last step only: exceeded hundreds of times, so the test above
    can fail.
    """
    error, claimed = errors(run_of(ROWS[0], time_errors="local"), ROWS[0])
    assert np.max(error / claimed) > 100


def test_estimates_do_not_depend_on_neighbours():
    """Twenty trajectories, whose copies run one batch after the other, and one alone, whose copies
    share a batch: the same to the bit.
    """
    row = ROWS[-1]
    alone = run_of(row)
    values = dict(zip(circuit.values, map(float, row["values"].split()), strict=True))
    start = np.array([[float(value) for value in row["start"].split()]] * 20)
    start[1:, 0] += np.linspace(0.01, 0.2, 19)
    run = sl.simulate(
        circuit, start, values=values, t_end=30.0, samples=1, method=sl.Taylor(lanes=2)
    )
    first = run.contact_trajectory.values == 0
    assert (
        run.contact_time_error.values[first].tobytes() == alone.contact_time_error.values.tobytes()
    )
