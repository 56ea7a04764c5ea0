"""Limit cycles of systems without forcing, stable and unstable: closed forms, published periods,
the divergence of the flow, and independent solvers.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl

#: Period of the shortest cycle of Lorenz' attractor, AB: Viswanath, Physica D 190 (2004) 115-128.
VISWANATH_AB = 1.5586522107161747
BOX = {"x": (-20, 20), "y": (-20, 20), "z": (0, 50)}


@sl.system(states="x y z")
def lorenz(t, x, y, z, *, sigma=10.0, rho=28.0, beta=8 / 3):
    """Convection in three modes."""
    return sigma * (y - x), x * (rho - z) - y, x * y - beta * z


@sl.system(states="x y")
def circles(t, x, y, *, mu=0.75, omega=5.0):
    """r' = r (-mu + 2 r^2 - r^4): an unstable circle within a stable one, around a sink."""
    square = x**2 + y**2
    growth = -mu + 2 * square - square**2
    return growth * x - omega * y, growth * y + omega * x


@sl.system(states="x v")
def stopped(t, x, v, *, mu=1.0, gap=1.2, restitution=0.7):
    """Van der Pol's oscillator before a rigid stop."""
    return v, mu * (1 - x**2) * v - x, sl.impact(x < gap, v, restitution=restitution)


def multipliers(found):
    return found.orbit_multiplier_real.values + 1j * found.orbit_multiplier_imag.values


@pytest.fixture(scope="module")
def chaotic():
    return sl.periodic_orbits(lorenz, "random 60", box=BOX)


@pytest.fixture(scope="module")
def subcritical():
    return sl.periodic_orbits(lorenz.with_values(rho=20.0), "random 60", box=BOX, periods=1)


def test_both_circles_are_found_with_period_and_multiplier():
    found = sl.periodic_orbits(circles, "random 30", box={"x": (-1.3, 1.3), "y": (-1.3, 1.3)})
    radius = np.hypot(found.orbit_x.values, found.orbit_y.values)
    order = np.argsort(radius[:, 0])
    period, square = 2 * np.pi / 5, np.array([0.5, 1.5])
    assert found.orbit_cycle.values == pytest.approx([period] * 2, rel=1e-14)
    np.testing.assert_allclose(radius[order] ** 2, square[:, None] * np.ones(64), rtol=1e-13)
    own = np.exp(period * 4 * square * (1 - square))
    assert multipliers(found)[order] == pytest.approx(own[:, None], rel=1e-11)
    assert found.orbit_stability.values[order].tolist() == ["unstable node", "stable node"]
    exponent = np.maximum(np.log(own) / period, 0)
    assert found.orbit_exponent.values[order] == pytest.approx(exponent, abs=1e-11)


def test_a_cycle_is_one_whatever_its_phase_and_deflated_at_all_of_them():
    """Every start lies on the stable circle: to the unstable one leads deflation alone."""
    phase = np.linspace(0, 6, 9)
    start = np.sqrt(1.5) * np.array([np.cos(phase), np.sin(phase)])
    found = sl.periodic_orbits(circles, {"x": start[0], "y": start[1]}, period=("1 s", "1.5 s"))
    assert sorted(found.orbit_found.values) == [0, 9]
    assert found.search_deflated.item() == 1
    assert sorted(found.orbit_stable.values) == [0, 1]


@pytest.mark.slow
def test_the_shortest_cycle_of_lorenz_attractor_has_the_published_period(chaotic):
    assert chaotic.orbit_cycle.values[0] == pytest.approx(VISWANATH_AB, rel=1e-14)
    assert chaotic.sizes["orbit"] > 1
    assert (chaotic.orbit_stability == "saddle").all()


def test_the_cycles_around_both_foci_are_mirror_images(subcritical):
    """(x, y, z) -> (-x, -y, z): the least x of one is the largest of the other, half a turn on."""
    assert subcritical.orbit_cycle.values[0] == pytest.approx(
        subcritical.orbit_cycle.values[1], rel=1e-13
    )
    x = subcritical.orbit_x.values
    assert (x[0] < 0).all()
    assert (x[1] > 0).all()
    assert subcritical.orbit_peak.values[0] == pytest.approx(
        subcritical.orbit_peak.values[1], rel=1e-13
    )


@pytest.mark.parametrize("which", ["chaotic", "subcritical"])
def test_multipliers_multiply_to_what_the_divergence_says(which, request):
    """Liouville: the flow shrinks all volumes at the rate sigma + 1 + beta."""
    found = request.getfixturevalue(which)
    shrunk = np.exp(-(10 + 1 + 8 / 3) * found.orbit_cycle.values)
    assert np.prod(multipliers(found), axis=1) == pytest.approx(shrunk, rel=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["chaotic", "subcritical"])
def test_lorenz_cycles_close_under_heyoka_with_the_same_multipliers(which, request):
    """By its own variational equations."""
    hy = pytest.importorskip("heyoka", reason="extra `reference` isn't installed")
    found = request.getfixturevalue(which)
    rho = {"chaotic": 28.0, "subcritical": 20.0}[which]
    x, y, z = hy.make_vars("x", "y", "z")
    rates = [(x, 10.0 * (y - x)), (y, x * (rho - z) - y), (z, x * y - 8.0 / 3.0 * z)]
    solver = hy.taylor_adaptive(hy.var_ode_sys(rates, hy.var_args.vars, order=1), [1.0, 1.0, 1.0])
    for i in range(found.sizes["orbit"]):
        start = np.array([found[f"orbit_{name}"].values[i, 0] for name in "xyz"])
        solver.time = 0.0
        solver.state[:] = [*start, *np.eye(3).ravel()]
        solver.propagate_until(found.orbit_cycle.values[i])
        np.testing.assert_allclose(solver.state[:3], start, atol=1e-10)
        own = np.linalg.eigvals(solver.state[3:].reshape(3, 3))
        own = own[np.argsort(-np.abs(own))]
        assert own[1] == pytest.approx(1.0, abs=1e-10)
        assert multipliers(found)[i, 0] == pytest.approx(own[0], rel=1e-10)


@pytest.mark.parametrize(("mu", "restitution"), [(1.0, 0.7), (-0.2, 0.98)])
def test_a_cycle_with_impacts_against_an_independent_solver(mu, restitution):
    """One impact in a period: attracting, and with negative damping inside out, repelling.

    In the plane the nontrivial multiplier is the determinant of the tangent map: that of the flow
    is exp of the integral of its divergence, that of an impact the square of its restitution.
    """
    system = stopped.with_values(mu=mu, restitution=restitution)
    box = {"x": (-2.5, 1.2), "v": (-2.5, 2.5)}
    found = sl.periodic_orbits(system, "random 24", box=box)
    assert found.sizes["orbit"] == 1
    one = found.isel(orbit=0)

    def rates(_, y):
        divergence = mu * (1 - y[0] ** 2)
        return [y[1], divergence * y[1] - y[0], divergence]

    def hit(_, y):
        return y[0] - 1.2

    hit.terminal, hit.direction = True, 1
    exact = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}
    start, period = [one.orbit_x.values[0], one.orbit_v.values[0]], one.orbit_cycle.item()
    first = solve_ivp(rates, (0, period), [*start, 0.0], events=hit, **exact)
    x, v, integral = first.y[:, -1]
    rest = solve_ivp(
        rates, (0, period - first.t[-1]), [x, -restitution * v, integral], events=hit, **exact
    )
    assert rest.status == 0  # no other impact
    np.testing.assert_allclose(rest.y[:2, -1], start, atol=2e-11)
    own = restitution**2 * np.exp(rest.y[2, -1])
    assert multipliers(one)[0] == pytest.approx(own, rel=1e-10)
    assert one.orbit_stable.item() == (own < 1)
    assert one.orbit_itinerary.item() == "gap+"
    assert one.orbit_contacts.item() == 1


def test_a_period_is_a_range_or_a_guess():
    """The stable circle has the period 2 pi/5 = 1.2566 s."""
    start = {"x": [1.2, 0.9], "y": 0.0}
    for period, count in (("1 s", 2), (("2 s", "4 s"), 0)):
        assert sl.periodic_orbits(circles, start, period=period).sizes["orbit"] == count


@pytest.mark.parametrize(
    ("system", "arguments", "words"),
    [
        (circles, {"period": ("2 s", "1 s")}, "ascending range"),
        (circles, {"period": "2 m"}, "measured in s"),
        (circles, {"period": -1.0}, "positive time"),
        (circles, {"method": sl.ODE45()}, "unstable orbits"),
    ],
)
def test_refusals(system, arguments, words):
    with pytest.raises(sl.SaltusError, match=words):
        sl.periodic_orbits(system, (1.0, 0.0), **arguments)


def test_no_cycle_is_no_error():
    found = sl.periodic_orbits(circles.with_values(mu=1.5), (1.0, 0.0))
    assert found.sizes["orbit"] == 0
    assert "0 orbits" in sl.describe(found)


def test_a_branch_goes_on_from_an_unstable_cycle():
    """Both circles meet in a fold at mu = 1."""
    found = sl.periodic_orbits(circles, "random 30", box={"x": (-1.3, 1.3), "y": (-1.3, 1.3)})
    repelling = found.isel(orbit=found.orbit_stable.values == 0)
    branch = sl.branches(circles, {"mu": (0.7, 1.2)}, start=repelling, points=30)
    folds = branch.event_mu.values[branch.event_kind.values == "fold"]
    assert folds == pytest.approx([1.0], abs=1e-10)


def test_a_held_contact_that_is_let_go_at_a_point_makes_no_cycle():
    """A block that sticks to its belt, started a rounding error beside its speed, slips: shots that
    begin so close on others than the one cycle that its motions settle to.
    """
    belt = sl.models.belt_two_values()
    found = sl.periodic_orbits(belt, "random 24", box={"x": (-2, 2), "v": (-2, 2)})
    settled = sl.attractors(belt, (1.0, 0.0))
    assert found.orbit_cycle.values == pytest.approx(settled.attractor_cycle.values, rel=1e-9)
