"""Lyapunov exponents: published orbits, closed forms, sum rules, finite differences."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from function_maps import FunctionFlow, FunctionMap
from jumps import jumping
from saltus.analysis.lyapunov.spectrum import kind_of, spectrum
from saltus.errors import SaltusWarning
from saltus.flow.maps import Stroboscope

ORBITS = list(csv.DictReader((Path(__file__).parents[1] / "reference" / "orbits.csv").open()))
#: Minus zeta omega_n, and twice that: the sum of the exponents of the rig.
HALF, SUM = -0.942477796076938, -1.884955592153876
#: The largest exponent of a chaotic motion of the rig, case c at 5 Hz: found by `attractors` below.
CHAOTIC = {"contact_stiffness": 2.89e7, "frequency": 5.0}


def lyapunov_of(map_, start, count=4000, transient=100):
    return spectrum(FunctionFlow(map_), np.atleast_2d(np.asarray(start, float)), count, transient)


def drawn(count, size=1, seed=1):
    return np.random.default_rng(seed).random((count, size))


# -- the rig ---------------------------------------------------------------------------------------
def test_published_orbits_have_exactly_their_exponents():
    """All orbits in one batch, each with its own force, frequency, gaps and stiffness."""
    columns = {
        "force": "p_N",
        "frequency": "f_Hz",
        "lower_gap": "j1_m",
        "upper_gap": "j2_m",
        "contact_stiffness": "Kc_N_per_m",
    }
    values = {
        name: np.array([float(row[column]) for row in ORBITS]) for name, column in columns.items()
    }
    start = {
        "x": [float(row["x0_m"]) for row in ORBITS],
        "v": [float(row["v0_m_per_s"]) for row in ORBITS],
    }
    ds = sl.lyapunov(sl.models.delangre("c"), start, values=values, periods=128, transient=64)
    assert ds["kind"].values.tolist() == ["periodic"] * len(ORBITS)
    assert ds["response_period"].values.tolist() == [int(row["period_in_T"]) for row in ORBITS]
    complex_pairs = np.array(
        ["j" in row["floquet_multipliers"] or "i" in row["floquet_multipliers"] for row in ORBITS]
    )
    assert complex_pairs.all()
    published = np.array([float(row["LLE_per_s"]) for row in ORBITS])
    # printed to 14 digits
    assert np.abs(ds["lyapunov_exponent"].values[:, 0] - published).max() < 2e-12
    assert np.abs(ds["lyapunov_exponent"].values - HALF).max() < 1e-12
    assert (np.abs(ds["lyapunov_exponent"].values - HALF) <= ds["lyapunov_error"].values).all()
    assert np.abs(ds["exponent_sum"].values - SUM).max() < 1e-12
    assert np.abs(ds["mean_divergence"].values - SUM).max() < 1e-14
    assert ds["flow_lyapunov_exponent"].values[:, 0].tolist() == [0.0] * len(ORBITS)


def test_growth_along_an_orbit_converges_to_its_exponents():
    """The exact values replace means whose statistics hold them."""
    row = ORBITS[0]
    rig = sl.models.delangre("a", force=4.0, frequency=16.0)
    ds = sl.lyapunov(
        rig, (float(row["x0_m"]), float(row["v0_m_per_s"])), periods=1000, transient=50
    )
    last = ds.isel(trajectory=0, running=-1)
    assert (last["running_low"] <= HALF).all()
    assert (last["running_high"] >= HALF).all()
    assert abs(float(last["running_exponent"].sum()) - SUM) < 1e-10


@pytest.fixture(scope="module")
def chaos():
    rig = sl.models.delangre("c").with_values(**CHAOTIC)
    return rig, sl.lyapunov(
        rig, [(0.32e-3, 0.0), (0.0, 0.0), (0.1e-3, 0.01)], periods=1500, transient=200
    )


@pytest.mark.slow
def test_the_chaotic_motion_of_the_rig(chaos):
    """Stiff contacts; typed as by `attractors`, and the exponent as its one-direction method has
    it.
    """
    rig, ds = chaos
    other = sl.attractors(rig, [(0.32e-3, 0.0)], periods=500).isel(attractor=0)
    assert other["attractor_type"].item() == "chaotic"
    assert ds["kind"].values.tolist() == ["chaotic"] * 3
    error = math.hypot(float(other["attractor_exponent_error"]), float(ds["lyapunov_error"][0, 0]))
    assert (
        abs(float(ds["lyapunov_exponent"][0, 0]) - float(other["attractor_exponent"])) < 4 * error
    )
    assert np.ptp(ds["lyapunov_exponent"].values[:, 0]) < 5 * ds["lyapunov_error"].values.max()


def test_the_sum_of_exponents_on_a_chaotic_motion(chaos):
    _, ds = chaos
    assert np.abs(ds["exponent_sum"].values - SUM).max() < 1e-10
    assert np.abs(ds["mean_divergence"].values - SUM).max() < 1e-13
    flow = ds["flow_lyapunov_exponent"].values
    assert flow[:, 1].tolist() == [0.0] * 3
    assert (np.diff(flow, axis=1) < 0).all()


def test_results_depend_neither_on_the_batch_nor_on_threads(chaos):
    rig, ds = chaos
    alone = sl.lyapunov(rig, [(0.0, 0.0)], periods=1500, transient=200, threads=1)
    for name in ("lyapunov_exponent", "lyapunov_error", "mean_divergence", "running_exponent"):
        assert alone[name].values[0].tobytes() == ds[name].values[1].tobytes(), name


def test_groups_that_fit_in_memory_are_computed_alike(monkeypatch):
    rig = sl.models.delangre("c").with_values(**CHAOTIC)
    starts = np.stack([np.linspace(0, 1e-3, 5), np.zeros(5)], axis=1)
    whole = sl.lyapunov(rig, starts, periods=100, transient=50)
    monkeypatch.setattr("saltus.analysis.lyapunov.exponents.GROUP", 1024 * 6 * 2)
    assert sl.lyapunov(rig, starts, periods=100, transient=50).identical(whole)


def test_ode45_has_the_exponents_of_the_orbit_to_its_tolerance():
    ds = sl.lyapunov(
        sl.models.delangre("a", force=4.0, frequency=16.0),
        (3.344e-3, 0.4256),
        flow=sl.ODE45(1e-8, 1e-11),
        periods=500,
        transient=200,
    )
    assert ds["kind"].item() == "periodic"
    assert np.abs(ds["lyapunov_exponent"].values - HALF).max() < 1e-6
    assert (np.abs(ds["lyapunov_exponent"].values - HALF) <= ds["lyapunov_error"].values).all()


@pytest.mark.parametrize(("share", "near"), [(1 - 1e-4, 1), (1 + 1e-4, 1), (0.9, 0), (1.5, 0)])
def test_an_orbit_that_nearly_grazes_is_flagged(share, near):
    """A linear rig: its amplitude is a closed form; the upper gap is put at a share of it. Below,
    contact is just made (softly).
    """
    rig = sl.models.delangre("a", cubic=0.0, frequency=16.0, lower_gap=1.0, contact_stiffness=10.0)
    w, wn = 2 * math.pi * 16.0, 2 * math.pi * 5.0
    amplitude = 4.0 * (1 - 18 / w**2) / 3.0 / math.hypot(wn**2 - w**2, 2 * 0.03 * wn * w)
    ds = sl.lyapunov(rig, periods=200, transient=400, values={"upper_gap": share * amplitude})
    assert ds["kind"].item() == "periodic"
    assert ds["near_graze"].item() == near
    assert ds["grazes"].item() == 0
    assert abs(ds["smallest_gap_margin"].item() / amplitude - abs(1 - share)) < 1e-4


# -- maps ------------------------------------------------------------------------------------------
def skew_tent(a):
    return FunctionMap(
        lambda z: np.where(z < a, z / a, (1 - z) / (1 - a)),
        "x",
        lambda z: np.where(z < a, 1 / a, -1 / (1 - a))[:, :, None],
    )


@pytest.mark.parametrize("a", [0.3, 0.45])
def test_skew_tent_map_and_its_intervals(a):
    """Uniform density: -a ln a - (1-a) ln(1-a), and independent iterates of known variance."""
    found = lyapunov_of(skew_tent(a), drawn(60))
    exact = -a * math.log(a) - (1 - a) * math.log(1 - a)
    spread = abs(math.log(1 / a) - math.log(1 / (1 - a))) * math.sqrt(a * (1 - a) / 4000)
    assert abs(found.exponents.mean() - exact) < 4 * spread / math.sqrt(60)
    assert found.errors.mean() == pytest.approx(spread, rel=0.05)
    inside = (np.abs(found.exponents - exact) <= found.half_width).sum()
    assert inside >= 52  # 57 are expected; 51 or fewer once in 100 draws
    assert found.kinds == ["chaotic"] * 60


@pytest.mark.parametrize("b", [0.5, 0.3])
def test_lozi_map_sum_is_the_logarithm_of_b(b):
    """(x, y) -> (1 - 1.7 |x| + y, b x): the determinant of its derivative is -b everywhere."""

    def derivative(z):
        one = np.ones(len(z))
        return np.stack(
            [
                np.stack([-1.7 * np.sign(z[:, 0]), one], axis=1),
                np.stack([b * one, 0 * one], axis=1),
            ],
            axis=1,
        )

    map_ = FunctionMap(
        lambda z: np.stack([1 - 1.7 * np.abs(z[:, 0]) + z[:, 1], b * z[:, 0]], axis=1),
        "x y",
        derivative,
    )
    found = lyapunov_of(map_, 0.1 * drawn(4, 2))
    assert found.kinds == ["chaotic"] * 4
    assert np.abs(found.exponents.sum(axis=1) - math.log(b)).max() < 1e-13
    assert np.abs(found.volume - math.log(b)).max() < 1e-13


def test_henon_and_logistic_maps():
    henon = FunctionMap(
        lambda z: np.stack([1 - 1.4 * z[:, 0] ** 2 + z[:, 1], 0.3 * z[:, 0]], axis=1),
        "x y",
        lambda z: np.stack(
            [np.stack([-2.8 * z[:, 0], np.ones(len(z))], axis=1), np.tile([0.3, 0.0], (len(z), 1))],
            axis=1,
        ),
    )
    found = lyapunov_of(henon, 0.1 * drawn(8, 2), 10_000)
    # Sprott (2003), appendix A
    assert abs(found.exponents[:, 0].mean() - 0.41922) < 4 * found.errors[:, 0].mean() / math.sqrt(
        8
    )
    assert found.exponents.sum(axis=1) == pytest.approx(math.log(0.3), abs=1e-12)
    logistic = FunctionMap(
        lambda z: 3.2 * z * (1 - z), "x", lambda z: (3.2 * (1 - 2 * z))[:, :, None]
    )
    found = lyapunov_of(logistic, [0.4])
    assert found.kinds == ["periodic"]
    assert found.orbits[0].period == 2
    # multiplier 4 + 2 r - r^2
    assert found.exponents[0, 0] == pytest.approx(math.log(0.16) / 2, abs=1e-13)


def test_a_constant_matrix_has_the_logarithms_of_its_eigenvalues_whatever_the_units():
    """Arnold's cat map, its second state in thousandths: +- ln of the golden section squared; the
    frame is aligned, so no statistics.
    """
    unit = np.array([1.0, 1e-3])
    matrix = np.array([[2.0, 1.0], [1.0, 1.0]]) * unit[:, None] / unit
    cat = FunctionMap(
        lambda z: (z @ matrix.T) % unit, "x y", lambda z: np.broadcast_to(matrix, (len(z), 2, 2))
    )
    found = lyapunov_of(cat, drawn(2, 2) * unit, 500)
    golden = 2 * math.log((1 + math.sqrt(5)) / 2)
    assert np.abs(found.exponents - [golden, -golden]).max() < 1e-13
    assert found.kinds == ["chaotic"] * 2


def test_a_rigid_rotation_is_quasi_periodic_and_no_orbit_is_called_chaotic():
    angle = math.pi * (math.sqrt(5) - 1)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def derivative(z):
        square = (z**2).sum(axis=1)[:, None, None]
        return square**-0.25 * (turn @ (np.eye(2) - 0.5 * z[:, :, None] * z[:, None, :] / square))

    map_ = FunctionMap(
        lambda z: (z @ turn.T) * (z**2).sum(axis=1)[:, None] ** -0.25, "x y", derivative
    )
    found = lyapunov_of(map_, 0.5 + drawn(6, 2), 1000)
    assert found.kinds == ["quasi_periodic"] * 6
    # lengths in units of slightly unequal ranges
    bound = np.abs(np.log(found.growth.scale[:, 0] / found.growth.scale[:, 1])) / 1000
    assert (np.abs(found.exponents[:, 0]) <= bound + 1e-12).all()
    # the radius goes to its square root
    assert (np.abs(found.exponents[:, 1] + math.log(2)) <= bound + 1e-12).all()


@pytest.mark.parametrize(("late", "kind"), [(0.5, "chaotic"), (-0.05, "unclear")])
def test_a_motion_that_was_chaotic_only_at_first_is_not_called_chaotic(late, kind):
    """A mean far above zero, of growth that has ended in the second half."""
    rates = 0.5 + drawn(2000, 1) - 0.5
    rates[1200:] += late - 0.5
    assert kind_of(rates, np.array([0.01]), forced=True) == kind


def test_an_orbit_that_is_still_approached_slowly_is_recognised():
    """The logistic map at 2.998: multiplier -0.998; after 3100 iterates the distance is far above
    rounding.
    """
    logistic = FunctionMap(
        lambda z: 2.998 * z * (1 - z), "x", lambda z: (2.998 * (1 - 2 * z))[:, :, None]
    )
    found = lyapunov_of(logistic, [0.3], 3000)
    assert abs(found.growth.segment.points[0, -1, 0] - found.orbits[0].points[0, 0]) > 1e-5
    assert found.kinds == ["periodic"]
    assert found.exponents[0, 0] == pytest.approx(math.log(0.998), abs=1e-12)


def test_deviations_that_grow_like_time_are_not_chaos():
    """Turned the faster the larger the radius, without friction: a deviation grows like n, and
    ln(n) / n looks positive at first.
    """

    def image(z):
        angle = 1.0 + 30.0 * (z**2).sum(axis=1)
        return np.stack(
            [
                z[:, 0] * np.cos(angle) - z[:, 1] * np.sin(angle),
                z[:, 0] * np.sin(angle) + z[:, 1] * np.cos(angle),
            ],
            axis=1,
        )

    def derivative(z):
        angle = 1.0 + 30.0 * (z**2).sum(axis=1)
        turn = np.stack(
            [
                np.stack([np.cos(angle), -np.sin(angle)], axis=1),
                np.stack([np.sin(angle), np.cos(angle)], axis=1),
            ],
            axis=1,
        )
        w = image(z)
        return turn + 60.0 * np.stack([-w[:, 1], w[:, 0]], axis=1)[:, :, None] * z[:, None, :]

    found = lyapunov_of(FunctionMap(image, "x y", derivative), 0.5 + 0.5 * drawn(8, 2), 300, 0)
    assert (found.exponents[:, 0] > 0.02).all()
    assert "chaotic" not in found.kinds


def test_a_trajectory_that_runs_away_has_no_exponents():
    runs = FunctionMap(lambda z: 3.0 * z**3, "x", lambda z: (9.0 * z**2)[:, :, None])
    found = lyapunov_of(runs, [2.0], 200)
    assert np.isnan(found.exponents).all()
    assert found.kinds == ["unclear"]


def test_a_transient_that_leaves_for_an_orbit_has_the_orbit_s_exponents():
    """r = 3.83: chaotic for hundreds of iterates from some starts, then period 3."""
    logistic = FunctionMap(
        lambda z: 3.83 * z * (1 - z), "x", lambda z: (3.83 * (1 - 2 * z))[:, :, None]
    )
    found = lyapunov_of(logistic, drawn(40), 2000, 0)
    assert set(found.kinds) == {"periodic"}
    assert np.ptp(found.exponents) < 1e-10
    assert found.running.mean[:, 0, 10].max() > 0.1  # some began chaotic


# -- flows without forcing -------------------------------------------------------------------------
@sl.system(states="x y z")
def butterfly(t, x, y, z, *, sigma=10.0, rho=28.0, beta=8 / 3, a=0.2, b=0.2, c=5.7, band=0.0):
    """Lorenz's equations for band = 0, Roessler's for band = 1; the trace of the Jacobian depends
    on the state.
    """
    lorenz = sigma * (y - x), x * (rho - z) - y, x * y - beta * z
    roessler = -y - z, x + a * y, b + z * (x - c)
    return tuple(
        (1 - band) * one + band * other for one, other in zip(lorenz, roessler, strict=True)
    )


FINE = sl.ODE45(1e-9, 1e-11)


def test_lorenz_and_roessler_have_their_published_exponents():
    """0.9056, 0, -14.5723 and 0.0714, 0, -5.3943: Sprott, Chaos and Time-Series Analysis (2003),
    appendix A.
    """
    start = [(1.0, 1.0, 20.0)] * 4 + [(1.0, 1.0, 0.0)] * 4
    starts = np.array(start) + 0.1 * drawn(8, 3)
    for chosen, band, every, published in (
        (slice(4), 0.0, 0.75, (0.9056, 0.0, -14.5723)),
        (slice(4, 8), 1.0, 2.0, (0.0714, 0.0, -5.3943)),
    ):
        ds = sl.lyapunov(
            butterfly, starts[chosen], flow=FINE, every=every, periods=750, values={"band": band}
        )
        assert ds["kind"].values.tolist() == ["chaotic"] * 4
        value, error = ds["lyapunov_exponent"].values, ds["lyapunov_error"].values
        assert (np.abs(value - published) < 4 * error + 5e-5).all()
        assert (np.abs(value.mean(axis=0) - published) < 2.5 * error.mean(axis=0) / 2 + 5e-5).all()
        # the zero of the flow converges like 1 / time
        assert np.abs(value[:, 1]).max() < 3 / (750 * every)
        assert np.abs(ds["exponent_sum"] - ds["mean_divergence"]).max() < 1e-5  # ode45's own error
        assert ds["flow_lyapunov_exponent"].values.tolist() == value.tolist()


@pytest.mark.slow
def test_other_motions_of_the_lorenz_system():
    """An equilibrium at rho = 10 has the eigenvalues of the Jacobian; at 160 there is a cycle."""
    ds = sl.lyapunov(
        butterfly,
        (1.0, 1.0, 20.0),
        flow=FINE,
        every=0.5,
        periods=1000,
        values={"rho": [10.0, 160.0]},
    )
    assert ds["kind"].values.tolist() == ["equilibrium", "limit_cycle"]
    x = math.sqrt(8 / 3 * 9)
    rates = np.linalg.eigvals(np.array([[-10, 10, 0], [1, -1, -x], [x, x, -8 / 3]])).real
    assert np.abs(ds["lyapunov_exponent"].values[0] - np.sort(rates)[::-1]).max() < 1e-5
    assert abs(ds["lyapunov_exponent"].values[1, 0]) < 5e-3
    assert ds["lyapunov_exponent"].values[1, 1] < -0.5
    assert ds["response_period"].values.tolist() == [0, 0]


def test_a_freeplay_wing_at_rest_has_the_eigenvalues_of_its_jacobian():
    """Two pairs of complex eigenvalues: growth swings about their real parts, and its means are no
    exponents yet.
    """

    @sl.system(states="h a vh va")
    def wing(t, h, a, vh, va, *, speed=10.0, free=math.pi / 180):
        angle = a + vh / speed + 0.03 * va / speed
        lift = 0.6231645 * speed**2 * angle
        force, moment = (
            -lift - 2800 * h - 27 * vh,
            0.03 * lift - sl.freeplay(a, stiffness=40.0, gap=free) - 0.18 * va,
        )
        return vh, va, (0.065 * force - 0.4 * moment) / 0.62, (12 * moment - 0.4 * force) / 0.62

    start, speeds = (0.0, math.radians(4), 0.0, 0.0), [8.0, 12.0]
    ds = sl.lyapunov(wing, start, every=0.2, periods=300, transient=200, values={"speed": speeds})
    for one, speed in zip(ds["lyapunov_exponent"].values, speeds, strict=True):
        moving = wing.with_values(speed=speed)
        run = sl.simulate(moving, start, t_end=60.0)
        place = np.array([run[f"end_{name}"].item() for name in wing.states])
        steps = 1e-5 * np.eye(4)  # the law is linear about it
        matrix = np.array(
            [
                np.subtract(moving.rhs(0, place + step), moving.rhs(0, place - step)) / 2e-5
                for step in steps
            ]
        ).T
        assert np.abs(one - np.sort(np.linalg.eigvals(matrix).real)[::-1]).max() < 1e-7
    assert ds["kind"].values.tolist() == ["equilibrium"] * 2
    assert np.abs(ds["exponent_sum"] - ds["mean_divergence"]).max() < 1e-12


@pytest.mark.slow
def test_lorenz_at_rho_20_has_two_equilibria_and_nothing_else():
    # mirror images, and so are the places that they lead to
    starts = np.array([(1.0, 1.0, 20.0), (-1.0, -1.0, 20.0)])
    ds = sl.attractors(
        butterfly.with_values(rho=20.0), starts, method=sl.Taylor(lanes=2), every=0.75
    )
    assert ds["attractor_type"].values.tolist() == ["equilibrium"] * 2
    across = math.sqrt(8 / 3 * 19)
    places = np.stack([ds[f"attractor_{name}"].values[:, 0] for name in "xyz"], axis=1)
    assert (
        np.abs(
            places[np.argsort(places[:, 0])] - [(-across, -across, 19), (across, across, 19)]
        ).max()
        < 1e-10
    )


# -- where the force jumps -------------------------------------------------------------------------
def test_exponents_where_the_force_jumps_against_finite_differences_of_the_flow():
    """The multipliers of the orbit from differences of whole runs, which know no tangent and no
    saltation.
    """
    ds = sl.lyapunov(jumping, (0.9, 0.0), periods=200, transient=300)
    assert ds["kind"].item() == "periodic"
    n, size, step = ds["response_period"].item(), 2, 1e-5
    stroboscope = Stroboscope(jumping, sl.Taylor())
    place = stroboscope.launch(np.array([[0.9, 0.0]]), 500).advance(500)[:, -1]
    _, contacts = stroboscope.sequences(place, n)
    assert len(contacts[0]) >= 2
    shifts = np.concatenate([step * np.eye(size), -step * np.eye(size)])
    ends, _ = stroboscope.sequences(place + shifts, n)
    slope = (ends[:size] - ends[size:]).T / (2 * step)
    exact = np.log(np.abs(np.linalg.eigvals(slope))) * 0.2 / n
    assert np.abs(ds["lyapunov_exponent"].values[0] - np.sort(exact)[::-1]).max() < 1e-6
    smooth = sl.lyapunov(
        jumping,
        (0.9, 0.0),
        flow=sl.ODE45(1e-11, 1e-13, events="ignore"),
        periods=200,
        transient=300,
    )
    # without saltation: another number
    assert abs(float(smooth["running_exponent"][0, 0, -1]) - exact.max()) > 0.01


def test_the_sum_rule_holds_jumps_and_damping_that_acts_in_contact_only():
    """Periodic and chaotic motions; the mean divergence is that of the modes, and contacts add to
    it.
    """
    # the last two: chaos with exponents of 0.07 to 0.09 1/s
    frequency = np.append(np.linspace(0.08, 0.2, 16), [0.1046, 0.1067])
    ds = sl.lyapunov(
        jumping, (0.9, 0.0), values={"frequency": frequency}, periods=300, transient=300
    )
    assert {"chaotic", "periodic"} <= set(ds["kind"].values.tolist())
    off = np.abs(ds["exponent_sum"] - ds["mean_divergence"]).values
    assert off.max() < 1e-11
    assert (ds["mean_divergence"] < -0.1 - 0.01).all()  # more than the damping outside of contact


@sl.system(states="x v", forced_at="frequency", units={"frequency": "Hz"})
def pushed(t, x, v, *, push=0.2, damping=0.5, force=2.0, frequency=0.15):
    """A push along the motion, whichever way it goes: the boundary is v = 0, where the acceleration
    jumps.
    """
    return v, force * sl.cos(2 * sl.pi * frequency * t) + sl.piecewise(
        (push, v > 0), otherwise=-push
    ) - damping * v - x - x**3


def test_volumes_grow_where_the_acceleration_jumps_at_zero_speed():
    """At each contact the determinant is multiplied by the ratio of the accelerations: by far not 1
    in all, and known to both sides.
    """
    ds = sl.lyapunov(pushed, [(0.5, 0.0), (-1.0, 0.3)], flow=FINE, periods=200, transient=100)
    assert np.abs(ds["exponent_sum"] - ds["mean_divergence"]).max() < 1e-7
    assert (ds["mean_divergence"] > -0.5 + 0.02).all()  # the trace alone is minus the damping
    stroboscope, step = Stroboscope(pushed, FINE), 1e-4
    place = stroboscope.launch(np.array([[0.5, 0.0]]), 100).advance(100)[:, -1]
    ends, _ = stroboscope.sequences(
        place + np.concatenate([step * np.eye(2), -step * np.eye(2)]), 1
    )
    determinant = np.linalg.det((ends[:2] - ends[2:]) / (2 * step))
    assert ds["kind"].values[0] == "periodic"
    assert ds["response_period"].values[0] == 1
    assert ds["mean_divergence"].values[0] == pytest.approx(math.log(determinant) * 0.15, abs=1e-4)


# -- use -------------------------------------------------------------------------------------------
# -- directions that shrink fast -------------------------------------------------------------------
def test_a_direction_that_is_lost_in_rounding_has_its_exponent():
    """z' = -rate (z - x) behind an oscillator: its exponent is -rate, whatever is left of it after
    a period of 5 s (exp(-2500) is nothing).
    """

    @sl.system(states="x v z", forced_at="f")
    def followed(t, x, v, z, *, f=0.2, rate=1.0):
        return v, sl.cos(2 * sl.pi * f * t) - 0.2 * v - x, -rate * (z - x)

    rates = np.array([1.0, 10.0, 500.0])
    ds = sl.lyapunov(followed, values={"rate": rates}, periods=64, transient=100)
    assert ds["kind"].values.tolist() == ["periodic"] * 3
    found, error = ds["lyapunov_exponent"].values, ds["lyapunov_error"].values
    assert (np.abs(found[:, 2] + rates) <= error[:, 2]).all()
    assert (error[:, 2] < 1e-11 * (1 + rates) * 10).all()
    assert found[:, :2] == pytest.approx(-0.1, rel=1e-11)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.slow
def test_random_directions_that_shrink_fast_have_their_exponents(seed):
    """From 1 to 1600 times a second, behind random oscillators: -c/2 twice, and -rate."""

    @sl.system(states="x v z", forced_at="f")
    def behind(t, x, v, z, *, f=0.2, rate=1.0, c=0.2, k=1.0, into=1.0):
        return v, sl.cos(2 * sl.pi * f * t) - c * v - k * x, -rate * (z - into * x)

    draw, n = np.random.default_rng(seed), 24
    values = {"rate": 10 ** draw.uniform(0, 3.2, n), "f": 10 ** draw.uniform(-1, 0.3, n)}
    values |= {"c": draw.uniform(0.1, 0.5, n), "k": draw.uniform(0.5, 4, n)}
    values |= {"into": draw.uniform(-2, 2, n)}
    ds = sl.lyapunov(behind, values=values, periods=64, transient=200)
    periodic = ds["kind"].values == "periodic"
    assert periodic.sum() > n // 2
    true = np.stack([-values["c"] / 2, -values["c"] / 2, -values["rate"]], axis=1)
    allowed = np.maximum(10 * ds["lyapunov_error"], 1e-9 * (1 + values["rate"])[:, None])
    assert (np.abs(ds["lyapunov_exponent"] - true) <= allowed).values[periodic].all()
    assert np.isfinite(ds["lyapunov_error"].values[periodic]).all()


@pytest.mark.slow
def test_the_fast_chamber_of_a_relief_valve():
    """The third exponent of its limit cycle, lost in the rounding of a turn, beside that from
    blocks a tenth as long, in which it isn't: the second way knows it from the tangent.
    """
    valve, start = sl.models.relief_valve(flow=8.0), (1.0, 0.1, 12.0)
    turns = sl.lyapunov(valve, start, every=2.2, periods=128, transient=64)
    parts = sl.lyapunov(valve, start, every=0.22, periods=1280, transient=640)
    (slow,), (short,) = turns["lyapunov_exponent"].values, parts["lyapunov_exponent"].values
    assert np.isfinite(slow).all()
    assert slow[2] == pytest.approx(short[2], abs=1e-3)
    assert slow[2] == pytest.approx(-20.6, abs=0.1)


def test_of_several_directions_that_are_lost_nothing_is_known():
    @sl.system(states="x v y z", forced_at="f")
    def both(t, x, v, y, z, *, f=0.2):
        return v, sl.cos(2 * sl.pi * f * t) - 0.2 * v - x, 50.0 * (x - y), 90.0 * (x - z)

    (found,) = sl.lyapunov(both, periods=64, transient=64)["lyapunov_exponent"].values
    assert found[:2] == pytest.approx(-0.1, rel=1e-11)
    assert np.isnan(found[2:]).all()


def test_units():
    rig = sl.models.delangre("a", force=4.0, frequency=16.0)
    values = {
        unit: float(
            sl.lyapunov(rig, (3.344e-3, 0.4256), periods=100, unit=unit)["lyapunov_exponent"][0, 0]
        )
        for unit in ("1/s", "1/period", "bit/s", "bit/period")
    }
    assert values["1/period"] == pytest.approx(values["1/s"] / 16, rel=1e-14)
    assert values["bit/s"] == pytest.approx(values["1/s"] / math.log(2), rel=1e-14)
    assert values["bit/period"] == pytest.approx(values["1/s"] / 16 / math.log(2), rel=1e-14)


def test_ctrl_c_keeps_what_was_finished():
    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as caught:
        sl.lyapunov(sl.models.delangre("a"), periods=100, progress=stop)
    assert caught.value.partial["status"].values.tolist() == ["not_computed"]
    assert np.isnan(caught.value.partial["lyapunov_exponent"].values).all()


def test_without_a_transient_the_growth_from_the_start_counts():
    """The first running mean is the growth of the unit vectors in the first period, in units of the
    ranges.
    """
    rig = sl.models.delangre("a")
    ds = sl.lyapunov(rig, (1e-3, 0.0), periods=64, transient=0)
    assert ds["running_exponent"][0, :, 0].sum().item() == pytest.approx(SUM, rel=1e-12)
    assert ds["running_time"][0, 0].item() == 1 / 15


def test_a_trajectory_that_ends_early_says_so():
    with pytest.warns(SaltusWarning, match="budget_steps"):
        ds = sl.lyapunov(sl.models.delangre("a"), periods=100, flow=sl.Taylor(max_steps=500))
    assert np.isnan(ds["lyapunov_exponent"].values).all()
    assert ds["kind"].item() == "unclear"
