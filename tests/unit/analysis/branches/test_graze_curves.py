"""Curves of grazes and their square roots against closed forms, simulations and SciPy."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import root

import saltus as sl
from saltus.analysis.branches.grazes import touch
from saltus.analysis.branches.grazing_orbits import GrazingOrbits, returned
from saltus.analysis.branches.shooting import PeriodicOrbits

REFERENCE = Path(__file__).parents[3] / "reference"


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def stopped(
    t, x, v, *, c=0.2, cubic=0.0, contact=4.0, preload=0.0, gap=1.0, lower=1.2, bias=0.0,
    force=0.5, omega=1.4,
):  # fmt: skip
    push = sl.where(x > gap, contact * (x - gap) + preload, 0.0)
    pull = sl.where(x < -lower, contact * (x + lower), 0.0)
    return v, bias - c * v - x - cubic * x**3 - push - pull + force * sl.cos(omega * t)


IMPACTS = sl.models.impact_oscillator(
    stiffness=1, damping=0.1, force=1, gap=1, restitution=0.8, frequency=1.2
)


def size(omega, c):
    """|Z|: force over amplitude of x'' + c x' + x."""
    return np.abs(1 - omega**2 + 1j * c * omega)


def first_graze(system, vary, guard="gap", start=(0.0, 0.0), **more):
    """The first graze of a guard on the branch from a start."""
    found = sl.branches(system, vary, start, at=1, longest=1, **more)
    return found.sel(event=int(np.flatnonzero(found.event_guard.values == guard)[0]))


@cache
def impact_graze():
    return first_graze(IMPACTS, {"force": (0.1, 0.6)})


def square_root(omega, c=0.1, e=0.8):
    """That of a response of amplitude 1: the displacement one period after a kick."""
    own, period = np.sqrt(1 - c**2 / 4), 2 * np.pi / omega
    later = np.exp(-c * period / 2) * np.sin(own * period) / own
    return (1 + e) * np.sqrt(2 * omega**2) * later


# -- closed forms ----------------------------------------------------------------------------------
def test_a_response_without_contact_grazes_a_rigid_stop_where_its_amplitude_is_the_gap():
    """A = d|Z(w)|; the square root vanishes where the period is m/2 of the damped oscillator's."""
    event = impact_graze()
    assert event.event_force.item() == pytest.approx(size(1.2, 0.1), rel=1e-13)
    assert event.event_sqrt_coefficient.item() == pytest.approx(square_root(1.2), rel=1e-11)
    curve = sl.bifurcation_curve(IMPACTS, event, {"frequency": (0.9, 2.5), "force": (0.01, 6)})
    w = curve.point_frequency.values
    assert (w.min(), w.max()) == pytest.approx((0.9, 2.5), abs=1e-12)
    np.testing.assert_allclose(curve.point_force.values, size(w, 0.1), rtol=5e-12)
    np.testing.assert_allclose(curve.point_sqrt_coefficient.values, square_root(w), atol=1e-11)
    resonant = np.sort(curve.codim2_frequency.values[curve.codim2_kind.values == "resonant_graze"])
    own = np.sqrt(1 - 0.1**2 / 4)
    assert resonant == pytest.approx([own, 2 * own], rel=1e-12)
    least = curve.isel(codim2=list(curve.codim2_kind.values).index("extremum"))
    assert least.codim2_extremum.item() == "force"
    assert least.codim2_frequency.item() == pytest.approx(np.sqrt(1 - 0.1**2 / 2), abs=1e-8)
    assert set(curve.point_itinerary.values) == {""}


def test_a_curve_of_folds_leaves_a_resonant_graze_quadratically():
    """Simpson & Ghosh, arXiv:2602.22797. Next to it the map bends without bound, and no cusp is
    made of the noise.
    """
    found = sl.branches(IMPACTS, {"force": (0.1, 0.6)}, (0, 0), at=1, longest=1)
    event = found.sel(event=int(np.flatnonzero(found.event_kind.values == "fold")[0]))
    curve = sl.bifurcation_curve(IMPACTS, event, {"frequency": (1.19, 2.5), "force": (0.05, 6)})
    resonant = 2 * np.sqrt(1 - 0.1**2 / 4)
    w, force = curve.point_frequency.values, curve.point_force.values
    apart = resonant - w
    assert abs(apart).min() < 1e-6
    near = (apart > 2e-5) & (apart < 2e-3)
    ratio = (size(w, 0.1) - force)[near] / apart[near] ** 2
    assert len(ratio) > 3
    assert np.ptp(ratio) < 0.01 * ratio.mean()
    assert not len(curve.codim2)


def test_a_curve_of_grazes_ends_where_the_other_stop_is_touched():
    """(gap - bias)|Z|, to bias = (gap - lower)/2."""
    event = first_graze(stopped, {"force": (0.1, 1.1)})
    curve = sl.bifurcation_curve(stopped, event, {"force": (0.1, 3), "bias": (-0.5, 0.5)})
    exact = (1 - curve.point_bias.values) * size(1.4, 0.2)
    np.testing.assert_allclose(curve.point_force.values, exact, rtol=1e-13)
    assert {curve.attrs["begin"], curve.attrs["end"]} == {"double_graze", "range"}
    assert curve.codim2_kind.values.tolist() == ["double_graze"]
    assert curve.codim2_bias.item() == pytest.approx(-0.1, rel=1e-12)
    assert not curve.point_sqrt_coefficient.values.any()  # no square root at a soft stop


def test_the_rig_grazes_its_upper_stop_at_the_reference():
    """The curve from a graze at another force, to the force of the reference."""
    with (REFERENCE / "branches_rig.csv").open() as file:
        exact = next(float(row["value"]) for row in csv.DictReader(file) if row["id"] == "G18")
    rig = sl.models.delangre("c", force="3.95 N", frequency="5 Hz").with_values(
        contact_stiffness=2.3e4
    )
    orbit = sl.periodic_orbits(rig, {"x": 5.6e-4, "v": -5.3e-3}, periods=1)
    found = sl.branches(rig, {"contact_stiffness": (2.3e4, 2.32e4)}, orbit, longest=1)
    grazes = np.flatnonzero(found.event_guard.values == "upper_gap")
    both = {"contact_stiffness": (1e4, 4e4), "force": (3.9, 4.0)}
    curve = sl.bifurcation_curve(rig, found.sel(event=int(grazes[0])), both)
    last = int(np.argmax(curve.point_force.values))
    assert curve.point_force.values[last] == 4.0
    assert curve.point_contact_stiffness.values[last] == pytest.approx(exact, rel=1e-12)
    point = curve.isel(point=last)
    z = np.array([point.point_x.values[0], point.point_v.values[0], exact, 4.0])
    orbits = PeriodicOrbits(rig, ("contact_stiffness", "force"), 1, np.abs([z, z]), sl.Taylor())
    guard = [one.name for one in rig.guards].index("upper_gap")
    grazing, u = GrazingOrbits.of(orbits, z, guard, found.event_phase.values[grazes[0]])
    state = touch(grazing.legs, grazing.place, grazing.gap, u[None])[0]
    around = returned(grazing.legs, u[None, :-1], grazing.place, u[None, -1], state)[0]
    assert len(grazing.legs.contacts) == 4
    own = point.point_multiplier_real.values + 1j * point.point_multiplier_imag.values
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(around)), np.sort(own), rtol=1e-8)


@sl.system(states="x v")
def stopped_cycle(t, x, v, *, mu=1.9, gap=2.1, contact=3.0):
    return v, mu * (1 - x**2) * v - x - sl.where(x > gap, contact * (x - gap), 0.0)


def test_a_limit_cycle_grazes_where_its_amplitude_is_the_gap():
    """Van der Pol's cycle at mu = 2, by SciPy; its period from the literature."""
    event = first_graze(stopped_cycle, {"gap": (2.0, 2.1)}, start=(2.0, 0.0), every=7.5)
    curve = sl.bifurcation_curve(stopped_cycle, event, {"mu": (1.8, 2.0), "gap": (1.9, 2.1)})
    last = curve.isel(point=int(np.argmax(curve.point_mu.values)))
    run = solve_ivp(
        lambda t, y: [y[1], 2 * (1 - y[0] ** 2) * y[1] - y[0]], (0, 60), [2.0, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-13, events=lambda t, y: y[1],
    )  # fmt: skip
    top = max(state[0] for state in run.y_events[0][-2:])
    assert last.point_mu.item() == 2.0
    assert last.point_gap.item() == pytest.approx(top, rel=1e-11)
    # Andersen & Geer, SIAM J. Appl. Math. 42 (1982) 678
    assert last.point_period.item() == pytest.approx(7.62987448, abs=2e-8)


# -- simulations -----------------------------------------------------------------------------------
def returning(system, event, depth, damping):
    """The gap one period behind a motion that would pass the boundary by a depth, less that of the
    motion without the contact.
    """
    omega = system.values[system.forced_at]
    touched = event.event_phase.item() * 2 * np.pi / omega
    own = np.array([[0, 1], [-1, -damping]])
    start = np.array([event.event_x.values[0], event.event_v.values[0]])
    start += np.linalg.solve(expm(own * touched), [depth, 0.0])
    end = touched + 2 * np.pi / omega
    runs = [
        sl.simulate(one, tuple(start), t_end=end) for one in (system.with_values(gap=2.0), system)
    ]
    apart = [np.subtract(*(run[name].values[-1] for run in runs)) for name in ("x", "v")]
    return (expm(own * (end - runs[0].time.values[-1])) @ apart)[0]  # apart without contact


def test_the_square_root_is_what_an_impact_does():
    system = IMPACTS.with_values(frequency=2.4)
    event = first_graze(system, {"force": (1.0, 6.0)})
    system = system.with_values(force=event.event_force.item())
    wanted = event.event_sqrt_coefficient.item()
    assert wanted == pytest.approx(square_root(2.4), rel=1e-11)
    errors = [
        returning(system, event, depth, 0.1) / np.sqrt(depth) - wanted for depth in (1e-6, 1e-8)
    ]
    assert abs(errors[1]) < 1e-3 * wanted
    assert np.log(errors[0] / errors[1]) / np.log(100) == pytest.approx(0.5, abs=0.05)


def test_the_square_root_is_what_a_preload_does():
    """A force that jumps at contact acts as long as the contact lasts, as the root of its depth."""
    system = stopped.with_values(omega=2.6)
    event = first_graze(system, {"force": (1.0, 7.0)})
    force = event.event_force.item()
    curve = sl.bifurcation_curve(system, event, {"force": (1.0, 9.0), "preload": (-1e-9, 0.5)})
    last = int(np.argmax(curve.point_preload.values))
    assert curve.point_force.values == pytest.approx(force, rel=1e-12)
    wanted = curve.point_sqrt_coefficient.values[last]
    system = system.with_values(force=force, preload=curve.point_preload.values[last])
    errors = [
        returning(system, event, depth, 0.2) / np.sqrt(depth) - wanted for depth in (1e-6, 1e-8)
    ]
    assert abs(errors[1]) < 2e-3 * abs(wanted)
    assert np.log(errors[0] / errors[1]) / np.log(100) == pytest.approx(0.5, abs=0.05)


# -- an independent solver -------------------------------------------------------------------------
def test_where_folds_and_grazes_meet_by_scipy():
    system = stopped.with_values(cubic=1.0, lower=5.0, omega=1.0)
    event = first_graze(system, {"force": (0.05, 1.0)})
    curve = sl.bifurcation_curve(system, event, {"omega": (0.8, 2.2), "force": (0.05, 2.5)})
    both = np.flatnonzero(curve.codim2_kind.values == "fold_graze")
    assert len(both) == 2

    def defining(u):
        x, v, omega, force, when = u

        def rates(t, y):
            m = y[2:].reshape(2, 2)
            slope = np.array([[0, 1], [-1 - 3 * y[0] ** 2, -0.2]])
            pull = -0.2 * y[1] - y[0] - y[0] ** 3 + force * np.cos(omega * t)
            return [y[1], pull, *(slope @ m).ravel()]

        whole = 2 * np.pi / omega
        run = solve_ivp(
            rates, (0, whole), [x, v, 1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-13,
            dense_output=True,
        )  # fmt: skip
        end, touch = run.y[:, -1], run.sol(when * whole)
        return [end[0] - x, end[1] - v, touch[0] - 1, touch[1],
                np.linalg.det(end[2:].reshape(2, 2) - np.eye(2))]  # fmt: skip

    for place in both[:1]:
        point = curve.isel(codim2=int(place))
        z = [point.codim2_x.values[0], point.codim2_v.values[0], point.codim2_omega.item(),
             point.codim2_force.item()]  # fmt: skip
        run = sl.simulate(system.with_values(omega=z[2], force=z[3]), z[:2], 1, samples=400)
        guess = [*z, int(np.argmax(run.x.values)) / 400]
        other = root(defining, guess, tol=1e-12)
        np.testing.assert_allclose(other.x[:4], z, rtol=1e-8, atol=1e-8)
