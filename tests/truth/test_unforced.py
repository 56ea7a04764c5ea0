"""Systems without forcing: equilibria and limit cycles against closed forms and an independent
solver.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import saltus as sl
from saltus.analysis.closed.cycles import find_cycles, returns
from saltus.analysis.closed.field_zeros import captured, find_equilibria
from saltus.flow.maps import Stroboscope

FAST = sl.Taylor(lanes=2)


@sl.system(states="x y")
def planar(t, x, y, *, mu=1.0, omega=1.0, circle=1.0):
    """Hopf's normal form with ``circle`` = 1; van der Pol's equation with ``circle`` = 0."""
    r = x * x + y * y
    return (
        circle * (mu * x - omega * y - r * x) + (1 - circle) * y,
        circle * (omega * x + mu * y - r * y) + (1 - circle) * (mu * (1 - x * x) * y - x),
    )


STARTS = {"x": [0.3, -1.0], "y": [0.1, 0.0]}


@pytest.fixture(scope="module")
def hopf():
    return {
        every: sl.bifurcation_diagram(
            planar,
            {"mu": (-0.5, 1.0, 7)},
            STARTS,
            every=every,
            values={"omega": 2.0},
            method=FAST,
            periods=400,
        )
        for every in (0.05, 1.0, 20.0)
    }


@pytest.mark.slow
def test_a_limit_cycle_has_the_period_size_and_multipliers_of_the_closed_form(hopf):
    ds = hopf[1.0].isel(response=hopf[1.0].response_type.values == "limit_cycle")
    mu = ds.response_mu.values
    np.testing.assert_allclose(mu, [0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(ds.response_cycle, np.pi, rtol=1e-12)
    np.testing.assert_allclose(ds.response_peak, np.sqrt(mu), rtol=1e-12)
    np.testing.assert_allclose(ds.response_rms, np.sqrt(mu / 2), rtol=1e-12)
    np.testing.assert_allclose(ds.response_multiplier_real.values[:, 0], 1.0)
    np.testing.assert_allclose(
        ds.response_multiplier_real.values[:, 1], np.exp(-2 * mu * np.pi), rtol=1e-9
    )
    np.testing.assert_allclose(ds.response_exponent, 0.0)
    turns = np.sort(ds.sample_x.values, axis=1)
    np.testing.assert_allclose(
        turns[:, :2], np.stack([-np.sqrt(mu), np.sqrt(mu)], axis=1), rtol=1e-12
    )
    assert np.isnan(turns[:, 2:]).all(), "it turns twice in a cycle"


@pytest.mark.parametrize("turns", [1, 2, 67, 108, 115])
def test_a_cycle_that_was_looked_for_over_many_turns_has_its_smallest_period(turns):
    family = Stroboscope(planar, FAST, np.array([[1.0, 2.0, 1.0]]), 1.0)
    cycle, _ = find_cycles(
        family, np.array([[1.0, 1e-3]]), np.array([turns * np.pi]), np.ones((1, 2))
    )
    np.testing.assert_allclose(cycle.time, np.pi, rtol=1e-12)


def test_the_limit_cycle_of_the_airfoil_closes_in_an_independent_solver():
    wing, rest = (
        sl.models.aeroelastic(airspeed="12 m/s"),
        dict.fromkeys(("plunge", "plunge_rate", "pitch_rate"), 0.0),
    )
    ds = sl.attractors(wing, rest | {"pitch": "2 deg"}, every="0.25 s", method=FAST)
    assert ds.attractor_type.values.tolist() == ["limit_cycle"]
    period, scale = (
        ds.attractor_cycle.item(),
        np.array([np.ptp(ds[f"attractor_{name}"].values) for name in wing.states]),
    )
    start = np.array([ds[f"attractor_{name}"].values[0, 0] for name in wing.states])
    gaps = wing.values["pitch_gap"] * np.array([-1.0, 1.0])

    def moved(rtol):
        """The start after one period, from boundary to boundary: scipy's steps don't
        know of them.
        """
        t, y, met = 0.0, start, 0
        events = [lambda t, y, gap=gap: y[1] - gap for gap in gaps]
        for event in events:
            event.terminal = True
        while True:
            part = solve_ivp(
                wing.rhs, (t, period), y, "DOP853", rtol=rtol, atol=rtol * scale, events=events
            )
            t, y = part.t[-1], part.y[:, -1]
            if part.status == 0:
                return y, met
            # off the boundary: field and its first derivatives are bounded there
            met, step = met + 1, 1e-7 * period
            y, t = (
                y
                + step * np.array(wing.rhs(t + step / 2, y + step / 2 * np.array(wing.rhs(t, y)))),
                t + step,
            )

    (coarse, _), (fine, met) = moved(1e-9), moved(1e-12)
    error = np.abs((coarse - fine) / scale).max()  # that of the coarse one; the fine one is better
    assert 0 < error < 1e-6
    assert np.abs((fine - start) / scale).max() < error
    assert met == ds.attractor_contacts.item() == 4  # of the cycle, gone through once


def test_an_equilibrium_has_the_eigenvalues_of_the_jacobian_and_begins_to_oscillate_where_they_say(
    hopf,
):
    ds = hopf[1.0]
    rests = ds.isel(response=ds.response_type.values == "equilibrium")
    np.testing.assert_allclose(rests.response_mu, [-0.5, -0.25])
    np.testing.assert_allclose(
        rests.response_eigenvalue_real, np.stack([rests.response_mu] * 2, axis=1), rtol=1e-12
    )
    np.testing.assert_allclose(rests.response_eigenvalue_imag, [[2.0, -2.0]] * 2, rtol=1e-12)
    np.testing.assert_allclose(rests.response_exponent, rests.response_mu, rtol=1e-12)
    assert np.isnan(rests.response_multiplier_real).all()
    assert np.isnan(rests.response_cycle).all()
    assert ds.event_kind.values.tolist() == ["hopf"]
    assert abs(ds.event_mu.item()) < 1e-14
    assert (ds.type.sel(mu=0.0) == "unconverged").all(), (
        "at the bifurcation nothing decays exponentially"
    )


def test_answers_do_not_depend_on_the_time_between_looks(hopf):
    one, *others = hopf.values()
    for other in others:
        np.testing.assert_array_equal(other.type, one.type)
        np.testing.assert_array_equal(other.response_branch, one.response_branch)
        for name in (
            "response_cycle",
            "response_peak",
            "response_multiplier_real",
            "response_eigenvalue_real",
        ):
            np.testing.assert_allclose(other[name], one[name], rtol=1e-9, atol=1e-12)
        for name in ("response_x", "response_y"):  # the same points of it, whoever found it
            np.testing.assert_allclose(other[name], one[name], atol=1e-9)


def van_der_pol(mu):
    """Period and amplitude by an independent solver: from one maximum to the next on the cycle."""

    def turn(_, u):
        return u[1]

    turn.direction = -1
    run = solve_ivp(
        lambda _, u: [u[1], mu * (1 - u[0] ** 2) * u[1] - u[0]],
        (0, 120),
        [2.0, 0.0],
        "DOP853",
        events=turn,
        rtol=1e-13,
        atol=1e-14,
    )
    return run.t_events[0][-1] - run.t_events[0][-2], run.y_events[0][-1][0]


@pytest.mark.parametrize("mu", [1.0, 5.0])
def test_van_der_pol_agrees_with_an_independent_solver(mu):
    ds = sl.bifurcation_diagram(
        planar, {"mu": [mu]}, STARTS, every=0.7, values={"circle": 0.0}, method=FAST, periods=400
    )
    period, amplitude = van_der_pol(mu)
    assert ds.response_type.values.tolist() == ["limit_cycle"]
    assert ds.response_cycle.item() == pytest.approx(period, rel=1e-10)
    assert ds.response_peak.item() == pytest.approx(amplitude, rel=1e-10)
    if mu == 1.0:
        assert ds.response_cycle.item() == pytest.approx(6.6632868593, abs=2e-10)


def test_a_guess_at_several_turns_gives_one_turn():
    family = Stroboscope(planar, FAST, np.array([[1.0, 1.0, 1.0]]), 1.0)
    seen = returns(family, np.array([[1.0, 0.0]]), 50.0)
    assert seen.time[0] == pytest.approx(2 * np.pi, rel=1e-9)
    cycles, _ = find_cycles(family, np.array([[0.9, 0.1]]), np.array([6 * np.pi]), np.ones((1, 2)))
    assert cycles.time[0] == pytest.approx(2 * np.pi, rel=1e-12)


def test_an_unstable_equilibrium_is_found_and_captures_nothing():
    family = Stroboscope(planar, FAST, np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]), 1.0)
    near, scale = np.full((2, 2), 0.01), np.ones((2, 2))
    found = find_equilibria(family, near, scale)
    np.testing.assert_allclose(found.points[:, 0], 0.0, atol=1e-12)
    assert found.stable.tolist() == [False, True]
    assert captured(family, found, near, scale).tolist() == [False, True]


@pytest.mark.parametrize("every", [0.3, 2 * np.pi / 5, 4.0])
def test_attractors_are_named_whatever_the_time_between_looks(every):
    """A fifth of the cycle's period is a time at which the looks repeat."""
    ds = sl.attractors(planar, STARTS, every=every, method=FAST, periods=512)
    assert ds.attractor_type.values.tolist() == ["limit_cycle"]
    assert ds.attractor_cycle.item() == pytest.approx(2 * np.pi, rel=1e-12)
    assert ds.attractor_peak.item() == pytest.approx(1.0, rel=1e-12)
    assert ds.attractor_multiplier_real.values[0].tolist() == pytest.approx(
        [1.0, np.exp(-4 * np.pi)], rel=1e-6
    )
    assert ds.basin.values.tolist() == [0, 0]


def test_an_equilibrium_is_named_and_its_table_has_eigenvalues():
    ds = sl.attractors(planar.with_values(mu=-0.3), STARTS, every=1.0, method=FAST)
    assert ds.attractor_type.values.tolist() == ["equilibrium"]
    assert ds.attractor_eigenvalue_real.values.tolist() == [pytest.approx([-0.3, -0.3])]
    assert ds.attractor_exponent.item() == pytest.approx(-0.3)
    assert "equilibrium, peak" in sl.describe(ds)


# -- folds -----------------------------------------------------------------------------------------
@sl.system(states="x v", forced_at="frequency")
def oscillator(
    t, x, v, *, force=0.06, frequency=0.85 / (2 * np.pi), damping=0.1, quadratic=-1.0, cubic=0.0
):
    """The escape equation; Duffing's with ``quadratic`` = 0 and ``cubic`` = 1."""
    return v, force * sl.cos(
        2 * np.pi * frequency * t
    ) - damping * v - x - quadratic * x * x - cubic * x**3


def independent_fold(system, name, orbit, last, place):
    """Where y = P(y) and det(dP/dy - 1) = 0, by an independent solver and its variational equation,
    from an orbit at a value before it.
    """

    def turn(y, where):
        value = dict(system.values) | {name: where}

        def rates(t, u):
            x, v = u[:2]
            slope = np.array(
                [
                    [0.0, 1.0],
                    [
                        -1 - 2 * value["quadratic"] * x - 3 * value["cubic"] * x * x,
                        -value["damping"],
                    ],
                ]
            )
            drive = value["force"] * np.cos(2 * np.pi * value["frequency"] * t)
            rate = (
                drive
                - value["damping"] * v
                - x
                - value["quadratic"] * x * x
                - value["cubic"] * x**3
            )
            return np.concatenate([[v, rate], (slope @ u[2:].reshape(2, 2)).ravel()])

        u = solve_ivp(
            rates,
            (0, 1 / value["frequency"]),
            [*y, 1.0, 0.0, 0.0, 1.0],
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
        ).y[:, -1]
        return u[:2] - y, u[2:].reshape(2, 2) - np.eye(2)

    def condition(unknown):
        apart, slope = turn(unknown[:2], unknown[2])
        return [*apart, np.linalg.det(slope)]

    for left in (0.5, 0.2, 0.05, 0.01):  # the orbit moves by the square root of what is left
        where = place + left * (last - place)
        orbit = root(lambda y, where=where: turn(y, where), orbit, jac=True, tol=1e-12).x
    solution = root(condition, [*orbit, where], tol=1e-12)
    assert np.abs(solution.fun).max() < 1e-10
    return solution.x[2]


DUFFING = oscillator.with_values(quadratic=0.0, cubic=1.0, force=0.3)
ESCAPE = oscillator.with_values(quadratic=-1.0)


@pytest.mark.parametrize(
    ("system", "name", "values", "start", "follow"),
    [
        pytest.param(ESCAPE, "force", (0.05, 0.072, 12), (0.0, 0.0), True, id="escape_small"),
        pytest.param(ESCAPE, "force", (0.0455, 0.05, 10), (0.2, 0.44), False, id="escape_large"),
        pytest.param(
            DUFFING,
            "frequency",
            (1.5 / (2 * np.pi), 2.0 / (2 * np.pi), 6),
            (0.967, 1.512),
            True,
            id="duffing_upper",
        ),
    ],
)
@pytest.mark.slow
def test_a_fold_is_where_an_independent_solver_finds_it(system, name, values, start, follow):
    """The escape equation has two on one curve, at a force of 0.0688 and of 0.0472: each is one
    branch's end.
    """
    ds = sl.bifurcation_diagram(
        system, {name: values}, start, follow=follow, method=FAST, periods=1000
    )
    assert ds.event_kind.values.tolist() == ["fold"]
    place = ds[f"event_{name}"].item()
    responses = np.flatnonzero(ds.response_branch == ds.event_branch.item())
    last = ds.isel(
        response=responses[np.abs(ds[f"response_{name}"].values[responses] - place).argmin()]
    )
    exact = independent_fold(
        system,
        name,
        (last.response_x.values[0], last.response_v.values[0]),
        last[f"response_{name}"].item(),
        place,
    )
    print(place, exact, abs(place - exact))
    assert abs(place - exact) < 1e-9 * exact


def test_the_freeplay_cycle_of_the_wing_grows_towards_the_flutter_speed():
    """As the describing function says, which leaves the third harmonics out: the less of a cycle
    the freeplay is, the better it is.
    """
    speed = [13.0, 13.4]
    start = {"plunge": 0, "pitch": "2 deg", "plunge_rate": 0, "pitch_rate": 0}
    ds = sl.bifurcation_diagram(sl.models.aeroelastic(), {"airspeed": speed}, start, every="0.25 s")
    assert ds.response_type.values.tolist() == ["limit_cycle"] * 2
    seen = ds.output_maximum.sel(output="pitch").values
    told = [_first_harmonic(u) for u in speed]
    missed = seen / np.array(told) - 1
    assert (np.abs(missed) < 0.05 * 0.01 / seen).all()


def _first_harmonic(speed):
    """Amplitude of pitch at which the section, with the describing function of the freeplay for its
    spring, neither grows nor decays.
    """
    load = 1.225 * speed**2 * 0.135 * 6.28 * np.array([-1.0, -0.1 * 0.135])
    inertia = np.array([[12.4, 12.4 * 0.25 * 0.135], [12.4 * 0.25 * 0.135, 0.065]])
    damping = np.diag([27.4, 0.036]) - np.outer(load, [1 / speed, 1.1 * 0.135 / speed])

    def growth(amplitude):
        share = 0.01 / amplitude
        spring = 40.0 * (1 - 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2)))
        rows = -np.linalg.solve(
            inertia, np.hstack([np.diag([2840.0, spring]) - np.outer(load, [0.0, 1.0]), damping])
        )
        return np.linalg.eigvals(np.vstack([np.eye(4)[2:], rows])).real.max()

    low, high = 0.05, 5.0
    assert growth(low) > 0 > growth(high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(middle) > 0 else (low, middle)
    return low
