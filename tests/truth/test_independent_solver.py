"""Three systems that are not the rig, against heyoka: a chain with two clearances, a gear pair, a
wing section with freeplay.

heyoka runs from equations written by hand for it (oracles/heyoka_systems.py), one smooth field for
each mode, its events terminal. Its own error is measured by a run at a tolerance of 1e-13: the two
of them differ by at most 2e-14 s in a contact's time and 1e-13 of the range of a state. Agreement
is asked for to ten times that.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl

TIME, SHARE = 2e-14, 1e-13

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
GEARS = {"mesh_frequency": 4e3}
#: system, start, span, contacts. The model's own values where none are given.
CASES = {
    "chain": (sl.models.chain(**CHAIN), (0.3e-3, -0.2e-3, 0.02, 0.1), {"periods": 4}, 44),
    "gear_pair": (sl.models.gear_pair(**GEARS), (0.0, 0.1), {"periods": 50}, 100),
    "aeroelastic": (sl.models.aeroelastic(), (0.01, 0.0, 0.0, 0.5), {"t_end": 5.0}, 77),
}


@pytest.fixture(scope="module", params=CASES)
def pair(request):
    """System, our run, heyoka's at its finest tolerance, heyoka's at 1e-13."""
    pytest.importorskip("heyoka", reason="extra `reference` isn't installed")
    # here, since only one of the processes that collect these tests runs them
    from oracles import heyoka_systems

    system, start, span, contacts = CASES[request.param]
    run = sl.simulate(system, start, **span, samples=50)
    oracles = [
        heyoka_systems.simulate(
            request.param, dict(system.values), start, run.end_time.item(), tolerance=tolerance
        )
        for tolerance in (1e-16, 1e-13)
    ]
    assert oracles[0].times.size == contacts
    return system, run, *oracles


def boundaries(run):
    """Clearance and side of every contact, read off the guards' names: 'x2 - x1 = -coupling_gap' is
    the low side of the coupling.
    """
    names = [str(name) for name in run.contact_guard.values]
    return [int("x2 - x1" in name) for name in names], [
        -1 if "= -" in name else 1 for name in names
    ]


def test_heyoka_is_as_exact_as_we_say(pair):
    _, run, fine, coarse = pair
    assert np.max(np.abs(fine.times - coarse.times)) < TIME
    assert np.all(np.abs(fine.end - coarse.end) < SHARE * ranges(run))


def ranges(run):
    return np.array([np.abs(run[name].values).max() for name in run.attrs["states"].split()])


def test_same_contacts_in_the_same_order(pair):
    _, run, fine, _ = pair
    assert run.status.item() == "ok"
    clearances, sides = boundaries(run)
    assert (clearances, sides) == (fine.clearances.tolist(), fine.sides.tolist())
    assert run.contact_direction.values.tolist() == fine.directions.tolist()
    assert set(run.contact_kind.values) == {"crossing"}


def test_same_times(pair):
    _, run, fine, _ = pair
    difference = np.abs(run.contact_time.values - fine.times)
    assert np.max(difference) < 10 * TIME
    assert np.all(run.contact_time_error.values < 10 * TIME)


def test_same_states_at_contacts_and_at_the_end(pair):
    system, run, fine, _ = pair
    ours = np.stack([run[f"contact_{name}"].values for name in system.states], axis=1)
    assert np.all(np.abs(ours - fine.states) < 10 * SHARE * ranges(run))
    end = np.array([run[f"end_{name}"].item() for name in system.states])
    assert np.all(np.abs(end - fine.end) < 10 * SHARE * ranges(run))


def test_contact_velocity_is_the_rate_of_the_gap(pair):
    system, run, _, _ = pair
    clearances, _ = boundaries(run)
    half = len(system.states) // 2
    speed = [np.asarray(run[f"contact_{name}"].values) for name in system.states[half:]]
    rates = {
        "chain": [speed[0], speed[-1] - speed[0]],
        "gear_pair": [speed[0]],
        "aeroelastic": [speed[-1]],
    }[system.name]
    exact = np.array([rates[clearance][i] for i, clearance in enumerate(clearances)])
    assert np.max(np.abs(run.contact_velocity.values - exact)) < 1e-13 * np.max(np.abs(exact))
