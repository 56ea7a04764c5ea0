"""Published systems with impacts against closed forms (tests/reference/laws_impact.csv,
laws_ball.csv).
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import impact_orbits
import saltus as sl
from saltus.analysis.closed.orbits import find_orbits
from saltus.errors import SaltusWarning
from saltus.flow.maps import Stroboscope
from saltus.language.evaluate import evaluate
from saltus.models import (
    ball_in_box,
    bouncing_ball,
    dropped_oscillator,
    falling_ball,
    impact_oscillator,
    relief_valve,
    rocking_block,
    thermostat,
)

ROWS = {}
for name in ("laws_impact", "laws_ball", "laws_friction", "laws_more"):
    with (Path(__file__).parents[2] / "reference" / f"{name}.csv").open() as file:
        ROWS |= {row["id"]: row["value"] for row in csv.DictReader(file)}
RECIPES = {"stiffness": 1.0, "damping": 0.1, "gap": 1.0, "restitution": 0.8}
RESONANT = {"stiffness": 1.0, "damping": 0.04, "gap": 0.2, "restitution": 0.7}
AT_REST = {"stiffness": 1.0, "damping": 0.0, "gap": 0.0}


def known(row):
    return float(ROWS[row])


def orbit(system, start, n=1):
    """The orbit of n periods near a state: a point of it and its multipliers."""
    map_, start = Stroboscope(system, sl.Taylor()), np.array([start], float)
    found = find_orbits(map_, start, np.array([n]), 1 + np.abs(start), np.array([map_.noise]))
    assert found.period.tolist() == [n]
    return found.points[0, 0], found.multipliers[0]


def fold(parameters, determinants):
    """Where s = det(M - 1) is 0: near a fold the parameter is a power series in s without a linear
    term.
    """
    s = np.array(determinants)
    return np.linalg.solve(np.stack([s**0, s**2, s**3, s**4], axis=1), parameters)[0]


# -- one impact in n periods -----------------------------------------------------------------------
@pytest.mark.parametrize("values", [RECIPES | {"force": 0.3, "frequency": 1.2}], ids=["1.2"])
def test_the_closed_form_is_a_motion_of_the_oscillator(values):
    for speed, start in impact_orbits.oscillator(**values):
        system = impact_oscillator(**values)
        run = sl.simulate(system, start, periods=1)
        assert run.contact_velocity.values == pytest.approx([speed], rel=1e-12)
        np.testing.assert_allclose([run.end_x, run.end_v], start, atol=1e-13)


def test_the_fold_of_the_recipes():
    """I01: in the amplitude of the force, just below the graze."""
    end, reach = known("I01"), 4e-8
    forces = end + reach * np.array([1, 0.75, 0.5, 0.25])
    determinants = []
    for force in forces:
        values = RECIPES | {"frequency": 1.0, "force": force}
        _, multipliers = orbit(
            impact_oscillator(**values), impact_orbits.oscillator(**values)[1][1]
        )
        determinants.append(np.prod(multipliers - 1).real)
    assert fold(forces, determinants) == pytest.approx(end, abs=1e-11)


@pytest.mark.parametrize("contact", [False, True])
@pytest.mark.parametrize(
    ("row", "values", "parameter", "inward"),
    [
        ("I03g", RECIPES | {"frequency": 1.2}, "force", 1),
        ("I22", RESONANT, "frequency", -1),
    ],
)
def test_grazes_of_the_response_without_contact(row, values, parameter, inward, contact):
    """Contact begins there."""
    values = {"force": 1.0} | values
    values[parameter] = known(row) * (1 + 1e-9 * (inward if contact else -inward))
    w = values["frequency"]
    z = values["force"] / (values["stiffness"] - w**2 + 1j * values["damping"] * w)
    start = (z.real, (1j * w * z).real)
    run = sl.simulate(impact_oscillator(**values), start, periods=1, samples=512)
    assert (run.sizes["contact"] > 0) == contact
    assert float(run.x.max()) == pytest.approx(values["gap"], abs=1e-4)


def test_the_saddle_and_the_stable_orbit_of_the_recipes():
    """I04m, I05: one is unstable, the other is what a start beside it settles to."""
    values = RECIPES | {"force": 0.3, "frequency": 1.2}
    (_, saddle), (_, stable) = impact_orbits.oscillator(**values)
    system = impact_oscillator(**values)
    _, multipliers = orbit(system, saddle)
    assert np.abs(multipliers).max() == pytest.approx(known("I04m"), rel=1e-13)
    found = sl.attractors(system, (stable[0] + 1e-3, stable[1]))
    assert found.attractor_period.values.tolist() == [1]
    point = [found.attractor_x.values[0, 0], found.attractor_v.values[0, 0]]
    run = sl.simulate(system, point, periods=1)
    assert run.contact_velocity.values == pytest.approx([known("I05")], rel=1e-11)
    assert run.contact_v_before.values == pytest.approx([known("I05")], rel=1e-11)
    assert run.contact_v.values.tolist() == (-0.8 * run.contact_v_before.values).tolist()
    assert run.contact_x.values.tolist() == run.contact_x_before.values.tolist() == [1.0]


def test_the_resonant_graze():
    """I07: over a period of the forcing the displacement doesn't depend on the velocity."""
    system = impact_oscillator(frequency=known("I07"), force=0.0)
    map_ = Stroboscope(system, sl.Taylor())
    _, monodromy = map_.tangent(np.zeros((1, 2)), np.array([1]))
    assert abs(monodromy[0, 0, 1]) < 1e-14


@pytest.mark.parametrize(
    ("row", "values", "n"),
    [
        ("I10", AT_REST | {"restitution": 0.8}, 1),
        ("I12", AT_REST | {"restitution": 0.5}, 1),
        ("I14", AT_REST | {"restitution": 0.8}, 3),
        ("I20", RESONANT, 1),
    ],
)
def test_where_orbits_with_one_impact_double_their_period(row, values, n):
    values = values | {"frequency": known(row)}
    speed, start = impact_orbits.oscillator(**values, n=n)[-1]
    system = impact_oscillator(**values)
    _, multipliers = orbit(system, start, n)
    # the product of the two is e^2 exp(-c n T)
    product = values["restitution"] ** 2 * math.exp(
        -values["damping"] * n * 2 * math.pi / values["frequency"]
    )
    np.testing.assert_allclose(np.sort(multipliers.real), [-1.0, -product], atol=1e-10)
    if row == "I10":
        run = sl.simulate(system, start, periods=1)
        assert run.contact_velocity.values == pytest.approx([known("I10v")], rel=1e-12)
        assert speed == pytest.approx(known("I10v"), rel=1e-12)


# -- chatter, rest, release ------------------------------------------------------------------------
def test_chatter_and_rest_of_the_oscillator():
    """C01 to C06: from rest on the stop, over a release and a whole chatter, to rest again."""
    system = impact_oscillator("chatter")
    run = sl.simulate(system, (0.2, 0.0), t_start=4.0, t_end=22.0)
    assert run.contact_kind.values[[0, 1, -1]].tolist() == ["release", "impact", "hold"]
    times = run.contact_time.values
    assert times[0] == pytest.approx(known("C01"), rel=1e-14)
    assert times[1] == pytest.approx(known("C02"), rel=1e-13)
    assert run.contact_velocity.values[1] == pytest.approx(known("C03"), rel=1e-12)
    assert run.contact_v_before.values[:2] == pytest.approx([0.0, known("C03")], rel=1e-12)
    struck = run.contact_kind.values == "impact"
    before, behind = run.contact_v_before.values, run.contact_v.values
    assert behind[struck].tolist() == (-0.6 * before[struck]).tolist()
    assert behind[~struck].tolist() == before[~struck].tolist()
    assert times[-1] == pytest.approx(known("C06"), rel=1e-13)
    assert (run.end_x.item(), run.end_v.item()) == (0.2, 0.0)


def test_the_end_of_a_chatter_under_a_constant_force():
    """C10: x'' + x = -f on a stop."""
    system = dropped_oscillator(mass=1.0, stiffness=1.0, gravity=0.5, restitution=0.7)
    run = sl.simulate(system, (0.0, 1.0), t_end=12.0)
    assert run.contact_kind.values[-1] == "hold"
    assert run.contact_time.values[-1] == pytest.approx(known("C10"), rel=1e-13)


def test_the_dropped_oscillator_of_siconos():
    run = sl.simulate(dropped_oscillator(), (1.0, 0.0), t_end=1.0)
    times = run.contact_time.values
    exact = [0.0049669839438886324, 0.014900882900775434, 0.094368469075293832]
    np.testing.assert_allclose(times[[0, 1, 9]], exact, rtol=1e-14)
    # each flight at speed v takes 2 atan(v w/g)/w
    w, g = math.sqrt(1e5), 9.81
    speed = math.sqrt(w**2 + 2 * g)
    flights = [2 * math.atan(0.9**n * speed * w / g) / w for n in range(1, 500)]
    assert run.contact_kind.values[-1] == "hold"
    assert times[-1] == pytest.approx(times[0] + math.fsum(flights), rel=1e-13)


@pytest.mark.parametrize(
    ("height", "gravity", "restitution"), [(10.0, 9.8, 0.9), (1.0, 9.81, 0.5), (1.0, 9.81, 0.0)]
)
def test_the_falling_ball(height, gravity, restitution):
    system = falling_ball(gravity=gravity, restitution=restitution)
    first = math.sqrt(2 * height / gravity)
    rest = first * (1 + restitution) / (1 - restitution)
    run = sl.simulate(system, (height, 0.0), t_end=1.1 * rest)
    times = run.contact_time.values
    powers = restitution ** np.arange(1, 8)
    exact = first * (1 + 2 * np.concatenate([[0.0], np.cumsum(powers)]))
    if restitution:
        np.testing.assert_allclose(times[:8], exact, rtol=1e-14)
    assert run.contact_kind.values[-1] == "hold"
    assert times[-1] == pytest.approx(rest, rel=1e-14)
    assert (run.end_x.item(), run.end_v.item()) == (0.0, 0.0)
    found = sl.impact_statistics(system, (height, 0.0), t_end=1.1 * rest)
    assert found["contacts"].values.tolist() == [1, 1]
    struck = found["contact_impulse_of_impacts"].values[0]
    speed = math.sqrt(2 * height * gravity)
    assert struck == pytest.approx(speed * (1 + restitution) / (1 - restitution), rel=1e-13)


def test_the_rocking_block():
    run = sl.simulate(rocking_block(), (0.1, 0.0), t_end=10.0)
    assert run.contact_time.values[0] == pytest.approx(known("K01"), rel=1e-14)
    assert run.contact_kind.values[-1] == "hold"
    assert run.contact_time.values[-1] == pytest.approx(known("K03"), rel=1e-13)


# -- no loss ---------------------------------------------------------------------------------------
@sl.system(states="x v")
def between(t, x, v, *, gap=1.0):
    """A free oscillator between two stops."""
    upper, lower = (
        sl.impact(x < gap, v, restitution=1.0),
        sl.impact(x > -gap, -v, restitution=1.0),
    )
    return v, -x, upper, lower


def test_backbones_of_rigid_stops():
    """M20: a stop at half the amplitude. M24: stops on both sides, below the amplitude 1.1."""
    free = impact_oscillator(damping=0.0, force=0.0, restitution=1.0)
    times = sl.simulate(free, (-2.0, 0.0), t_end=20.0).contact_time.values
    assert 2 * math.pi / (times[1] - times[0]) == pytest.approx(known("M20"), rel=1e-14)
    times = sl.simulate(between, (0.0, 1.1), t_end=20.0).contact_time.values
    assert 2 * math.pi / (times[2] - times[0]) == pytest.approx(known("M24"), rel=1e-14)


def test_impacts_without_loss_keep_the_energy():
    """Over some 2000 impacts, to what that many roundings may add up to at worst."""
    run = sl.simulate(between, (0.0, 1.1), t_end=4600.0, samples=2)
    impacts = int(run.events)
    assert impacts > 2000
    energy = run.end_x.item() ** 2 + run.end_v.item() ** 2
    assert abs(energy / 1.21 - 1) < 4 * impacts * 2.0**-52


# -- a ball on a table -----------------------------------------------------------------------------
def test_the_bounce_is_born():
    """B01a: below this amplitude the two orbits with an impact a period are gone."""
    end = known("B01a")
    amplitudes = end + 1e-5 * np.array([1, 0.75, 0.5, 0.25])
    determinants = []
    for amplitude in amplitudes:
        start = impact_orbits.ball_on_table(amplitude, 0.5)[0]
        _, multipliers = orbit(bouncing_ball(amplitude=amplitude), start)
        determinants.append(np.prod(multipliers - 1).real)
    assert fold(amplitudes, determinants) == pytest.approx(end, abs=1e-10)


@pytest.mark.parametrize(("row", "restitution"), [("B01b", 0.5), ("B04b", 0.0)])
def test_the_bounce_doubles_its_period(row, restitution):
    system = bouncing_ball(amplitude=known(row), restitution=restitution)
    start = impact_orbits.ball_on_table(known(row), restitution)[0]
    _, multipliers = orbit(system, start)
    np.testing.assert_allclose(np.sort(multipliers.real), [-1.0, -(restitution**2)], atol=1e-10)


def test_a_ball_without_rebound_rests_where_it_would_be_born():
    """At B04a it would begin where the table rises fastest, but there the table presses on."""
    amplitude = known("B04a")
    system = bouncing_ball(amplitude=amplitude * (1 + 1e-9), restitution=0.0)
    start = impact_orbits.ball_on_table(amplitude * (1 + 1e-9), 0.0)[0]
    run = sl.simulate(system, start, t_end=7.0)
    assert "hold" in run.contact_kind.values.tolist()


def thrown_off(amplitude, restitution, t_end):
    """A run from rest on the table, shortly before it throws the ball off."""
    start = math.asin(1 / amplitude) - 0.1
    state = (amplitude * math.sin(start), amplitude * math.cos(start))
    system = bouncing_ball(amplitude=amplitude, restitution=restitution)
    run = sl.simulate(system, state, t_start=start, t_end=t_end)
    assert run.contact_kind.values[0] == "release"
    assert run.contact_time.values[0] == pytest.approx(math.asin(1 / amplitude), rel=1e-14)
    return run


def test_the_longest_flight_without_rebound():
    """B10: a whole period. B11: from a smaller amplitude."""
    run = thrown_off(known("B10"), 0.0, 8.0)
    flight = run.contact_time.values[1] - run.contact_time.values[0]
    assert flight == pytest.approx(2 * math.pi, rel=1e-13)
    run = thrown_off(2.0, 0.0, 8.0)
    landing = run.contact_time.values[1]
    assert landing == pytest.approx(known("B11"), rel=1e-14)
    assert run.contact_kind.values[-1] == "release"
    assert run.contact_time.values[-1] - landing == pytest.approx(1.62433383146803, abs=1e-13)


def test_chatter_on_the_table():
    """B20a to B20d."""
    run = thrown_off(1.2, 0.5, 8.0)
    times, kinds = run.contact_time.values, run.contact_kind.values.tolist()
    assert times[1] == pytest.approx(known("B20a"), rel=1e-14)
    assert abs(run.contact_velocity.values[2]) == pytest.approx(known("B20b"), rel=1e-12)
    rest = kinds.index("hold")
    assert times[rest] == pytest.approx(known("B20c"), rel=1e-13)
    assert times[rest + 1] - times[rest] == pytest.approx(known("B20d"), rel=1e-13)
    start = {"start": (1.0, math.sqrt(1.2**2 - 1)), "t_start": math.asin(1 / 1.2)}
    found = sl.impact_statistics(bouncing_ball(), **start, t_end=8.0)
    chatter = found.isel(contact=0)
    assert chatter["contact_time"].item() == pytest.approx(known("B20a"), rel=1e-14)
    assert chatter["contact_exit_speed"].item() == pytest.approx(0.0, abs=1e-12)
    # thrown off once a period, always with the same velocity: the table bears its weight
    assert chatter["contact_impulse"].item() == pytest.approx(2 * math.pi, rel=1e-12)


def test_rest_on_a_moving_table_goes_on_as_if_it_stood():
    """The gap that rest keeps at zero is a difference of a state and a function of time: rounding
    in it mustn't rule the step, wherever rest begins.
    """
    for start in np.random.default_rng(1).uniform(-1.0, 0.9, 60):
        state = (1.2 * math.sin(start), 1.2 * math.cos(start))
        run = sl.simulate(bouncing_ball(), state, t_start=start, t_end=2.0, samples=40)
        assert run.status.item() == "ok"
        release = run.contact_time.values[run.contact_kind.values == "release"]
        assert release == pytest.approx([math.asin(1 / 1.2)], rel=1e-13)
        rests = run.time.values < release[0]
        table = 1.2 * np.sin(run.time.values[rests])
        np.testing.assert_allclose(run.x.values[rests], table, atol=1e-14)


def test_the_end_of_a_run_at_rest_is_a_start():
    """Rounding has put it on the wrong side of the table here and there."""
    drops = sl.simulate(bouncing_ball(), {"x": np.linspace(1.5, 4.0, 40), "v": 0.0}, periods=5)
    assert (drops.status == "ok").all()
    again = sl.simulate(bouncing_ball(), {"x": drops.end_x, "v": drops.end_v}, periods=1)
    assert (again.status == "ok").all()
    np.testing.assert_allclose(again.end_x.values, 0.0, atol=1e-13)
    np.testing.assert_allclose(again.end_v.values, 1.2, rtol=1e-13)
    with pytest.warns(SaltusWarning, match="beyond a stop"):
        below = sl.simulate(bouncing_ball(), {"x": [-1e-9, -1.0], "v": 1.2}, periods=1)
    assert (below.status == "invalid").all()


def test_chatter_on_the_table_is_an_attractor_that_forgets():
    found = sl.attractors(bouncing_ball(), (2.0, 0.0))
    assert found.attractor_period.values.tolist() == [1]
    multipliers = found.attractor_multiplier_real.values + found.attractor_multiplier_imag.values
    np.testing.assert_array_equal(multipliers, 0.0)
    exponents = sl.lyapunov(impact_oscillator("chatter"), (0.0, 0.0), periods=64)
    np.testing.assert_array_equal(exponents.lyapunov_exponent.values, -np.inf)


# -- a ball in a box -------------------------------------------------------------------------------
def test_the_longest_box():
    """B30."""
    end = known("B30")
    lengths = end - 1e-5 * np.array([1, 0.75, 0.5, 0.25])
    determinants = []
    for length in lengths:
        start = impact_orbits.ball_in_box(length, 0.6)[1][1]
        _, multipliers = orbit(ball_in_box(length=length), start)
        determinants.append(np.prod(multipliers - 1).real)
    assert fold(lengths, determinants) == pytest.approx(end, abs=1e-9)


def test_the_fast_orbit_in_a_box():
    """B30v, B30m."""
    speed, start = impact_orbits.ball_in_box(3.0, 0.6)[-1]
    assert speed == pytest.approx(known("B30v"), rel=1e-13)
    point, multipliers = orbit(ball_in_box(length=3.0), start)
    exact = [float(text) for text in ROWS["B30m"].split(";")]
    np.testing.assert_allclose(np.sort(multipliers.real), exact, rtol=1e-11)
    run = sl.simulate(ball_in_box(length=3.0), point, periods=3)
    assert run.sizes["contact"] == 6
    assert abs(run.end_v.item()) == pytest.approx(speed, rel=1e-12)


# -- relays, valves --------------------------------------------------------------------------------
def test_the_thermostat():
    run = sl.simulate(thermostat(), (15.0, 1.0), t_end=14.0)
    switched = run.contact_time.values[run.contact_kind.values != "crossing"]
    warm, cool = 10 * math.log(16 / 14.5), 10 * math.log(5.5 / 4)
    first = 10 * math.log(23 / 14.5)
    exact = [first, first + cool, first + cool + warm, first + 2 * cool + warm]
    np.testing.assert_allclose(switched[:4], exact, rtol=1e-14)
    assert exact[:3] == pytest.approx([4.6134556650262, 7.7979929762116, 8.7823937043441])


def test_the_hopf_bifurcation_of_the_relief_valve():
    """The Jacobian at the open valve has a pair of imaginary eigenvalues."""
    system = relief_valve(flow=8.4911176351833271)
    values = system.values
    lift = np.roots([1.0, values["preload"], 0.0, -(values["flow"] ** 2)])
    lift = lift[(abs(lift.imag) < 1e-12) & (lift.real > 0)].real[0]
    rest = {"x": lift, "v": 0.0, "pressure": lift + values["preload"]}
    np.testing.assert_allclose(system.rhs(0.0, np.array([*rest.values()])), 0.0, atol=1e-12)
    bits = [bool(number == 0) for number in range(len(system.guards))]
    rows = [evaluate(row, states=rest, values=values, bits=bits) for row in system.jacobian]
    pair = np.linalg.eigvals(np.array(rows, float))
    pair = pair[pair.imag > 0][0]
    assert pair.real == pytest.approx(0.0, abs=1e-13)
    assert pair.imag == pytest.approx(3.0907088479743406, rel=1e-13)


@pytest.mark.parametrize(("flow", "impacts"), [(7.557210972 + 1e-6, 0), (7.557210972 - 1e-6, 1)])
def test_the_limit_cycle_of_the_relief_valve_reaches_the_seat(flow, impacts):
    run = sl.simulate(relief_valve(flow=flow), (0.1, 0.0, 15.0), t_end=1500.0, samples=2)
    late = run.contact_time.values > 1000.0
    assert bool(late.any()) == bool(impacts)
