"""Basins against truth: runs that nothing captured, symmetries, published claims; and that a map is
the same however it is computed.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.basins import labels
from saltus.analysis.basins import pipeline as plans
from saltus.analysis.basins.labels import settle
from saltus.analysis.basins.pipeline import basin_plan
from saltus.analysis.closed.capture import Neighbourhoods

pytestmark = pytest.mark.slow

ORBITS = {
    row["name"]: row
    for row in csv.DictReader((Path(__file__).parents[1] / "reference" / "orbits.csv").open())
}
B4 = sl.models.delangre("b")
#: Four attractors, T, two of 2T and 5T, that are settled to sooner than the 24T of B4: for what
#: every map must have.
B16 = sl.models.delangre("b", frequency=16.0)
GRAZED = sl.models.delangre("c", frequency=5.0, contact_stiffness=2.32e4)
SPAN_X, SPAN_V = ("-5 mm", "5 mm"), ("-1 m/s", "1 m/s")


def box(n):
    """The paper's box of starts, n x n."""
    return dict(x=(*SPAN_X, n), v=(*SPAN_V, n), progress=False)


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


def orbit_points(ds, i):
    n = int(ds.attractor_period[i])
    return np.stack(
        [ds[f"attractor_{name}"].values[i, :n] for name in ds.attrs["states"].split()], axis=1
    )


def labels_of_plain_runs(system, starts, ds, periods=2000, tolerance=1e-9):
    """The periodic attractor on which each start ends, after so many periods that nothing
    interrupts; -1 if on none.
    """
    run = sl.stroboscope(system, starts, periods=periods, keep=1)
    end = np.stack([run.x.values[:, -1], run.v.values[:, -1]], axis=1)
    distance = np.stack(
        [
            np.abs(end[:, None] - orbit_points(ds, i)[None]).max(axis=2).min(axis=1)
            for i in range(ds.sizes["attractor"])
        ],
        axis=1,
    )
    return np.where(distance.min(axis=1) < tolerance, distance.argmin(axis=1), -1)


def cells(ds, count, seed=4):
    """Random cells: their starts and labels."""
    i, j = (np.random.default_rng(seed).integers(0, n, count) for n in ds.basin.shape)
    return np.stack([ds.x.values[i], ds.v.values[j]], axis=1), ds.basin.values[i, j]


@pytest.fixture(autouse=True, scope="module")
def few_checks():
    """Few cells are computed again by a tighter method, for a number that nothing here looks at;
    and few scouts go before the others, since labels don't depend on what they saw, as one of these
    tests shows.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "CHECKED", 16)
        patch.setattr(plans, "SCOUTS", 256)
        yield


@pytest.fixture(scope="module")
def five():
    return sl.basins(B4, **box(40))


@pytest.fixture(scope="module")
def three():
    """The cells in which the third attractor lives are 14 of 40 000, so the grid is the paper's."""
    return sl.basins(GRAZED, **box(200))


# -- labels ----------------------------------------------------------------------------------------
def test_b4_has_five_basins(five):
    assert five.attractor_period.values.tolist() == [1, 3, 4, 5, 24]
    assert set(np.unique(five.basin)) == {0, 1, 2, 3, 4}
    assert five.attractor_fraction.values.sum() == pytest.approx(1.0)
    assert (five.periods_to_settle.values >= 1).all()


def test_labels_of_b4_equal_those_of_runs_that_nothing_captured(five):
    starts, labels = cells(five, 300)
    np.testing.assert_array_equal(labels_of_plain_runs(B4, starts, five), labels)


def test_labels_of_c4_equal_those_of_runs_that_nothing_captured(three):
    starts, labels = cells(three, 300)
    i, j = np.nonzero(three.basin.values == rare_one(three))
    starts = np.concatenate([starts, np.stack([three.x.values[i], three.v.values[j]], axis=1)])
    labels = np.concatenate([labels, three.basin.values[i, j]])
    plain = labels_of_plain_runs(GRAZED, starts, three, periods=500)  # exp(-94) of a distance
    np.testing.assert_array_equal(plain, labels)


def test_a_trajectory_is_captured_no_later_than_it_has_settled(five):
    """When it has come within 1e-9 of the range of an orbit it has long been captured."""
    starts, labels = cells(five, 40)
    when = five.periods_to_settle.sel(
        x=starts[:, 0], v=starts[:, 1], method="nearest"
    ).values.diagonal()
    run = sl.stroboscope(B4, starts, periods=2500)  # the 24T is slow: exp(-0.205 t)
    path = np.stack([run.x.values / 1e-2, run.v.values / 2.0], axis=2)
    for one, label, captured in zip(path, labels, when, strict=True):
        distance = (
            np.abs(one[:, None] - orbit_points(five, label)[None] / [1e-2, 2.0])
            .max(axis=2)
            .min(axis=1)
        )
        settled = np.flatnonzero(distance < 1e-9)[0]
        assert captured <= settled
        assert distance[captured] < 0.5


# -- neighbourhoods --------------------------------------------------------------------------------
def inside(near, i, count):
    """Random points of the i-th ellipsoid, uniform in it."""
    rng = np.random.default_rng(i)
    disc = rng.standard_normal((count, 2))
    disc *= (np.sqrt(rng.random(count)) / np.linalg.norm(disc, axis=1))[:, None]
    return near.centres[i] + disc @ np.linalg.inv(near.weights[i]).T


def edge(near, i, count):
    """Points on the edge of the i-th ellipsoid."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return (
        near.centres[i]
        + np.stack([np.cos(angle), np.sin(angle)], axis=1) @ np.linalg.inv(near.weights[i]).T
    )


@pytest.fixture(scope="module")
def known():
    """Attractors of b4 with their neighbourhoods."""
    plan = basin_plan(B4, {"x": (*SPAN_X, 40), "v": (*SPAN_V, 40)}, None, sl.Taylor(), 2000, None)
    return plan, plan.scout()


@pytest.mark.parametrize("label", range(5))
def test_every_point_of_a_neighbourhood_ends_on_its_attractor(known, label):
    """400 points in each ellipsoid and 200 on its edge, in runs that nothing interrupts: all are
    nearer after some returns, the farthest go on to the end.
    """
    plan, found = known
    orbit, mine = found.orbits[label], np.flatnonzero(found.near.owners == label)
    assert orbit.period == [1, 3, 4, 5, 24][label] >= len(mine) >= 1
    starts = np.concatenate(
        [points for i in mine for points in (inside(found.near, i, 400), edge(found.near, i, 200))]
    )
    begun, end = (
        distances(plan, starts, orbit),
        plan.map().sequences(starts, 60 if label < 4 else 24)[0],
    )
    now = distances(plan, end, orbit)
    # exp(-0.94 * 4) of it if it shrank evenly; 0.72
    assert now.max() < (0.3 if label < 4 else 0.75) * begun.max()
    later = plan.map().sequences(end[now.argsort()[-32:]], 2400)[0]
    assert distances(plan, later, orbit).max() < 1e-9


def distances(plan, states, orbit):
    """To the nearest point of an orbit, in units of the range."""
    return np.abs((states[:, None] - orbit.points[None]) / plan.scale).max(axis=2).min(axis=1)


def test_neighbourhoods_of_the_five_never_overlap(known):
    """Every random point of an ellipsoid, and 400 on its edge, lie in none of another attractor."""
    _, found = known
    for i, owner in enumerate(found.near.owners):
        others = found.near.owners != owner
        strangers = Neighbourhoods(
            found.near.centres[others], found.near.weights[others], found.near.owners[others]
        )
        label, _ = strangers.capture(
            np.concatenate([inside(found.near, i, 500), edge(found.near, i, 400)])[:, None, :]
        )
        assert (label == -1).all()


def test_neighbourhoods_are_worth_having(known):
    """The largest disc that fits in an ellipsoid of each orbit, in units of the range: that's what
    makes settling soon.
    """
    plan, found = known
    radius = 1 / np.linalg.norm(found.near.weights * plan.scale, ord=2, axis=(1, 2))
    largest = [radius[found.near.owners == label].max() for label in range(5)]
    assert (np.array(largest) > [1e-2, 1e-3, 5e-5, 5e-4, 1e-5]).all()


# -- the same however it is computed ---------------------------------------------------------------
def same_to_the_bit(a, b):
    for name in ("basin", "periods_to_settle", "status", "grazes_unresolved"):
        np.testing.assert_array_equal(a[name].values, b[name].values)
    for name in ("attractor_x", "attractor_v", "attractor_multiplier_real", "attractor_rms"):
        np.testing.assert_array_equal(a[name].values, b[name].values)
    assert a.attrs["result_hash"] == b.attrs["result_hash"]


@pytest.fixture
def few_scouts(monkeypatch):
    monkeypatch.setattr(plans, "SCOUTS", 128)


@pytest.fixture(scope="module")
def coarse():
    """A map of 400 cells with all four attractors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "SCOUTS", 128)
        ds = sl.basins(B16, **box(20))
    assert set(np.unique(ds.basin)) == {0, 1, 2, 3}
    return ds


@pytest.mark.parametrize("threads", [1, 2])
def test_threads_change_nothing(coarse, few_scouts, threads):
    same_to_the_bit(coarse, sl.basins(B16, threads=threads, **box(20)))


@pytest.mark.parametrize("size", [47, 250])
def test_the_size_of_chunks_changes_nothing(coarse, few_scouts, monkeypatch, size):
    monkeypatch.setattr(labels, "PIECE", size)
    same_to_the_bit(coarse, sl.basins(B16, threads=2, **box(20)))


def test_chunks_of_a_chaotic_map_change_nothing(monkeypatch):
    monkeypatch.setattr(plans, "SCOUTS", 16)
    # periods that the chaotic ones are followed
    monkeypatch.setattr("saltus.analysis.attractors.unsettled.WATCHING_ITERATES", 1024)
    system = duffing.with_values(damping=0.1, force=12.0)
    axes = dict(x=(-3, 3, 6), v=(-6, 6, 6), periods=256, progress=False)
    whole = sl.basins(system, **axes)
    assert whole.attractor_type.values.tolist() == ["periodic", "chaotic"]
    monkeypatch.setattr(labels, "PIECE", 11)
    monkeypatch.setattr(labels, "FEWEST", 11)
    same_to_the_bit(whole, sl.basins(system, threads=2, **axes))


@pytest.mark.parametrize("scouts", [1, 7, 300])
def test_ids_and_labels_do_not_depend_on_what_the_scouts_saw(coarse, monkeypatch, scouts):
    """With one scout three attractors are found only after the chunks; with others in another
    order.
    """
    monkeypatch.setattr(plans, "SCOUTS", scouts)
    again = sl.basins(B16, **box(20))
    np.testing.assert_array_equal(again.basin.values, coarse.basin.values)
    np.testing.assert_array_equal(again.attractor_period.values, coarse.attractor_period.values)
    np.testing.assert_allclose(
        again.attractor_x.values, coarse.attractor_x.values, rtol=0, atol=1e-15
    )


def test_ids_do_not_depend_on_the_order_of_starts():
    plan = basin_plan(B16, {"x": (*SPAN_X, 10), "v": (*SPAN_V, 10)}, None, sl.Taylor(), 2000, None)
    starts, order = plan.starts(np.arange(100)), np.random.default_rng(3).permutation(100)
    found, label, _ = find_attractors(plan.map(), starts, plan.scale, 2000)
    again, label_again, _ = find_attractors(plan.map(), starts[order], plan.scale, 2000)
    assert [orbit.period for orbit in again.orbits] == [orbit.period for orbit in found.orbits]
    np.testing.assert_array_equal(label_again, label[order])
    for one, other in zip(found.orbits, again.orbits, strict=True):
        assert np.abs(one.points - other.points).max() < 1e-15


def test_axes_the_other_way_round_give_the_same_map(coarse, few_scouts):
    axes = box(20)
    turned = sl.basins(B16, v=axes["v"], x=axes["x"], progress=False)
    assert turned.basin.dims == ("v", "x")
    np.testing.assert_array_equal(turned.basin.values.T, coarse.basin.values)


# -- symmetries ------------------------------------------------------------------------------------
def test_wells_mirror_each_other():
    """An even number of starts a side: none on the ridge. (x, v) -> (-x, -v) swaps the wells, cell
    by cell.
    """
    ds = sl.basins(free, x=(-2, 2, 24), v=(-2, 2, 24), every=1.0, progress=False)
    assert ds.attractor_type.values.tolist() == ["equilibrium"] * 2
    np.testing.assert_array_equal(ds.basin.values, 1 - ds.basin.values[::-1, ::-1])
    assert ds.attractor_fraction.values.tolist() == [0.5, 0.5]
    np.testing.assert_array_equal(
        ds.periods_to_settle.values, ds.periods_to_settle.values[::-1, ::-1]
    )
    run = sl.simulate(
        free,
        np.stack([a.ravel() for a in np.meshgrid(ds.x, ds.v, indexing="ij")], axis=1),
        t_end=400.0,
    )
    right = int(ds.attractor_x.values[:, 0].argmax())
    np.testing.assert_array_equal(
        ds.basin.values.ravel(), np.where(run.end_x.values > 0, right, 1 - right)
    )


def test_the_ridge_between_the_wells_is_no_third_basin():
    """An odd number of starts a side: the one in the middle stays on the saddle."""
    ds = sl.basins(free, x=(-2, 2, 5), v=(-2, 2, 5), every=1.0, progress=False)
    assert ds.attractor_type.values.tolist() == ["equilibrium"] * 2
    assert ds.basin.values[2, 2] == -2


# -- claims of the paper ---------------------------------------------------------------------------
def rare_one(ds):
    return int(ds.attractor_fraction.values.argmin())


def test_c_at_5_hz_before_the_graze_has_two_attractors():
    ds = sl.basins(sl.models.delangre("c", frequency=5.0, contact_stiffness=2.55e4), **box(40))
    assert ds.attractor_type.values.tolist() == ["periodic"] * 2
    assert ds.attractor_period.values.tolist() == [1, 1]
    for name in ("C4_5_K25500_A", "C4_5_K25500_B"):
        start = np.array([float(ORBITS[name]["x0_m"]), float(ORBITS[name]["v0_m_per_s"])])
        assert min(np.abs(orbit_points(ds, i) - start).max() for i in range(2)) < 1e-12
    starts, labels = cells(ds, 100)
    plain = labels_of_plain_runs(ds_system(ds), starts, ds, periods=500)
    np.testing.assert_array_equal(plain, labels)


def ds_system(ds):
    """The rig of the map before the graze."""
    assert "delangre" in ds.attrs["system"]
    return sl.models.delangre("c", frequency=5.0, contact_stiffness=2.55e4)


def test_c_at_5_hz_after_the_graze_has_three(three):
    assert three.attractor_period.values.tolist() == [1, 1, 1]
    assert three.attractor_exponent.values == pytest.approx(-0.942477796076938, abs=1e-11)
    count = np.bincount(three.basin.values.ravel(), minlength=3)
    assert count.sum() == 40_000
    assert 10 <= count.min() <= 20
    assert three.attrs["smallest_basin_seen"] == pytest.approx(3 / 40_000)


def test_the_rare_attractor_is_found_by_starts_alone(three):
    i, j = np.nonzero(three.basin.values == rare_one(three))
    ds = sl.attractors(
        GRAZED, np.stack([three.x.values[i[:3]], three.v.values[j[:3]]], axis=1), progress=False
    )
    assert ds.sizes["attractor"] == 1
    assert np.abs(orbit_points(ds, 0) - orbit_points(three, rare_one(three))).max() < 1e-14


def test_c_at_17_hz_doubles_its_period():
    before = sl.basins(sl.models.delangre("c", frequency=17.0, contact_stiffness=7694.0), **box(40))
    assert before.attractor_period.values.tolist() == [1]
    assert (before.basin.values == 0).all()
    assert abs(before.attractor_x.values[0, 0] - float(ORBITS["C4_17_K7694"]["x0_m"])) < 1e-12
    after = sl.basins(sl.models.delangre("c", frequency=17.0, contact_stiffness=8833.0), **box(60))
    assert after.attractor_period.values.tolist() == [1, 2]
    assert after.attractor_contacts.values.tolist() == [4, 4]
    assert after.attractor_peak.values[0] > 30 * after.attractor_peak.values[1]
    assert 0.002 < after.attractor_fraction.values[0] < 0.02


@pytest.mark.parametrize(("events", "count"), [("locate", 3), ("ignore", 2)])
def test_ode45_sees_the_third_attractor_only_if_it_locates_contacts(three, events, count):
    """The paper's claim, at its tolerances. In exact arithmetic there are three."""
    # columns and rows in which the third has starts, and the outer ones
    places = np.nonzero(three.basin.values == rare_one(three))
    starts = {
        name: three[name].values[np.unique([0, *place, three.sizes[name] - 1])]
        for name, place in zip("xv", places, strict=True)
    }
    ds = sl.basins(GRAZED, method=sl.ODE45(1e-4, 1e-7, events=events), progress=False, **starts)
    assert ds.attractor_type.values.tolist() == ["periodic"] * count
    assert ds.attractor_period.values.tolist() == [1] * count
    exact = np.stack([orbit_points(three, i)[0] for i in range(3)])
    for i in range(count):
        assert (np.abs(orbit_points(ds, i)[0] - exact) / [1e-2, 2.0]).max(axis=1).min() < 1e-3
    assert (ds.basin.values >= 0).all()


@pytest.mark.parametrize("events", ["locate", "ignore"])
def test_attractors_of_ode45_are_those_that_its_runs_settle_on(events):
    """Restarted every period, ode45 has other fixed points than ode45 that goes on; labels must be
    of the latter.
    """
    rig = sl.models.delangre("c", frequency=17.0, contact_stiffness=8833.0)
    method = sl.ODE45(1e-4, 1e-7, events=events)
    ds = sl.basins(rig, **box(30), method=method)
    assert ds.attrs["unsettled_cells"] == 0
    starts, labels = cells(ds, 60)
    run = sl.stroboscope(
        rig, {"x": starts[:, 0], "v": starts[:, 1]}, periods=1500, keep=4, method=method
    )
    apart = np.abs(run.x.values[:, -1:] - run.x.values[:, -3:-1][:, ::-1])
    period = np.where(apart[:, 0] < 1e-4, 1, np.where(apart[:, 1] < 1e-4, 2, 0))
    np.testing.assert_array_equal(ds.attractor_period.values[labels], period)
    amplitude = np.abs(run.x.values).max(axis=1)
    nearest = np.abs(
        amplitude[:, None] - np.nanmax(np.abs(ds.attractor_x.values), axis=1)[None]
    ).argmin(axis=1)
    np.testing.assert_array_equal(labels, nearest)


def test_what_errors_of_ode45_blur_is_typed_by_the_exact_orbit_about_which_it_scatters(
    five, monkeypatch
):
    """b4, 15 Hz: by ode45 at the paper's tolerances the 24T never closes. Its size, contacts and
    stability are those of the exact orbit.
    """
    monkeypatch.setattr(plans, "SCOUTS", 64)
    ds = sl.basins(B4, **box(16), method=sl.ODE45(1e-4, 1e-7))
    assert ds.attrs["unsettled_cells"] == 0
    assert dict(
        zip(ds.attractor_period.values.tolist(), ds.attractor_type.values.tolist(), strict=True)
    ) == {1: "periodic", 3: "periodic", 4: "periodic", 5: "periodic", 24: "noisy_periodic"}
    i = ds.attractor_period.values.tolist().index(24)
    assert (ds.basin.values == i).any()
    np.testing.assert_allclose(orbit_points(ds, i), orbit_points(five, 4), atol=1e-12)
    for name in ("contacts", "itinerary"):
        assert ds[f"attractor_{name}"].values[i] == five[f"attractor_{name}"].values[4]
    for name in ("peak", "rms", "margin", "multiplier_real", "exponent"):
        np.testing.assert_allclose(
            ds[f"attractor_{name}"].values[i],
            five[f"attractor_{name}"].values[4],
            rtol=1e-6,
            err_msg=name,
        )
    assert np.isnan(np.delete(ds.attractor_scatter.values, i)).all()
    # What plain runs of ode45 do that begin on the exact orbit: distances phase by phase, over 1200
    # periods.
    orbit = orbit_points(five, 4)
    run = sl.stroboscope(B4, orbit, periods=1200, method=sl.ODE45(1e-4, 1e-7))
    apart = run.x.values - orbit[(np.arange(24)[:, None] + np.arange(1201)) % 24, 0]
    assert 0.3 < np.sqrt(np.mean(apart**2)) / float(ds.attractor_scatter[i]) < 3
    assert np.ptp(run.x.values[:, ::24], axis=1).max() > 1e-6  # it doesn't close


def test_scatter_about_an_orbit_falls_with_the_tolerance(five):
    """Starts on the exact 24T lead to it, by ode45 too; hundred times the accuracy leaves less than
    half of the scatter.
    """
    scatter = []
    for rtol in (1e-4, 1e-6):
        ds = sl.attractors(
            B4,
            orbit_points(five, 4)[::12],
            method=sl.ODE45(rtol, 1e-3 * rtol),
            periods=512,
            progress=False,
        )
        assert ds.attractor_type.values.tolist() == ["noisy_periodic"]
        assert ds.attractor_period.values.tolist() == [24]
        assert (ds.basin.values == 0).all()
        assert "unconverged_exactly" not in ds.attrs
        scatter.append(ds.attractor_scatter.item())
    assert scatter[1] < 0.5 * scatter[0]
    assert scatter[0] < 0.02 * np.ptp(five.attractor_x.values[4])


def test_contacts_that_were_not_looked_for_are_not_counted_as_none(three):
    """Without location no contact is recorded; these orbits meet the springs 4 and 6 times a
    period.
    """
    ds = sl.basins(GRAZED, method=sl.ODE45(1e-4, 1e-7, events="ignore"), **box(8))
    assert (three.attractor_contacts.values > 0).all()
    assert np.isnan(ds.attractor_contacts.values).all()


# -- codes -----------------------------------------------------------------------------------------
def test_what_runs_away_has_escaped():
    system = duffing.with_values(damping=0.1, linear=1.0, cubic=-1.0, force=0.1, frequency=0.15)
    ds = sl.basins(system, x=(-1.5, 1.5, 16), v=(-1, 1, 16), progress=False)
    assert ds.attractor_period.values.tolist() == [1]
    escaped = ds.basin.values == -1
    assert set(np.unique(ds.basin)) == {-1, 0}
    assert 0.3 < escaped.mean() < 0.9
    assert (ds.periods_to_settle.values[escaped] == -1).all()
    assert ds.attractor_fraction.item() == pytest.approx((~escaped).mean())
    flags = dict(
        zip(
            ds.status.attrs["flag_values"].tolist(),
            ds.status.attrs["flag_meanings"].split(),
            strict=True,
        )
    )
    assert {flags[code] for code in ds.status.values[escaped].tolist()} == {"nonfinite"}
    i, j = np.nonzero(escaped)
    with pytest.warns(sl.errors.SaltusWarning, match="nonfinite"):
        run = sl.stroboscope(
            system, np.stack([ds.x.values[i], ds.v.values[j]], axis=1)[:20], periods=200, keep=1
        )
    assert set(run.status.values) == {"nonfinite"}


def test_a_budget_that_is_used_up_has_failed_and_not_escaped():
    ds = sl.basins(B4, method=sl.Taylor(max_steps=40), **box(4))
    assert set(np.unique(ds.basin)) == {-3}
    assert ds.sizes["attractor"] == 0


def test_too_few_periods_leave_cells_unconverged(monkeypatch):
    monkeypatch.setattr(plans, "SCOUTS", 32)
    ds = sl.basins(sl.models.delangre("b", damping_ratio=1e-3), periods=100, **box(4))
    assert set(ds.attractor_type.values) <= {"periodic"}
    assert -2 in ds.basin.values
    assert (ds.periods_to_settle.values[ds.basin.values < 0] == -1).all()


def test_a_weakly_damped_rig_has_periodic_attractors_only(monkeypatch):
    """zeta = 3e-3: settled after many hundred periods, and until then known to be on its way."""
    monkeypatch.setattr(plans, "SCOUTS", 8)  # each is followed for hundreds of periods
    rig = sl.models.delangre("b", damping_ratio=3e-3)
    ds = sl.basins(rig, periods=2000, **box(3))
    assert set(ds.attractor_type.values) == {"periodic"}
    assert np.median(ds.periods_to_settle) > 300
    starts, labels = cells(ds, 10)
    np.testing.assert_array_equal(labels_of_plain_runs(rig, starts, ds, periods=6000), labels)


def test_long_chaotic_transients_are_no_attractor(monkeypatch):
    """Case b, 13.5 Hz: transients of more than 1000 periods beside a T and a 2T; some last beyond
    4000 and are told to be unconverged.
    """
    monkeypatch.setattr(plans, "SCOUTS", 64)
    rig = sl.models.delangre("b", frequency=13.5)
    ds = sl.basins(rig, **box(12))
    assert ds.attractor_type.values.tolist() == ["periodic"] * 2
    assert ds.attractor_period.values.tolist() == [1, 2]
    assert set(np.unique(ds.basin)) <= {-2, 0, 1}
    assert (ds.basin.values == -2).mean() < 0.03
    assert ds.periods_to_settle.values.max() > 1000
    starts, labels = cells(ds, 60)
    plain = labels_of_plain_runs(rig, starts, ds, periods=8000)
    np.testing.assert_array_equal(plain[labels >= 0], labels[labels >= 0])


# -- fractions -------------------------------------------------------------------------------------
def test_intervals_of_fractions_hold_those_of_a_fine_map():
    """Wilson's 95 % intervals; four of them at once are widened to 99.9 %: 3.29 / 1.96 times as
    wide. The fine map: 80 x 80 cells.
    """
    rig = sl.models.delangre("a", frequency=17.0)
    fine = sl.basins(rig, **box(80))
    some = sl.basin_fractions(rig, samples=2000, x=SPAN_X, v=SPAN_V, progress=False)
    assert (
        some.attractor_period.values.tolist()
        == fine.attractor_period.values.tolist()
        == [1, 1, 3, 9]
    )
    share, wide = some.attractor_fraction.values, 3.29 / 1.96
    assert (
        share - wide * (share - some.attractor_fraction_low.values) < fine.attractor_fraction.values
    ).all()
    assert (
        share + wide * (some.attractor_fraction_high.values - share)
        > fine.attractor_fraction.values
    ).all()
    assert (some.attractor_fraction_low < some.attractor_fraction).all()
    assert (some.attractor_fraction_high - some.attractor_fraction_low < 0.05).all()
    assert some.attrs["smallest_basin_seen"] == pytest.approx(3 / 2000)


def test_the_same_seed_gives_the_same_fractions():
    def share(seed, **more):
        return sl.basin_fractions(
            B16, samples=40, seed=seed, x=SPAN_X, v=SPAN_V, progress=False, **more
        )

    one, again, other = share(7), share(7, threads=1), share(8)
    np.testing.assert_array_equal(one.basin.values, again.basin.values)
    assert one.attrs["result_hash"] == again.attrs["result_hash"]
    assert (one.basin.values != other.basin.values).any()


def test_labels_of_fractions_are_those_of_plain_runs():
    ds = sl.basin_fractions(B4, samples=100, seed=7, x=SPAN_X, v=SPAN_V, progress=False)
    unit = np.random.default_rng(7).random((100, 2))
    starts = np.stack([-5e-3 + 1e-2 * unit[:, 0], -1 + 2 * unit[:, 1]], axis=1)
    np.testing.assert_array_equal(labels_of_plain_runs(B4, starts, ds), ds.basin.values)


def test_fractions_over_one_state():
    """The rest is zero: x alone, from rest."""
    ds = sl.basin_fractions(B16, samples=100, x=SPAN_X, progress=False)
    starts = np.stack(
        [-5e-3 + 1e-2 * np.random.default_rng(1).random((100, 1))[:, 0], np.zeros(100)], axis=1
    )
    np.testing.assert_array_equal(labels_of_plain_runs(B16, starts, ds), ds.basin.values)


def test_a_settled_chunk_is_a_pure_function(known):
    """Twice the same, and each trajectory alone the same as among others."""
    plan, found = known
    whole = plan.chunk(0, found)
    some = np.array([0, 17, 399, 1201])
    alone = settle(plan.map(1), plan.starts(some), found, plan.periods)
    np.testing.assert_array_equal(alone.label, whole.label[some])
    np.testing.assert_array_equal(alone.periods, whole.periods[some])
    np.testing.assert_array_equal(alone.end, whole.end[some])
