"""Beams of many modes by the modal flow beside Taylor's method, a stiff solver and heyoka: contact
times, multipliers and exponents.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.flow.maps import Stroboscope
from saltus.system.linearity import linear_pieces
from two_flows import FOLLOWS

METHODS = sl.Modal(), sl.Taylor()


@pytest.fixture
def beam(monkeypatch):
    """The beam of the benchmark, by its modes and stops."""
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2])
    from benchmarks.structures import structure

    return structure


@pytest.mark.parametrize(
    ("modes", "stops", "periods"),
    [(5, 1, 8), (5, 2, 8), (10, 2, 5), pytest.param(20, 1, 3, marks=pytest.mark.nightly)],
)
@pytest.mark.slow
def test_contacts_of_a_beam_are_those_of_taylor(beam, modes, stops, periods):
    """To 1e-12 of the period, and what rounding of both has grown to, as they measure it."""
    system = beam(modes, stops)
    start, period = np.zeros(2 * modes), 1 / system.values["frequency"]
    modal, taylor = (
        sl.simulate(system, start, periods=periods, method=one, progress=False) for one in METHODS
    )
    count = min(run.sizes["contact"] for run in (modal, taylor))
    error = sum(run.contact_time_error.values[:count] for run in (modal, taylor))
    told = error < 1e-10 * period
    assert told.sum() > 20
    if told.all():
        assert modal.sizes["contact"] == taylor.sizes["contact"]
    else:
        count = int(np.argmin(told))
    names = [run.contact_guard.values[:count].tolist() for run in (modal, taylor)]
    assert names[0] == names[1]
    apart = np.abs(modal.contact_time.values[:count] - taylor.contact_time.values[:count])
    assert (apart < 1e-12 * period + error[:count]).all(), (apart / period).max()


@pytest.mark.parametrize("modes", [5, pytest.param(10, marks=pytest.mark.nightly)])
@pytest.mark.slow
def test_multipliers_are_those_of_taylor(beam, modes):
    """Of one period of a motion with contacts."""
    system = beam(modes, 1).with_values(force=0.03)
    start, _ = Stroboscope(system, sl.Modal()).ends(np.zeros((1, 2 * modes)), 40)
    assert sl.simulate(system, start[0], periods=1, progress=False).sizes["contact"] > 1
    (ends, exact), (others, found) = (Stroboscope(system, one).tangent(start, 1) for one in METHODS)
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-11 * np.abs(ends).max())
    known, values = (np.linalg.eigvals(one[0]) for one in (exact, found))
    apart = np.abs(known[:, None] - values).min(axis=1)
    assert (apart < 1e-8).all()


@pytest.mark.slow
def test_exponents_of_a_response_are_those_of_taylor(beam):
    """Of one that repeats, and of one that doesn't: within four standard errors."""
    for force, kind in ((0.03, "periodic"), (2.0, "chaotic")):
        system = beam(5, 1).with_values(force=force)
        start, _ = Stroboscope(system, sl.Modal()).ends(np.zeros((1, 10)), 4000)
        found = [
            sl.lyapunov(system, start[0], flow=one, periods=200, transient=50, progress=False)
            for one in METHODS
        ]
        assert [one.kind.item() for one in found] == [kind, kind]
        values, errors = (
            np.array([one[f"lyapunov_{of}"].values.ravel() for one in found])
            for of in ("exponent", "error")
        )
        least = 1e-6 * np.abs(values).max()
        allowed = 4 * np.hypot(*errors) + least
        assert (np.abs(values[0] - values[1]) < allowed).all()
        np.testing.assert_allclose(*(one.exponent_sum.values for one in found), rtol=1e-9)


def by_scipy(system, method, periods, **tolerances):
    """Times of the contacts from rest, each contact state integrated by itself."""
    linear, values = linear_pieces(system), dict(system.values)
    gaps, (rates, lags) = linear.gaps(values), linear.rates(values)
    end, now, z, times = periods / values["frequency"], 0.0, np.zeros(len(system.states)), []
    mode = sum(1 << g for g, away in enumerate(gaps.constant) if away > 0)
    while now < end:
        piece = linear.piece(values, mode)

        def motion(t, z, piece=piece):
            return piece.matrix @ z + piece.constant + piece.driven @ np.cos(rates * t + lags)

        ends = []
        for g in range(len(gaps.constant)):
            ends.append(lambda t, z, g=g: gaps.matrix[g] @ z + gaps.constant[g])
            ends[-1].terminal, ends[-1].direction = True, -1.0 if mode >> g & 1 else 1.0
        more = {"jac": piece.matrix} if method == "Radau" else {}
        leg = solve_ivp(motion, (now, end), z, method, events=ends, **tolerances, **more)
        now, z = leg.t[-1], leg.y[:, -1]
        if leg.status == 1:
            times.append(now)
            mode ^= 1 << next(g for g, found in enumerate(leg.t_events) if len(found))
    return np.array(times)


@pytest.mark.slow
def test_contacts_of_a_stiff_stop_are_those_of_a_stiff_solver(beam):
    """Radau's method of order five at its smallest useful tolerance."""
    system = beam(5, 1).with_values(stop_30_stiffness=1e7)
    times = by_scipy(system, "Radau", 0.3, rtol=1e-9, atol=1e-13)
    run = sl.simulate(
        system, np.zeros(10), t_end=0.3 / system.values["frequency"], method=sl.Modal(), **FOLLOWS
    )
    assert run.sizes["contact"] == len(times) > 3
    assert np.abs(run.contact_time.values - times).max() < 1e-6 / system.values["frequency"]


ROW = {
    "mass": 0.5,
    "stiffness": 4e3,
    "damping": 0.4,
    "contact_stiffness": 2e4,
    "gap": 1e-3,
    "force": 12.0,
    "frequency": 7.0,
}


@pytest.mark.slow
def test_contacts_of_six_bodies_are_those_of_heyoka():
    """The structure has matrices and modes; heyoka has the bodies' equations, written by hand."""
    pytest.importorskip("heyoka", reason="extra `reference` isn't installed")
    from oracles import heyoka_systems

    n, each = 6, np.arange(6)
    mass = np.diag(ROW["mass"] * (1 + 0.2 * each))
    strain = np.eye(n) - np.eye(n, k=-1)
    stiffness = strain.T @ np.diag(ROW["stiffness"] * (1 + 0.1 * each)) @ strain
    stop = {"stiffness": ROW["contact_stiffness"], "gap": ROW["gap"], "side": "both"}
    names = [f"x{i + 1}" for i in range(n)]
    system = sl.structure(
        mass,
        stiffness,
        damping=ROW["damping"] * strain.T @ strain,
        names=names,
        modes=n,
        contacts=[sl.Contact("x2", name="second", **stop), sl.Contact("x6", name="last", **stop)],
        forces=[sl.Force("x6", ROW["force"])],
        frequency=ROW["frequency"],
        sensors={name: name for name in names},
    )
    periods = 8
    run = sl.simulate(
        system, np.zeros(2 * n), periods=periods, samples=2, method=sl.Modal(), progress=False
    )
    end = run.end_time.item()
    fine, coarse = (
        heyoka_systems.simulate("row", ROW, np.zeros(2 * n), end, tolerance=tolerance)
        for tolerance in (1e-16, 1e-13)
    )
    assert run.sizes["contact"] == len(fine.times) > 40
    met = zip(fine.clearances, fine.sides, strict=True)
    stops = [f"{('second', 'last')[c]} {'upper' if side > 0 else 'lower'}" for c, side in met]
    assert run.contact_guard.values.tolist() == stops
    own = 2e-14 + np.abs(fine.times - coarse.times)  # heyoka's error, with the motion's growth
    apart = np.abs(run.contact_time.values - fine.times)
    assert (apart < 10 * own + run.contact_time_error.values).all()
    last = [run[name].values[-1] for name in names]
    np.testing.assert_allclose(last, fine.end[:n], rtol=0, atol=1e-12 * np.abs(fine.end[:n]).max())
