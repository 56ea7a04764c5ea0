"""All equilibria of piecewise smooth systems against closed forms and a root finder."""

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus as sl


@sl.system(states="x y z")
def lorenz(t, x, y, z, *, sigma=10.0, rho=28.0, beta=8 / 3):
    return sigma * (y - x), x * (rho - z) - y, x * y - beta * z


@sl.system(states="x")
def ladder(t, x, *, size=1.0):
    rate = -size
    for root in range(-4, 5):
        rate = rate * (x - root) / 4
    return (rate,)


@sl.system(states="angle rate")
def pendulum(t, angle, rate, *, damping=0.2):
    return rate, -sl.sin(angle) - damping * rate


@sl.system(states="x v")
def block(t, x, v, *, stiffness=2.0, slip=0.3, stick=0.5):
    return v, -stiffness * x - sl.friction(v, slip=slip, stick=stick)


@sl.system(states="x y")
def sliding(t, x, y, *, above=-1.0, below=2.0, cross=0.7):
    return sl.piecewise((above - y, x > 0), otherwise=below + 3 * y), sl.piecewise(
        (cross - y, x > 0), otherwise=-1.0 - 2 * y
    )


@sl.system(states="x")
def kink(t, x, *, mu=0.0):
    return (mu - sl.abs(x),)


@sl.system(states="x v")
def ball(t, x, v, *, gravity=9.81, restitution=0.5):
    return v, -gravity, sl.impact(x > 0, -v, restitution=restitution)


def eigenvalues(found, i):
    one = found.isel(equilibrium=i)
    own = one.equilibrium_eigenvalue_real.values + 1j * one.equilibrium_eigenvalue_imag.values
    return own[np.isfinite(own)]


def same(own, expected):
    np.testing.assert_allclose(np.sort_complex(own), np.sort_complex(expected), rtol=1e-9)


def test_lorenz_has_its_three():
    found = sl.equilibria(lorenz)
    side, rho, beta, sigma = np.sqrt(8 / 3 * 27), 28.0, 8 / 3, 10.0
    np.testing.assert_allclose(found.equilibrium_x, [-side, 0, side], rtol=1e-13)
    np.testing.assert_allclose(found.equilibrium_z, [27, 0, 27], rtol=1e-13)
    root = np.sqrt((sigma + 1) ** 2 + 4 * sigma * (rho - 1))
    same(eigenvalues(found, 1), [-beta, (-sigma - 1 + root) / 2, (-sigma - 1 - root) / 2])
    # the characteristic polynomial of the two others
    polynomial = [1, sigma + beta + 1, beta * (sigma + rho), 2 * sigma * beta * (rho - 1)]
    same(eigenvalues(found, 0), np.roots(polynomial))
    assert found.equilibrium_type.values.tolist() == ["saddle_focus", "saddle", "saddle_focus"]
    assert not found.equilibrium_stable.any()


@pytest.mark.parametrize(("rho", "kinds"), [(0.5, ["node"]), (10.0, ["focus", "saddle", "focus"])])
def test_below_its_hopf_point_lorenz_rests(rho, kinds):
    found = sl.equilibria(lorenz.with_values(rho=rho))
    assert found.equilibrium_type.values.tolist() == kinds
    assert found.equilibrium_stable.values.tolist() == [kind != "saddle" for kind in kinds]


def test_chua_circuit_rests_in_each_piece_of_its_resistor():
    found = sl.equilibria(sl.models.double_scroll())
    far = (8 / 7 - 5 / 7) / (1 - 5 / 7)  # x = -f(x), the line of the resistor beyond 1
    np.testing.assert_allclose(found.equilibrium_x, [-far, 0, far], rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(found.equilibrium_z, [far, 0, -far], rtol=1e-14, atol=1e-14)
    for i, slope in enumerate([-5 / 7, -8 / 7, -5 / 7]):
        same(eigenvalues(found, i), np.roots(_characteristic(9.0, 100 / 7, slope)))
    np.testing.assert_allclose(found.equilibrium_margin, [far - 1, 1, far - 1], rtol=1e-12)


def _characteristic(alpha, beta, slope):
    gain = alpha * (1 + slope)
    return [1, 1 + gain, beta - alpha + gain, beta * gain]


def test_deflation_finds_all_nine_roots_from_one_start():
    found = sl.equilibria(ladder, start=[0.3])
    np.testing.assert_allclose(found.equilibrium_x, np.arange(-4, 5), rtol=1e-12, atol=1e-12)
    # the rate changes sign from root to root
    assert found.equilibrium_stable.values.tolist() == [1, 0, 1, 0, 1, 0, 1, 0, 1]


def test_a_pendulum_rests_at_every_half_turn_of_the_box():
    found = sl.equilibria(pendulum, angle=(-10, 10), rate=(-1, 1))
    inside = found.equilibrium_angle.values[np.abs(found.equilibrium_angle.values) < 10]
    np.testing.assert_allclose(inside, np.pi * np.arange(-3, 4), rtol=1e-12, atol=1e-12)


def test_a_block_is_stuck_in_an_interval():
    found = sl.equilibria(block)
    assert found.sizes["equilibrium"] == 1
    one = found.isel(equilibrium=0)
    assert one.equilibrium_type.item() == "continuum"
    assert one.equilibrium_place.item() == "pseudo"
    assert one.equilibrium_contacts.item() == "v = 0"
    assert (one.equilibrium_dimension, one.equilibrium_stable) == (1, 1)
    ends = [one.equilibrium_x_from, one.equilibrium_x, one.equilibrium_x_to]
    np.testing.assert_allclose(ends, [-0.25, 0, 0.25], atol=1e-14)  # stick/stiffness


def test_a_pseudo_equilibrium_is_that_of_filippov():
    found = sl.equilibria(sliding)
    pseudo = found.isel(equilibrium=found.equilibrium_place.values == "pseudo")

    def slides(y):
        """Rate of y on x = 0 by Filippov's convex combination."""
        up, down = np.array([-1.0 - y, 0.7 - y]), np.array([2.0 + 3 * y, -1.0 - 2 * y])
        share = down[0] / (down[0] - up[0])
        return share * up[1] + (1 - share) * down[1]

    at = brentq(slides, -0.6, 0.6, xtol=1e-15)
    step = 1e-6
    np.testing.assert_allclose(pseudo.equilibrium_y, [at], rtol=1e-13)
    np.testing.assert_allclose(pseudo.equilibrium_x, [0.0], atol=1e-15)
    slope = (slides(at + step) - slides(at - step)) / (2 * step)
    np.testing.assert_allclose(pseudo.equilibrium_eigenvalue_real[0, 0], slope, rtol=1e-8)
    assert bool(pseudo.equilibrium_stable[0]) == (slope < 0)


@pytest.mark.parametrize(
    ("mu", "at", "places"),
    [(0.5, [-0.5, 0.5], ["region", "region"]), (0.0, [0.0], ["boundary"]), (-0.5, [], [])],
)
def test_a_nonsmooth_fold_passes_a_boundary_equilibrium(mu, at, places):
    found = sl.equilibria(kink.with_values(mu=mu))
    np.testing.assert_allclose(found.equilibrium_x, at, atol=1e-15)
    assert found.equilibrium_place.values.tolist() == places
    if mu == 0.5:
        assert found.equilibrium_stable.values.tolist() == [0, 1]


def test_a_ball_rests_on_the_ground_and_a_hanging_one_does_not():
    found = sl.equilibria(ball)
    assert found.equilibrium_contacts.values.tolist() == ["x = 0"]
    assert found.equilibrium_stable.values.tolist() == [1]
    assert sl.equilibria(ball.with_values(gravity=-9.81)).sizes["equilibrium"] == 0
    assert not sl.equilibria(ball.with_values(restitution=1.0)).equilibrium_stable.any()


def test_an_open_valve_rests_where_the_flow_passes_and_a_closed_one_below_its_preload():
    found = sl.equilibria(sl.models.relief_valve(flow=9.0))
    at = brentq(lambda x: 9.0 - x * np.sqrt(x + 10), 0.1, 5, xtol=1e-15)
    np.testing.assert_allclose(found.equilibrium_x, [at], rtol=1e-13)
    np.testing.assert_allclose(found.equilibrium_margin, [at], rtol=1e-13)
    closed = sl.equilibria(sl.models.relief_valve(flow=0.0))
    assert closed.equilibrium_contacts.values.tolist() == ["x = 0"]
    np.testing.assert_allclose(closed.equilibrium_pressure_to, [10.0], rtol=1e-12)  # the preload


def test_a_wing_without_restoring_moment_diverges_to_the_ends_of_its_freeplay():
    wing = sl.models.aeroelastic(elastic_axis=-0.45)  # lift turns it away from rest
    found = sl.equilibria(wing)
    v = wing.values
    stiff = v["pitch_stiffness"]
    load = v["air_density"] * v["airspeed"] ** 2 * v["half_chord"] ** 2 * v["lift_slope"] * 0.05
    expected = stiff * v["pitch_gap"] / (stiff - load)
    np.testing.assert_allclose(
        np.sort(found.equilibrium_pitch), [-expected, 0, expected], rtol=1e-12, atol=1e-15
    )
    assert found.equilibrium_type.values[1].startswith("saddle")


def test_what_depends_on_time_is_refused():
    with pytest.raises(sl.SaltusError, match="depends on time, so it has no equilibria"):
        sl.equilibria(sl.models.delangre("a", force="4 N"))
    with pytest.raises(sl.SaltusError, match="only one of them"):
        sl.equilibria(block, start=(0, 0), x=(0, 1))
