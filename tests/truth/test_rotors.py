"""A rotor that starts at rest and rubs its stator: circles against their algebraic equations, a
partial rub against SciPy mode by mode, and every spelling of the contact against another.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl

REST = (0.0, 0.0, 0.0, 0.0)


def rotor(**values):
    return sl.models.jeffcott_rotor(**values)


def radius(run):
    return float(np.hypot(run.end_x, run.end_y))


def unbalance(system):
    """Mass, damping, stiffness, angular speed and force of the unbalance."""
    v = system.values
    w = 2 * np.pi * v["speed"]
    return v["mass"], v["damping"], v["stiffness"], w, v["mass"] * v["eccentricity"] * w**2


@pytest.mark.parametrize("speed", ["600 rpm", "1200 rpm", "4500 rpm"])
def test_without_contact_the_rotor_whirls_as_an_oscillator_driven_by_its_unbalance(speed):
    system = rotor(speed=speed)
    m, c, k, w, force = unbalance(system)
    run = sl.simulate(system, REST, periods=400, samples=1)
    assert radius(run) == pytest.approx(force / abs(k - m * w**2 + 1j * c * w), rel=1e-11)


@pytest.mark.parametrize("speed", ["1500 rpm", "1800 rpm"])
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_full_rub_is_the_circle_of_its_quadratic(speed, friction):
    system = rotor(speed=speed, friction=friction)
    m, c, k, w, force = unbalance(system)
    stator, gap = system.values["stator_stiffness"], system.values["gap"]
    along = np.array([k - m * w**2 + stator, -stator * gap])
    across = np.array([c * w + friction * stator, -friction * stator * gap])
    circles = np.roots(np.polymul(along, along) + np.polymul(across, across) - [0, 0, force**2])
    run = sl.simulate(system, REST, periods=400, samples=1)
    assert radius(run) == pytest.approx(circles[circles > gap].item(), rel=1e-11)


def by_pieces(system, t_end):
    """The motion from rest by DOP853, each piece to its own contact."""
    v = system.values
    m, c, k, w, force = unbalance(system)

    def rates(rubs):
        def rate(t, y):
            r = np.hypot(y[0], y[1])
            n = v["stator_stiffness"] * (1 - v["gap"] / r) if rubs else 0.0
            fx, fy = n * (y[0] - v["friction"] * y[1]), n * (y[1] + v["friction"] * y[0])
            fx, fy = fx + c * y[2] + k * y[0], fy + c * y[3] + k * y[1] + m * v["gravity"]
            return y[2], y[3], (force * np.cos(w * t) - fx) / m, (force * np.sin(w * t) - fy) / m

        return rate

    def gap(_t, y):
        return np.hypot(y[0], y[1]) - v["gap"]

    t, y, rubs, times = 0.0, np.zeros(4), False, []
    gap.terminal = True
    while t < t_end:
        gap.direction = -1 if rubs else 1
        part = solve_ivp(rates(rubs), (t, t_end), y, "DOP853", events=gap, rtol=1e-13, atol=1e-18)
        t, y = part.t[-1], part.y[:, -1]
        times += part.t_events[0].tolist()
        rubs = not rubs
    return np.array(times), y


def test_a_partial_rub_has_the_contacts_and_the_end_of_an_independent_solver():
    system = rotor(speed="1700 rpm", gravity="9.81 m/s^2")
    run = sl.simulate(system, REST, t_end=0.6)
    times, end = by_pieces(system, 0.6)
    assert len(times) > 10
    np.testing.assert_allclose(run.contact_time, times, atol=1e-10)
    found = [run[f"end_{name}"].item() for name in system.states]
    np.testing.assert_allclose(found, end, rtol=1e-8, atol=1e-9)


def test_energy_of_a_partial_rub_is_balanced():
    system = rotor(speed="1700 rpm", gravity="9.81 m/s^2")
    table = sl.energy_balance(system, REST, periods=8, **sl.models.energy("jeffcott_rotor"))
    assert abs(table.residual).max() < 1e-13 * abs(table.supplied).max()


# -- spellings of one contact ----------------------------------------------------------------------
def _law(x, y, k, d):
    return sl.clearance(x, y, stiffness=k, gap=d)


def _piece(x, y, k, d):
    r = sl.hypot(x, y)
    n = sl.piecewise((k * (r - d) / r, r > d), otherwise=0)
    return n * x, n * y


def _literature(x, y, k, d):
    r = sl.hypot(x, y)
    n = sl.piecewise((k * (1 - d / r), d < r), otherwise=0)
    return n * x, n * y


def _of_parts(x, y, k, d):
    r = sl.hypot(x, y)
    n = sl.piecewise((k * (r - d), r / d > 1), otherwise=0)
    return n * x / r, n * y / r


def _largest(x, y, k, d):
    r = sl.hypot(x, y)
    n = sl.max(k * (1 - d / r), 0)
    return n * x, n * y


def _freeplay(x, y, k, d):
    r, force = sl.hypot(x, y), sl.freeplay(sl.hypot(x, y), stiffness=k, gap=d)
    return force * (x / r), force * (y / r)


def _angle(x, y, k, d):
    force, angle = sl.hertz(sl.hypot(x, y) - d, stiffness=k, exponent=1), sl.atan2(y, x)
    return force * sl.cos(angle), force * sl.sin(angle)


def _squares(x, y, k, d):
    r = sl.hypot(x, y)
    n = sl.piecewise((k * (r - d) / r, x * x + y * y > d**2), otherwise=0)
    return n * x, n * y


SPELLINGS = (
    _law, _piece, _literature, _of_parts, _largest, _freeplay, _angle
)  # fmt: skip


def spelt(law):
    def rates(t, x, y, u, w, *, k=20.0, d=0.5, c=0.2):
        fx, fy = law(x, y, k, d)
        return u, w, sl.cos(1.3 * t) - c * u - x - fx, 0.7 * sl.sin(1.3 * t) - c * w - y - fy

    return sl.system(states="x y u w")(rates)


@pytest.fixture(scope="module")
def squares():
    """The end of a motion whose boundary is regular as it is written."""
    run = sl.simulate(spelt(_squares), REST, t_end=20.0)
    return run.contact_time.values, np.array([run[f"end_{name}"].item() for name in "xyuw"])


@pytest.mark.parametrize("law", SPELLINGS)
def test_every_spelling_starts_at_rest_and_gives_the_same_motion(law, squares):
    times, end = squares
    run = sl.simulate(spelt(law), REST, t_end=20.0)
    assert run.status.item() == "ok"
    np.testing.assert_allclose([run[f"end_{name}"].item() for name in "xyuw"], end, atol=1e-11)
    assert np.abs(run.contact_time.values - times[:, None]).min(axis=1).max() < 1e-12


@pytest.mark.parametrize("method", [sl.ODE45(1e-10, 1e-13), sl.RK4(1e-3)])
def test_other_methods_start_at_rest(method, squares):
    run = sl.simulate(spelt(_piece), REST, t_end=20.0, method=method)
    np.testing.assert_allclose(
        [run[f"end_{name}"].item() for name in "xyuw"], squares[1], atol=1e-6
    )


@pytest.mark.parametrize("gap", [0.0, -0.1])
def test_a_rotor_without_clearance_is_pressed_everywhere(gap):
    """It is one mode; an interference only adds a force towards the middle."""
    start = (0.2, 0.1, 0.0, 0.3)

    def rates(t, s):
        x, y, u, w = s
        n = 20 * (1 - gap / np.hypot(x, y))
        return (
            u,
            w,
            np.cos(1.3 * t) - 0.2 * u - x - n * x,
            0.7 * np.sin(1.3 * t) - 0.2 * w - y - n * y,
        )

    run = sl.simulate(spelt(_piece).with_values(d=gap), start, t_end=5.0)
    exact = solve_ivp(rates, (0, 5), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    np.testing.assert_allclose([run[f"end_{name}"].item() for name in "xyuw"], exact, atol=1e-9)
    assert run.contact_time.size == 0


def test_a_rigid_ring_is_met_from_its_middle():
    """A ball leaves the middle with the speed (3, 4), and meets the ring head-on: at R/v, and every
    2R/v times 1/e longer than before.
    """

    @sl.system(states="x y u w")
    def ball(t, x, y, u, w, *, ring=0.5, e=0.8):
        r = sl.hypot(x, y)
        hit = sl.impact(r < ring, (x * u + y * w) / r, restitution=e, inertia={"u": 1.0, "w": 1.0})
        return u, w, 0, 0, hit

    run = sl.simulate(ball, (0.0, 0.0, 3.0, 4.0), t_end=0.7)
    np.testing.assert_allclose(
        run.contact_time, [0.1, 0.1 + 0.2 / 0.8, 0.35 + 0.2 / 0.64], rtol=1e-14
    )


def test_speed_of_a_contact_is_that_of_the_distance():
    """On a line, x = cos(t): the circle with the radius 0.8 is crossed with the speed 0.6."""

    @sl.system(states="x v y s", units={"x": "m", "v": "m/s", "y": "m"})
    def line(t, x, v, y, s, *, d="0.8 m", k="1 1/s^2"):
        return v, -k * x, 0, sl.piecewise((1, sl.hypot(x, y) > d), otherwise=0)

    run = sl.simulate(line, (1.0, 0.0, 0.0, 0.0), t_end=20.0)
    assert run.smallest_contact_speed.item() == pytest.approx(0.6, rel=1e-13)
    assert run.smallest_contact_speed.attrs["units"] == "m/s"
    touch = run.contact_time.values
    np.testing.assert_allclose(np.abs(np.cos(touch)), 0.8, rtol=1e-13)
