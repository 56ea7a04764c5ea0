"""Limit cycles of piecewise smooth systems, found without a period given: closed forms, and an
independent solver with its variational equations.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.analysis.closed.turns import looks_every

CHUA = sl.models.double_scroll(alpha=8.0)


def chua(t, y):
    """The circuit and its variational equations, written down again."""
    x, v, z = y[:3]
    outer = abs(x) > 1
    slope = -5 / 7 if outer else -8 / 7
    resistor = slope * x + (np.sign(x) * (-8 / 7 + 5 / 7) if outer else 0.0)
    matrix = np.array([[-8.0 * (1 + slope), 8.0, 0.0], [1.0, -1.0, 1.0], [0.0, -100 / 7, 0.0]])
    rates = [8.0 * (v - x - resistor), x - v + z, -100 / 7 * v]
    return np.concatenate([rates, (matrix @ y[3:].reshape(3, 3)).ravel()])


def test_the_cycles_of_chuas_circuit_close_in_an_independent_solver():
    found = sl.attractors(CHUA, {"x": [1.6, -1.6], "y": 0.0, "z": [-1.6, 1.6]})
    assert found.attractor_type.values.tolist() == ["limit_cycle"] * 2
    np.testing.assert_allclose(found.attractor_cycle[0], found.attractor_cycle[1], rtol=1e-11)
    for i in range(2):
        one = found.isel(attractor=i)
        # a point beyond the kinks: each piece is smooth for the solver that knows no events
        start = np.array([one[f"attractor_{name}"].values[9] for name in "xyz"])
        run = solve_ivp(
            chua,
            (0, one.attractor_cycle.item()),
            [*start, *np.eye(3).ravel()],
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
            max_step=1e-3,
        )
        np.testing.assert_allclose(run.y[:3, -1], start, atol=1e-8)
        own = np.linalg.eigvals(run.y[3:, -1].reshape(3, 3))
        ours = one.attractor_multiplier_real.values + 1j * one.attractor_multiplier_imag.values
        np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(own + 0j), atol=1e-5)


def test_the_thermostat_switches_after_the_times_of_its_exponentials():
    found = sl.attractors(sl.models.thermostat(), {"temperature": [20.0, 30.0], "heater": [1, 0]})
    heating, cooling = 10 * np.log((38 - 22) / (38 - 23.5)), 10 * np.log((23.5 - 18) / (22 - 18))
    assert found.attractor_type.values.tolist() == ["limit_cycle"]
    assert found.basin.values.tolist() == [0, 0]
    one = found.isel(attractor=0)
    assert one.attractor_cycle.item() == pytest.approx(heating + cooling, rel=1e-12)
    assert one.attractor_itinerary.item() == "lower- upper+"
    assert one.attractor_peak.item() == pytest.approx(23.5, rel=1e-13)
    assert one.attractor_contacts.item() == 2


def test_stick_and_slip_have_the_period_of_the_closed_form():
    found = sl.attractors(sl.models.belt_two_values(), {"x": [0.0, 1.5], "v": 0.0})
    one = found.isel(attractor=0)
    assert one.attractor_type.item() == "limit_cycle"
    assert one.attractor_cycle.item() == pytest.approx(5 + 3.902605407814523, rel=1e-13)
    assert one.attractor_peak.item() == pytest.approx(1.0385164807134504, rel=1e-13)
    assert "limit cycle, period 8.903 s, 0.1123 Hz" in sl.describe(found)
    # the stick forgets where the slip began: nothing is left of a deviation
    np.testing.assert_allclose(one.attractor_multiplier_real, [1.0, 0.0], atol=1e-12)


def test_a_valve_at_rest_is_as_far_from_its_seat_as_its_lift():
    found = sl.attractors(sl.models.relief_valve(flow=9.0), {"x": 1.0, "v": 0.0, "pressure": 10.0})
    assert found.attractor_type.values.tolist() == ["equilibrium"]
    assert found.attractor_margin.item() == pytest.approx(found.attractor_x.item(), rel=1e-12)


@pytest.mark.parametrize("rate", [1e-6, 1.0, 1e6])
def test_a_turn_is_found_whatever_the_unit_of_time(rate):
    """x'' = -rate^2 x."""

    @sl.system(states="x v")
    def free(t, x, v, *, omega=1.0):
        return v, -omega * omega * x

    turn = looks_every(free.with_values(omega=rate), None, np.array([[1.0, 0.0]]))
    assert turn == pytest.approx(2 * np.pi / rate, rel=0.05)  # two digits


def test_a_turn_is_found_where_the_linear_part_is_a_thousand_times_faster():
    @sl.system(states="x y")
    def circle(t, x, y, *, fast=1000.0):
        pull = fast * (1.0 - x * x - y * y)
        return pull * x - y, pull * y + x

    turn = looks_every(circle, None, np.array([[0.9, 0.0], [0.0, 1.3]]))
    assert turn == pytest.approx(2 * np.pi, rel=0.05)
    assert looks_every(circle, "2 ms", np.zeros((1, 2))) == 2e-3


def test_basins_tell_rest_from_oscillation_without_a_period(few_scouts):
    wing = sl.models.aeroelastic()
    found = sl.basins(wing, pitch=(-0.02, 0.02, 9), plunge=(-0.002, 0.002, 5))
    assert found.attractor_type.values.tolist() == ["equilibrium", "limit_cycle"]
    assert (found.basin.values >= 0).all()
    assert found.attrs["every"] == pytest.approx(found.attractor_cycle.values[1], rel=0.2)
