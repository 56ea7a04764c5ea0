"""Hopf points, folds and boundary equilibria against closed forms and known numbers."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.special_equilibria import boundary_equilibrium, fold_point, hopf_point


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


def test_the_hopf_point_of_the_valve():
    valve = sl.models.relief_valve(flow=8.0)
    found = hopf_point(valve, "flow", np.array([2.2, 0.0, 12.0]))
    assert found.value == pytest.approx(8.4911176351833271, rel=1e-13)
    assert found.frequency == pytest.approx(3.0907088479743406, rel=1e-13)
    assert found.state[0] * np.sqrt(found.state[2]) == pytest.approx(found.value, rel=1e-13)


@pytest.mark.parametrize("cubic", [-1.0, 0.7])
def test_the_coefficient_of_the_normal_form(cubic):
    """x + iy = sqrt(2) z for a unit eigenvector, so |z|^2 z has the coefficient 2 cubic."""
    found = hopf_point(normal_form.with_values(cubic=cubic), "mu", np.array([0.01, 0.02]))
    assert found.value == pytest.approx(0.0, abs=1e-15)
    assert found.frequency == pytest.approx(2.0, rel=1e-14)
    assert found.coefficient == pytest.approx(2 * cubic / 2.0, rel=1e-12)


@sl.system(states="x v")
def skewed(t, x, v, *, mu=0.0, square=1.0, product=0.5):
    return v, mu * v - x - square * x * x + product * x * v - x * x * v


def test_the_coefficient_tells_the_size_of_the_cycle_with_square_terms():
    """|z|^2 = -(mu/2)/l1, and x = sqrt(2) |z| cos t to first order."""
    found = hopf_point(skewed, "mu", np.array([0.01, 0.0]))
    mu = 1e-3
    cycle = sl.attractors(skewed.with_values(mu=mu), [0.05, 0.0], every=6.0)
    x = cycle.attractor_x.values[0]
    size = 0.5 * (np.nanmax(x) - np.nanmin(x))
    assert cycle.attractor_type.item() == "limit_cycle"
    assert size == pytest.approx(np.sqrt(mu / -found.coefficient), rel=1e-2)


def test_lorenz_loses_its_rest_to_an_unstable_cycle():
    """rho = sigma (sigma + beta + 3)/(sigma - beta - 1), subcritical (Marsden & McCracken 1976)."""
    found = hopf_point(lorenz, "rho", np.array([7.8, 7.8, 23.0]))
    sigma, beta = 10.0, 8 / 3
    rho = sigma * (sigma + beta + 3) / (sigma - beta - 1)
    assert found.value == pytest.approx(rho, rel=1e-13)
    assert found.frequency == pytest.approx(np.sqrt(beta * (sigma + rho)), rel=1e-13)
    assert found.coefficient > 0


def test_the_unit_of_a_state_changes_no_point():
    points = [
        hopf_point(lorenz, "rho", np.array([7.8, 7.8, 23.0]), np.array(scale))
        for scale in ([1.0, 1.0, 1.0], [1e-3, 10.0, 1e3])
    ]
    assert points[0].value == pytest.approx(points[1].value, rel=1e-12)
    assert points[1].coefficient > 0


def test_a_fold_of_equilibria_is_where_the_cubic_turns():
    found = fold_point(cusp.with_values(load=0.35), "load", np.array([-0.65, 0.0]))
    assert found.value == pytest.approx(2 / (3 * np.sqrt(3)), rel=1e-13)
    assert found.state[0] == pytest.approx(-1 / np.sqrt(3), rel=1e-13)


def test_a_diagram_has_the_hopf_point_of_the_valve_to_rounding():
    start = {"x": 2.5, "v": 0.0, "pressure": 12.5}
    found = sl.bifurcation_diagram(sl.models.relief_valve(), {"flow": (8.2, 9.0, 5)}, start)
    at = found.event_flow.values[found.event_kind.values == "hopf"]
    np.testing.assert_allclose(at, [8.4911176351833271], rtol=1e-13)


def test_the_valve_closes_where_nothing_flows():
    valve = sl.models.relief_valve(flow=0.5)
    found = boundary_equilibrium(valve, "flow", 0, np.array([0.2, 0.0, 10.0]))
    assert found.value == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(found.state, [0.0, 0.0, 10.0], atol=1e-13)


def test_chuas_circuit_meets_a_kink_where_its_slopes_say():
    """x = (m1 - m0)/(1 + m1) is the outer equilibrium; it is 1 for m0 = -1."""
    circuit = sl.models.double_scroll(inner_slope=-1.2)
    number = [guard.name for guard in circuit.guards].index("x = 1")
    found = boundary_equilibrium(circuit, "inner_slope", number, np.array([1.5, 0.0, -1.5]))
    assert found.value == pytest.approx(-1.0, rel=1e-13)


def test_nothing_is_found_where_nothing_is():
    @sl.system(states="x v")
    def free(t, x, v, *, stiffness=1.0, damping=0.1):
        return v, -stiffness * x - damping * v

    assert hopf_point(free.with_values(damping=3.0), "stiffness", np.zeros(2)) is None
    assert hopf_point(free, "damping", np.zeros(2)).value == pytest.approx(0.0, abs=1e-14)
