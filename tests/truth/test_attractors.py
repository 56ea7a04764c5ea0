"""Attractors against truth: published orbits of the rig, oscillators of the literature, and runs
that nothing captured.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.attractors import attractors
from saltus.flow.maps import Stroboscope

ORBITS = {
    row["name"]: row
    for row in csv.DictReader((Path(__file__).parents[1] / "reference" / "orbits.csv").open())
}
#: Exponent of a spiral: half of the rate -2 zeta omega_n at which areas shrink [1/s].
SPIRAL = -0.942477796076938


def rig_of(row):
    return sl.models.delangre(
        "c", force=float(row["p_N"]), frequency=float(row["f_Hz"]),
        contact_stiffness=float(row["Kc_N_per_m"]),
        lower_gap=float(row["j1_m"]), upper_gap=float(row["j2_m"]),
    )  # fmt: skip


def start_of(row):
    return np.array([float(row["x0_m"]), float(row["v0_m_per_s"])])


def multipliers(ds, i):
    values = ds.attractor_multiplier_real.values[i] + 1j * ds.attractor_multiplier_imag.values[i]
    return np.sort_complex(values)


def points(ds, i):
    n = int(ds.attractor_period[i])
    return np.stack(
        [ds[f"attractor_{name}"].values[i, :n] for name in ds.attrs["states"].split()], axis=1
    )


def contacts_of_a_run(rig, start, periods):
    """Contacts of a plain run over so many periods."""
    return int(
        (sl.simulate(rig, start, periods=periods)["contact_kind"].values == "crossing").sum()
    )


@sl.system(states="x v")
def free(t, x, v, *, damping=0.25, linear=-1.0, cubic=1.0, pumping=0.0):
    """An oscillator that nothing drives: a double well, or van der Pol's."""
    return v, -damping * v - pumping * (x**2 - 1) * v - linear * x - cubic * x**3


@sl.system(states="x v", forced_at="frequency")
def duffing(
    t, x, v, *, damping=0.05, linear=0.0, cubic=1.0, force=7.5, frequency=1 / (2 * math.pi)
):
    """Duffing's oscillator; without the linear spring it is Ueda's."""
    return v, -damping * v - linear * x - cubic * x**3 + force * sl.cos(2 * sl.pi * frequency * t)


# -- orbits of the rig -----------------------------------------------------------------------------
@pytest.fixture(scope="module")
def five():
    """Case b, 4 N, 15 Hz, from 64 starts."""
    x, v = (
        grid.ravel() for grid in np.meshgrid(np.linspace(-5e-3, 5e-3, 8), np.linspace(-1, 1, 8))
    )
    return attractors(sl.models.delangre("b"), np.stack([x, v], axis=1), progress=False)


def test_the_five_attractors_of_b4_at_15_hz(five):
    assert five.attractor_type.values.tolist() == ["periodic"] * 5
    assert five.attractor_period.values.tolist() == [1, 3, 4, 5, 24]
    assert five.attractor_contacts.values.tolist() == [4, 8, 12, 14, 60]
    assert set(five.basin.values) == {0, 1, 2, 3, 4}
    assert five.attractor_exponent.values[:4] == pytest.approx(SPIRAL, abs=1e-12)
    # The 24T is a node: no pair of complex multipliers, so only their product is known: exp(-2 zeta
    # omega_n 24 T).
    assert np.prod(multipliers(five, 4)).real == pytest.approx(
        math.exp(2 * SPIRAL * 24 / 15), rel=1e-11
    )
    assert five.attractor_exponent.values[4] == pytest.approx(
        math.log(multipliers(five, 4)[-1].real) * 15 / 24, rel=1e-12
    )


def test_every_point_of_the_five_returns_in_a_plain_run_with_as_many_contacts(five):
    rig = sl.models.delangre("b")
    for i in range(5):
        n, first = int(five.attractor_period[i]), points(five, i)[0]
        strobe = sl.stroboscope(rig, first, periods=n)
        run = np.stack([strobe.x.values.ravel(), strobe.v.values.ravel()], axis=1)
        assert np.abs(run[-1] - first).max() < 1e-13
        # in the order in which they are visited
        assert np.abs(run[:-1] - points(five, i)).max() < 1e-13
        assert (points(five, i)[:, 0] >= first[0]).all()
        assert min(np.abs(run[k] - first).max() for k in range(1, n)) > 1e-7 if n > 1 else True
        assert contacts_of_a_run(rig, first, n) == five.attractor_contacts[i]
        assert len(str(five.attractor_itinerary[i].item()).split()) == five.attractor_contacts[i]


@pytest.mark.parametrize("name", ORBITS)
def test_published_orbits(name):
    """Settled to from a start beside the orbit.

    Points and multipliers are Newton's: rounding. The rms is a mean over 1000 samples per period of
    a periodic motion whose acceleration has kinks at the contacts: the error of such a mean falls
    as the fourth power of the spacing, 1e-11. The peak is the top of a parabola through three
    samples, good to the cube of their spacing, or to its square times a kink beside it: 5e-8.
    """
    row = ORBITS[name]
    ds = attractors(rig_of(row), start_of(row) * 1.001 + 1e-6, progress=False)
    assert ds.sizes["attractor"] == 1
    assert ds.attractor_type.item() == "periodic"
    assert ds.attractor_period.item() == int(row["period_in_T"])
    assert ds.attractor_contacts.item() == int(row["contact_events_per_period"])
    assert np.abs(points(ds, 0) - start_of(row)).max(axis=1).min() < 1e-12
    printed = [
        complex(text.strip("() "))
        for text in row["floquet_multipliers"].replace("i", "j").replace(" ", "").split(";")
    ]
    assert np.abs(multipliers(ds, 0) - np.sort_complex(printed)).max() < 1e-10
    assert ds.attractor_exponent.item() == pytest.approx(float(row["LLE_per_s"]), abs=1e-12)
    assert ds.attractor_rms.item() == pytest.approx(float(row["rms_m"]), rel=1e-11)
    assert ds.attractor_peak.item() == pytest.approx(
        max(float(row["xmax_m"]), -float(row["xmin_m"])), rel=5e-8
    )
    gaps = [
        abs(float(row["xmax_m"]) - float(row["j2_m"])),
        abs(float(row["xmin_m"]) + float(row["j1_m"])),
    ]
    # other turning points may lie nearer
    assert 0 < ds.attractor_margin.item() <= min(gaps) * (1 + 1e-6)


@pytest.mark.parametrize("name", ORBITS)
@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-6])
def test_a_start_on_the_orbit_belongs_to_it(name, off):
    """The range of such starts says nothing about the size of anything."""
    row = ORBITS[name]
    ds = attractors(rig_of(row), start_of(row) * (1 + off), progress=False)
    assert ds.attractor_period.values.tolist() == [int(row["period_in_T"])]
    assert ds.basin.values.tolist() == [0]


def test_one_start_or_many_give_the_same_orbit(five):
    row = ORBITS["B4_15_P3"]
    alone = attractors(rig_of(row), start_of(row) * 1.001, progress=False)
    assert np.abs(points(alone, 0) - points(five, 1)).max() < 1e-14


def test_labels_do_not_depend_on_the_order_of_the_starts_or_on_threads(five):
    x, v = (
        grid.ravel() for grid in np.meshgrid(np.linspace(-5e-3, 5e-3, 8), np.linspace(-1, 1, 8))
    )
    order = np.random.default_rng(1).permutation(64)
    again = attractors(
        sl.models.delangre("b"), np.stack([x, v], axis=1)[order], threads=1, progress=False
    )
    np.testing.assert_array_equal(again.basin.values, five.basin.values[order])
    np.testing.assert_allclose(again.attractor_x.values, five.attractor_x.values, atol=1e-15)


def test_a_weakly_damped_rig_settles_to_periodic_orbits_too():
    """zeta = 1e-3: a residue needs 2199 periods to fall to 1e-6. Followed for 30 000 periods both
    starts repeat; after how many, rounding decides in the chaos before.
    """
    rig = sl.models.delangre("b", damping_ratio=1e-3)
    starts = np.array([[1e-3, 0.1], [0.0, 0.0]])
    x = sl.stroboscope(rig, starts, periods=30_000, keep=65).x.values
    repeats = np.abs(x[:, -1:] - x[:, -2::-1]) < 1e-15
    assert repeats.any(axis=1).all()
    ds = attractors(rig, starts, periods=20_000, progress=False)
    assert ds.attractor_type.values.tolist() == ["periodic"] * ds.sizes["attractor"]
    assert (
        ds.attractor_period.values[ds.basin.values].tolist()
        == (1 + repeats.argmax(axis=1)).tolist()
    )
    assert ds.attractor_exponent.values == pytest.approx(SPIRAL / 30, rel=1e-9)


def test_a_weakly_damped_rig_is_never_called_quasi_periodic():
    """After 2000 periods it may not be known where it goes; that it never repeats is not known
    either.
    """
    ds = attractors(
        sl.models.delangre("b", damping_ratio=1e-3), [[1e-3, 0.1], [0.0, 0.0]], progress=False
    )
    assert set(ds.attractor_type.values) <= {"periodic"}


def test_twins_of_a_symmetric_rig_are_two_attractors():
    """Case a, 16 Hz: two orbits of 2T. Half a period later one is the other's mirror image;
    amplitudes are equal.
    """
    rig = sl.models.delangre("a", frequency=16.0)
    x, v = (
        grid.ravel() for grid in np.meshgrid(np.linspace(-5e-3, 5e-3, 12), np.linspace(-1, 1, 12))
    )
    ds = attractors(rig, np.stack([x, v], axis=1), progress=False)
    pair = np.flatnonzero(ds.attractor_period.values == 2)
    assert len(pair) == 2
    assert {*pair} <= {*ds.basin.values}
    one, other = pair
    np.testing.assert_allclose(ds.attractor_peak[one], ds.attractor_peak[other], rtol=1e-7)
    np.testing.assert_allclose(ds.attractor_rms[one], ds.attractor_rms[other], rtol=1e-10)
    half = sl.simulate(rig, points(ds, one), t_end=0.5 / 16)
    mirrored = -np.stack([half.end_x.values, half.end_v.values], axis=1)
    distance = np.abs(mirrored[:, None] - points(ds, other)[None]).max(axis=2)
    assert distance.min(axis=1).max() < 1e-12
    assert np.abs(points(ds, one)[:, None] - points(ds, other)[None]).max(axis=2).min() > 1e-5
    # The mirror image half a period later of any start leads to the twin.
    starts = np.stack([x, v], axis=1)
    half = sl.simulate(rig, starts, t_end=0.5 / 16)
    twin = attractors(
        rig, -np.stack([half.end_x.values, half.end_v.values], axis=1), progress=False
    )
    swap = np.arange(ds.sizes["attractor"])
    swap[pair] = pair[::-1]
    np.testing.assert_array_equal(twin.basin.values, swap[ds.basin.values])


# -- oscillators of the literature -----------------------------------------------------------------
def test_double_well_has_two_equilibria_with_known_eigenvalues():
    """x'' + x'/4 - x + x^3 = 0: at x = +-1 the roots of s^2 + s/4 + 2."""
    ds = attractors(
        free, [[0.5, 0.0], [-0.5, 0.0], [1.0 + 1e-9, 0.0], [-1.0, 0.0]], every=1.0, progress=False
    )
    assert ds.attractor_type.values.tolist() == ["equilibrium"] * 2
    assert sorted(ds.attractor_x.values[:, 0]) == pytest.approx([-1.0, 1.0], abs=1e-14)
    right = int(ds.attractor_x.values[:, 0].argmax())
    assert ds.basin.values.tolist() == [right, 1 - right, right, 1 - right]
    for i in range(2):
        eigenvalues = (
            ds.attractor_eigenvalue_real.values[i] + 1j * ds.attractor_eigenvalue_imag.values[i]
        )
        assert np.sort_complex(eigenvalues) == pytest.approx(
            np.sort_complex(np.roots([1, 0.25, 2])), abs=1e-12
        )
    assert ds.attractor_exponent.values == pytest.approx(-0.125, abs=1e-12)
    assert ds.attractor_peak.values == pytest.approx(1.0, abs=1e-12)
    assert ds.attractor_contacts.values.tolist() == [0, 0]


def test_a_start_on_the_ridge_of_the_double_well_is_on_no_attractor():
    """(0, 0) is a saddle: the trajectory stays there for ever, in numbers too, but no neighbour
    does.
    """
    ds = attractors(free, [[0.5, 0.0], [0.0, 0.0]], every=1.0, progress=False)
    assert ds.attractor_type.values.tolist() == ["equilibrium"]
    assert ds.basin.values.tolist() == [0, -2]
    assert attractors(free, [0.0, 0.0], every=1.0, progress=False).sizes["attractor"] == 0


def test_van_der_pol_has_its_limit_cycle_by_any_stroboscope():
    """Its period is 6.66328685932... s, so looks 1 s apart never repeat; x reaches 2.00861986087...
    on it.
    """
    rig = free.with_values(damping=0.0, linear=1.0, cubic=0.0, pumping=1.0)
    ds = attractors(rig, [[0.5, 0.2], [3.0, 3.0]], every=1.0, progress=False)
    assert ds.attractor_type.values.tolist() == ["limit_cycle"]
    assert ds.basin.values.tolist() == [0, 0]
    assert ds.attractor_cycle.item() == pytest.approx(6.66328685932, abs=1e-10)
    assert ds.attractor_peak.item() == pytest.approx(2.00861986087, abs=1e-10)


@pytest.mark.parametrize("looks", [1, 4])
def test_van_der_pol_seen_by_a_commensurate_stroboscope_is_not_chaotic(looks):
    """So many looks in a period: each phase is an orbit of its own, with a multiplier of exactly 1.
    Nothing is sensitive.
    """
    rig = free.with_values(damping=0.0, linear=1.0, cubic=0.0, pumping=1.0)
    starts = np.random.default_rng(looks).uniform(-2, 2, (12, 2))
    ds = attractors(rig, starts, every=6.663286859323130 / looks, progress=False)
    assert "chaotic" not in ds.attractor_type.values


def test_an_undamped_well_is_not_chaotic():
    """One degree of freedom that nothing drives can't be: neighbours part like time, not like its
    exponential.
    """
    ds = attractors(free.with_values(damping=0.0), [0.5, 0.2], every=1.0, progress=False)
    assert "chaotic" not in ds.attractor_type.values


def exponent_by_runge_kutta(damping, force, count=256, periods=150, steps=50, settle=50):
    """Largest exponent [1/s] of Ueda's oscillator: RK4 of the motion and of one direction, mean
    over many trajectories; and its error.
    """
    rng = np.random.default_rng(5)
    y = np.stack(
        [rng.uniform(-2, 2, count), rng.uniform(-2, 2, count), np.ones(count), np.zeros(count)]
    )
    h = 2 * math.pi / steps

    k1, k2, k3, k4 = np.empty((4, *y.shape))

    def rate(t, y, out):
        """Without np.stack, which takes longer than the arithmetic."""
        x, v, a, b = y
        square = x * x
        out[0], out[2] = v, b
        out[1] = force * math.cos(t) - damping * v - square * x
        out[3] = -damping * b - 3 * square * a

    total = np.zeros(count)
    for k in range(periods):
        for j in range(steps):
            t = j * h
            rate(t, y, k1)
            rate(t + h / 2, y + h / 2 * k1, k2)
            rate(t + h / 2, y + h / 2 * k2, k3)
            rate(t + h, y + h * k3, k4)
            y = y + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        length = np.hypot(y[2], y[3])
        y[2:] /= length
        if k >= settle:
            total += np.log(length)
    rates = total / (2 * math.pi * (periods - settle))
    return rates.mean(), rates.std() / math.sqrt(count)


@pytest.mark.slow
def test_ueda_s_oscillator_is_chaotic_with_the_exponent_of_an_independent_integration():
    ds = attractors(duffing, [[1.0, 0.0], [2.5, -3.0], [0.1, 0.1]], periods=256, progress=False)
    assert ds.attractor_type.values.tolist() == ["chaotic"]
    assert ds.basin.values.tolist() == [0, 0, 0]
    assert ds.attractor_period.item() == 0
    expected, error = exponent_by_runge_kutta(0.05, 7.5)
    assert 0.09 < expected < 0.11  # Sprott, Chaos and Time-Series Analysis (2003): 0.1034
    assert error < 0.002
    assert abs(ds.attractor_exponent.item() - expected) < 4 * math.hypot(
        ds.attractor_exponent_error.item(), error
    )
    assert ds.attractor_exponent_error.item() < 0.02


@pytest.mark.slow
def test_chaos_beside_a_periodic_orbit():
    """x'' + x'/10 + x^3 = 12 cos t: a chaotic attractor and one of period 1, from
    starts on either.
    """
    system = duffing.with_values(damping=0.1, force=12.0)
    starts = np.stack([np.linspace(-3, 3, 24), np.linspace(-5, 5, 24)], axis=1)
    ds = attractors(system, starts, periods=256, progress=False)
    assert ds.attractor_type.values.tolist() == ["periodic", "chaotic"]
    end = sl.stroboscope(system, starts, periods=1500, keep=2)
    repeats = np.abs(np.diff(end.x.values, axis=1))[:, 0] < 1e-9
    assert 0 < repeats.sum() < 24
    np.testing.assert_array_equal(ds.basin.values, np.where(repeats, 0, 1))
    assert ds.attractor_exponent.values[0] == pytest.approx(-0.05, abs=1e-9)


def test_a_softening_spring_is_escaped_from():
    """x'' + x'/10 + x - x^3 = cos(...)/10: beyond the ridge at |x| = 1 motion reaches infinity in
    finite time.
    """
    system = duffing.with_values(damping=0.1, linear=1.0, cubic=-1.0, force=0.1, frequency=0.15)
    ds = attractors(system, [[0.1, 0.0], [1.5, 0.5], [-2.0, -1.0]], progress=False)
    assert ds.attractor_type.values.tolist() == ["periodic"]
    assert ds.basin.values[0] == 0
    assert (ds.basin.values[1:] < 0).all()


# -- the points and multipliers against the flow ---------------------------------------------------
def test_the_range_of_the_starts_does_not_change_what_is_found():
    row = ORBITS["B4_15_P4"]
    rig = rig_of(row)
    near = attractors(rig, start_of(row) + 1e-8, progress=False)
    wide = attractors(rig, np.stack([start_of(row) + 1e-8, [2e-2, 5.0]]), progress=False)
    i = int(wide.basin[0])
    assert np.abs(points(wide, i) - points(near, 0)).max() < 1e-14
    assert np.abs(multipliers(wide, i) - multipliers(near, 0)).max() < 1e-11


def test_the_monodromy_of_the_table_is_that_of_finite_differences(five):
    """The 5T, which orbits.csv doesn't have."""
    stroboscope, n = Stroboscope(sl.models.delangre("b"), sl.Taylor()), 5
    start, step = points(five, 3)[:1], np.array([1e-9, 1e-7])
    columns = []
    for j in range(2):
        e = np.eye(2)[j] * step
        ahead, behind = (
            stroboscope.sequences(start + e, n)[0],
            stroboscope.sequences(start - e, n)[0],
        )
        columns.append((ahead - behind)[0] / (2 * step[j]))
    values = np.sort_complex(np.linalg.eigvals(np.stack(columns, axis=1)))
    assert np.abs(values - multipliers(five, 3)).max() < 1e-5
