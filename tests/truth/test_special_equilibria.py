"""Hopf points, folds and boundary equilibria against closed forms and known numbers."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.criticality import first_lyapunov
from saltus.analysis.branches.equilibrium_curves import EquilibriumCurves


@sl.system(states="x y")
def normal_form(t, x, y, *, mu=0.1, omega=2.0, cubic=-1.0):
    r = x * x + y * y
    return mu * x - omega * y + cubic * r * x, omega * x + mu * y + cubic * r * y


@sl.system(states="x y z")
def lorenz(t, x, y, z, *, sigma=10.0, rho=24.0, beta=8 / 3):
    return sigma * (y - x), x * (rho - z) - y, x * y - beta * z


@sl.system(states="x v")
def cusp(t, x, v, *, load=-0.3, damping=0.5):
    return v, load - damping * v + x - x**3


def events(system, vary, start, kind):
    """The parameter, states and eigenvalues at the events of a kind."""
    found = sl.branches(system, vary, start, at=2, switch=(), progress=False)
    found = found.isel(event=np.flatnonzero(found.event_kind.values == kind))
    (name,) = vary
    states = np.stack([found[f"event_{state}"].values[:, 0] for state in system.states], axis=1)
    own = found.event_eigenvalue_real.values + 1j * found.event_eigenvalue_imag.values
    return found[f"event_{name}"].values, states, own, found.event_outcome.values


def coefficient(system, name, state, scale=None):
    """The first Lyapunov coefficient at a Hopf point."""
    scale = np.ones(len(state) + 1) if scale is None else np.append(scale, 1.0)
    curves, z = EquilibriumCurves(system, name, scale[None]), np.append(state, system.values[name])
    curves.accepted(z[None], np.zeros(1, np.int64))
    return first_lyapunov(curves, 0, z)


@pytest.mark.slow
def test_the_hopf_point_of_the_valve():
    start = {"x": 2.5, "v": 0.0, "pressure": 12.5}
    value, state, own, _ = events(sl.models.relief_valve(), {"flow": (8.2, 9.0)}, start, "hopf")
    assert value == pytest.approx([8.4911176351833271], rel=1e-13)
    assert own[0, 0].imag == pytest.approx(3.0907088479743406, rel=1e-13)
    assert state[0, 0] * np.sqrt(state[0, 2]) == pytest.approx(value[0], rel=1e-13)


@pytest.mark.parametrize("cubic", [-1.0, 0.7])
def test_the_coefficient_of_the_normal_form(cubic):
    """x + iy = sqrt(2) z for a unit eigenvector, so |z|^2 z has the coefficient 2 cubic."""
    system = normal_form.with_values(cubic=cubic, mu=0.0)
    found, frequency = coefficient(system, "mu", np.zeros(2))
    assert frequency == pytest.approx(2.0, rel=1e-14)
    assert found == pytest.approx(2 * cubic / 2.0, rel=1e-12)


def test_the_normal_form_loses_its_rest_at_zero():
    value, _, own, outcome = events(
        normal_form, {"mu": (-0.1, 0.15)}, {"x": 0.01, "y": 0.02}, "hopf"
    )
    assert value == pytest.approx([0.0], abs=1e-15)
    assert own[0, 0].imag == pytest.approx(2.0, rel=1e-14)
    assert outcome.tolist() == ["supercritical"]


@sl.system(states="x v")
def skewed(t, x, v, *, mu=0.0, square=1.0, product=0.5):
    return v, mu * v - x - square * x * x + product * x * v - x * x * v


def test_the_coefficient_tells_the_size_of_the_cycle_with_square_terms():
    """|z|^2 = -(mu/2)/l1, and x = sqrt(2) |z| cos t to first order."""
    found, _ = coefficient(skewed, "mu", np.zeros(2))
    mu = 1e-3
    cycle = sl.attractors(skewed.with_values(mu=mu), [0.05, 0.0], every=6.0)
    x = cycle.attractor_x.values[0]
    size = 0.5 * (np.nanmax(x) - np.nanmin(x))
    assert cycle.attractor_type.item() == "limit_cycle"
    assert size == pytest.approx(np.sqrt(mu / -found), rel=1e-2)


def test_lorenz_loses_its_rest_to_an_unstable_cycle():
    """rho = sigma (sigma + beta + 3)/(sigma - beta - 1), subcritical (Marsden & McCracken 1976)."""
    start = {"x": 7.8, "y": 7.8, "z": 23.0}
    value, _, own, outcome = events(lorenz, {"rho": (20.0, 26.0)}, start, "hopf")
    sigma, beta = 10.0, 8 / 3
    rho = sigma * (sigma + beta + 3) / (sigma - beta - 1)
    np.testing.assert_allclose(value, rho, rtol=1e-13)  # on both sides
    np.testing.assert_allclose(own[:, 0].imag, np.sqrt(beta * (sigma + rho)), rtol=1e-13)
    assert set(outcome) == {"subcritical"}


def test_the_unit_of_a_state_changes_no_sign_of_the_coefficient():
    sigma, beta = 10.0, 8 / 3
    rho = sigma * (sigma + beta + 3) / (sigma - beta - 1)
    rest = np.array([np.sqrt(beta * (rho - 1))] * 2 + [rho - 1])
    for scale in ([1.0, 1.0, 1.0], [1e-3, 10.0, 1e3]):
        found, frequency = coefficient(lorenz.with_values(rho=rho), "rho", rest, scale)
        assert found > 0
        assert frequency == pytest.approx(np.sqrt(beta * (sigma + rho)), rel=1e-12)


def test_a_fold_of_equilibria_is_where_the_cubic_turns():
    value, state, _, _ = events(cusp, {"load": (-0.6, 0.6)}, {"x": 1.0, "v": 0.0}, "fold")
    order = np.argsort(value)
    np.testing.assert_allclose(value[order], 2 / (3 * np.sqrt(3)) * np.array([-1, 1]), rtol=1e-13)
    np.testing.assert_allclose(state[order, 0], np.array([1, -1]) / np.sqrt(3), rtol=1e-13)


@pytest.mark.slow
def test_a_diagram_has_the_hopf_point_of_the_valve_to_rounding():
    start = {"x": 2.5, "v": 0.0, "pressure": 12.5}
    found = sl.bifurcation_diagram(sl.models.relief_valve(), {"flow": (8.2, 9.0, 5)}, start)
    at = found.event_flow.values[found.event_kind.values == "hopf"]
    np.testing.assert_allclose(at, [8.4911176351833271], rtol=1e-13)


def test_the_valve_closes_where_nothing_flows():
    start = {"x": 0.2, "v": 0.0, "pressure": 10.0}
    value, state, _, _ = events(
        sl.models.relief_valve(), {"flow": (-0.1, 1.0)}, start, "boundary_equilibrium"
    )
    assert value == pytest.approx([0.0], abs=1e-14)
    np.testing.assert_allclose(state[0], [0.0, 0.0, 10.0], atol=1e-13)


def test_chuas_circuit_meets_a_kink_where_its_slopes_say():
    """x = (m1 - m0)/(1 + m1) is the outer equilibrium; it is 1 for m0 = -1."""
    start = {"x": 1.5, "y": 0.0, "z": -1.5}
    value, state, _, _ = events(
        sl.models.double_scroll(), {"inner_slope": (-1.3, -0.9)}, start, "boundary_equilibrium"
    )
    np.testing.assert_allclose(value, -1.0, rtol=1e-13)
    np.testing.assert_allclose(np.abs(state[:, 0]), 1.0, rtol=1e-13)


def test_nothing_is_found_where_nothing_is():
    @sl.system(states="x v")
    def free(t, x, v, *, stiffness=1.0, damping=0.1):
        return v, -stiffness * x - damping * v

    overdamped, start = free.with_values(damping=3.0), {"x": 0.1, "v": 0.0}
    assert not len(events(overdamped, {"stiffness": (0.5, 2.0)}, start, "hopf")[0])
    value = events(free, {"damping": (-0.1, 0.2)}, start, "hopf")[0]
    assert value == pytest.approx([0.0], abs=1e-14)
