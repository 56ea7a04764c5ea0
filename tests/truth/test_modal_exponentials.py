"""Structures of three modes with two stops over two hundred contacts, against exponentials of their
matrices to 50 digits.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl

mp = pytest.importorskip("mpmath").mp

from oracles.exact_contacts import check_contacts, exact_record  # noqa: E402

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = np.array([[900.0, -400.0, 0.0], [-400.0, 800.0, -300.0], [0.0, -300.0, 500.0]])
#: Held by stops alone: it has a rigid-body mode.
FREE = np.array([[400.0, -400.0, 0.0], [-400.0, 700.0, -300.0], [0.0, -300.0, 300.0]])
FIRST, GAP = {"at": "x1", "side": "both", "gap": 0.004}, {"at": "x3", "gap": 0.006}
SOFT = {"stiffness": 2e3}
TIMES = np.linspace(0.0, 60.0, 241)
HEIGHTS = np.random.default_rng(20261127).normal(0, 9, 241)


def made(
    *, stiffness=STIFFNESS, ratio=0.02, first=SOFT, second=SOFT, w=11.0, force=12.0, record=None
):
    """A structure that is driven at its second mass; by a record, at its third."""
    forces = [] if force is None else [
        sl.Force("x2", force, phase=0.4), sl.Force("x3", 2.0, harmonic=2)
    ]  # fmt: skip
    if record is not None:
        forces.append(sl.Force("x3", sl.recorded(TIMES, HEIGHTS, "N", kind=record)))
    return sl.structure(
        MASS, stiffness, damping_ratio=ratio, modes=3, forces=forces,
        contacts=[sl.Contact(**FIRST | first, name="first"), sl.Contact(**GAP | second)],
        frequency=None if force is None else w / (2 * np.pi),
    )  # fmt: skip


def own_rate(stiffness=STIFFNESS, touching=0.0):
    """The lowest angular frequency, with a spring where the first mass touches."""
    whole = stiffness + np.diag([touching, 0.0, 0.0])
    root = np.sqrt(MASS.diagonal())
    return float(np.sqrt(np.linalg.eigvalsh(whole / np.outer(root, root))[0]))


CASES = {
    "soft": {},
    "undamped": {"ratio": 0.0},
    "stiff": {"first": {"stiffness": 1e9}, "second": {"stiffness": 1e7}},
    "critical": {"ratio": 1.0, "force": 300.0},
    "overdamped": {"ratio": [5.0, 1.0, 0.3], "force": 300.0},
    "critical in a stop": {"first": {"stiffness": 3e4, "damping": 2 * 3e4**0.5}},
    "a rigid body": {"stiffness": FREE, "ratio": 0.01},
    "exact resonance": {"ratio": 0.0, "w": own_rate(), "force": 2.0},
    "resonance in a stop": {"ratio": 0.0, "w": own_rate(touching=2e3), "force": 3.0},
    "a spline": {"record": "spline", "force": None, "ratio": 0.005},
    "a linear record": {"record": "linear", "force": None, "ratio": 0.005},
    "a record beside harmonics": {"record": "spline", "ratio": 0.3},
}


def check(case, most):
    """Compare so many contacts of a case."""
    given = CASES[case]
    courses = [exact_record(TIMES, HEIGHTS, given["record"])] if "record" in given else []
    system, start = made(**given), np.zeros(6)
    run = sl.simulate(
        system, start, t_end=60.0, method=sl.Modal(), progress=False, time_errors="local"
    )
    assert run.attrs["method"] == "Modal"
    period = 2 * np.pi / 11.0
    assert check_contacts(system, start, run, most, 1e-12 * period, courses, afresh=True) == most


@pytest.mark.slow
@pytest.mark.parametrize("case", ["soft", "critical in a stop", "resonance in a stop", "a spline"])
def test_contacts_are_those_of_exponentials_to_50_digits(case):
    check(case, 30)


@pytest.mark.nightly
@pytest.mark.parametrize("case", CASES)
def test_two_hundred_contacts_are_those_of_exponentials_to_50_digits(case):
    check(case, 200)
